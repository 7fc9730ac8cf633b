"""Parts of long studies are kept, and measured anew when anything that decides them changes."""

from math import inf, isnan, nan

from olivevib.studies import cells


def test_a_cell_is_measured_once_and_survives_as_it_was(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    calls = []

    def measure():
        calls.append(1)
        return [{"a": nan, "b": inf, "c": (1.5, "word", True), "d": {"e": -inf}}]

    first = cells.kept("study", "one", [1, 0.1], measure)
    again = cells.kept("study", "one", [1, 0.1], measure)
    assert len(calls) == 1
    for found in (first[0], again[0]):
        assert isnan(found["a"])
        assert found["b"] == inf
        assert found["c"] == [1.5, "word", True]
        assert found["d"] == {"e": -inf}
    assert list(tmp_path.rglob("*.json")) == [tmp_path / cells.FOLDER / "study" / "one.json"]


def test_other_draws_or_other_sources_are_measured_anew(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cells.kept("study", "one", [1], lambda: 1) == 1
    assert cells.kept("study", "one", [2], lambda: 2) == 2
    monkeypatch.setattr(cells, "source_stamp", lambda: "other")
    assert cells.kept("study", "one", [2], lambda: 3) == 3
