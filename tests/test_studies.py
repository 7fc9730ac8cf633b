import json

import numpy as np
import pytest

from olivevib.errors import UsageError
from olivevib.studies import (
    BENCHMARKS,
    PAPER,
    Chart,
    Curve,
    Effort,
    Entry,
    Goal,
    Study,
    Table,
    as_json,
    as_text,
    find,
    write_study,
)


@pytest.fixture
def study():
    table = Table("Errors", ("case", "rmse, px"), (("clean", 0.0021), ("dark", float("nan"))))
    curve = Curve("ours", np.arange(3.0), np.array([1.0, np.nan, 3.0]))
    chart = Chart("errors", "Errors", "tilt, deg", "rmse, px", (curve,), log_y=True)
    goals = (Goal("rmse", "<= 0.002 px", "0.0021 px", False), Goal("found", "all", "all", True))
    return Study("errors", "How far off", (table,), (chart,), goals, (("fits", "1000"),))


def test_a_study_is_kept_as_text_json_and_chart(study, tmp_path):
    names = {path.name for path in write_study(study, tmp_path / "out")}
    assert names == {"errors.md", "errors.json", "errors-errors.svg"}
    kept = json.loads((tmp_path / "out" / "errors.json").read_text())
    assert kept["tables"][0]["rows"][1] == {"case": "dark", "rmse, px": None}
    assert [goal["reached"] for goal in kept["goals"]] == [False, True]
    assert "NOT reached" in as_text(study) and "1000" in as_text(study)
    assert json.loads(as_json(study))["facts"] == {"fits": "1000"}


def test_effort_multiplies_samples_and_draws_a_cell_alike():
    assert Effort(0.1).count(300) == 30
    assert Effort(0.001).count(300, least=4) == 4
    same = [Effort(share).draws(3, 4).normal() for share in (0.1, 1.0)]
    assert same[0] == same[1] != Effort().draws(3, 5).normal()
    with pytest.raises(UsageError):
        Effort(0)


def test_a_name_may_be_short_but_must_be_one_study():
    kind = (Entry("detection", "", "x:y"), Entry("derivation", "", "x:y"))
    assert find(kind, "det").name == "detection"
    for name in ("de", "nothing"):
        with pytest.raises(UsageError, match="no study"):
            find(kind, name)


@pytest.mark.parametrize("entry", [*PAPER, *BENCHMARKS], ids=lambda entry: entry.name)
def test_every_listed_study_exists(entry):
    assert callable(entry.load())
    assert entry.what
