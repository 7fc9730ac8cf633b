"""The report on paper, the season's table, and what is written beside the pages."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import report_scene as scene
from test_report_trial import make_trial

from olivevib.cli import main
from olivevib.errors import UsageError
from olivevib.report import Also, season_table, write_season_report, write_trial_report
from olivevib.report.figures import spectrogram
from olivevib.report.figures.agreement import CommonLine, limits_of_agreement
from olivevib.report.outliers import outliers
from olivevib.report.page import page_facts
from olivevib.report.season_table import COLUMNS, table_csv, trial_rows
from olivevib.vibration import LineStatus


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    return make_trial(tmp_path_factory.mktemp("pdf") / "T04")


@pytest.fixture(scope="module")
def hostile() -> dict:
    name = '#panic("x") $ *a* <b> \\ #import "y"'
    places = {1: "trunk", 2: "branch, #eval(1)", 17: "fixed"}
    return page_facts(scene.content([1, 2, 17], seconds=4.0, name=name, places=places))


def test_the_pdf_is_whole_deterministic_and_takes_text_as_text(hostile):
    pytest.importorskip("typst")
    from olivevib.report.pdf import render_pdf

    pages = render_pdf(hostile)
    assert pages.startswith(b"%PDF") and pages.rstrip().endswith(b"%%EOF")
    assert pages == render_pdf(hostile)
    assert len(pages) < 3_000_000


def test_without_typst_the_line_that_installs_it_is_told(trial, monkeypatch, capsys):
    monkeypatch.setitem(__import__("sys").modules, "typst", None)
    with pytest.raises(UsageError, match="pdf"):
        Also(pdf=True)
    assert main(["report", str(trial.folder), "--pdf"]) == 2
    assert "pip install 'olivevib[pdf]'" in capsys.readouterr().err
    assert not (trial.folder / "report.html").exists()


def test_figures_stand_alone_as_files(trial, tmp_path):
    paths = write_trial_report(trial, tmp_path / "a.html", also=Also(figures=True))
    names = {p.name for p in paths}
    assert {"a.html", "motion.svg", "spectra.svg", "orbits.svg", "sigma-2.svg"} <= names
    for path in paths[1:]:
        text = path.read_text(encoding="utf-8")
        assert text.startswith("<svg xmlns=") and text.endswith("</svg>\n")


def test_the_table_has_a_row_a_marker_and_phase(trial, tmp_path):
    rows = trial_rows(trial)
    table = season_table([trial])
    assert list(table.columns) == list(COLUMNS) and len(table) == len(rows) == 3
    first = table.iloc[0]
    assert (first.trial, first.cultivar, first.marker, first.place) == (
        "T04", "Coratina", 1, "trunk",
    )  # fmt: skip
    motion = trial.vibration.table[0]
    assert first.displacement_pp_mm == motion.displacement_pp_mm
    assert first.amplitude_sigma_x_mm == motion.line.amplitude_sigma[0]
    assert pd.isna(first.left_kg) and first.removed_kg == 31.4 and pd.isna(first.removed_percent)
    (tmp_path / "t.csv").write_text(table_csv(rows), encoding="utf-8")
    back = pd.read_csv(tmp_path / "t.csv")
    np.testing.assert_allclose(back.displacement_pp_mm, table.displacement_pp_mm, rtol=1e-8)
    assert back.status.tolist() == table.status.tolist()


def test_a_formula_in_a_record_is_no_formula_in_the_table(trial):
    row = dict(trial_rows(trial)[0], cultivar='=HYPERLINK("x"),1', damage="-3")
    text = table_csv([row])
    back = pd.read_csv(__import__("io").StringIO(text), dtype=str)
    assert back.cultivar[0] == '\'=HYPERLINK("x"),1'
    assert back.damage[0] == "-3"


def test_the_season_has_its_table_beside_it(trial, tmp_path):
    pytest.importorskip("pyarrow")
    paths = write_season_report([(trial, None)] * 2, tmp_path / "s.html", also=Also(parquet=True))
    assert [p.name for p in paths] == ["s.html", "s.csv", "s.parquet"]
    table, text = pd.read_parquet(paths[2]), pd.read_csv(paths[1])
    assert list(table.columns) == list(text.columns) == list(COLUMNS)
    assert table.marker.tolist() == text.marker.tolist() == [1, 4, 17] * 2
    page = paths[0].read_text(encoding="utf-8")
    assert "Camera against accelerometer" in page and "of 1\u00a0trial" in page


def row(k: int, value: float, **more):
    usual = {"trial": f"T{k}", "marker": 1, "headline": True, "place": "trunk", "verdict": None,
             "displacement_pp_mm": value, "acceleration_rms_m_s2": None, "transmissibility": None,
             "seen_fraction": None, "gain": None, "gain_sigma": None}  # fmt: skip
    return usual | more


def test_outliers_are_those_beyond_the_fences_and_sensors_that_differ():
    rows = [row(k, 5.0 + 0.1 * k) for k in range(9)]
    assert outliers(rows) == []
    far = [*rows, row(9, 50.0), row(10, 50.0, place="fixed"), row(11, 50.0, headline=False)]
    assert [(o.trial, o.marker) for o in outliers(far)] == [("T9", 1)]
    (one,) = outliers([row(0, 5.0, verdict="differs", gain=1.2, gain_sigma=0.01)])
    assert "1.200 ± 0.010" in one.value.replace("\u00a0", " ")
    assert outliers([row(k, v) for k, v in enumerate((1.0, 2.0, 90.0))]) == []


def test_limits_of_agreement_are_those_of_the_differences():
    rng = np.random.default_rng(2)
    lines = [
        CommonLine("T", 12, 10 * (1 + e), 0.1, 10.0, 0.1) for e in rng.normal(0.02, 0.01, 4000)
    ]
    middle, low, high = limits_of_agreement(lines)
    assert middle == pytest.approx(2, abs=0.06)
    assert high - low == pytest.approx(2 * 1.96, rel=0.04)


def test_the_spectrogram_shows_the_line_where_it_is_and_its_power():
    path = replace(scene.trajectory([1, 2, 3], 8.0), method="optimal")
    one = spectrogram(path, 3, 15.0)
    middle = (one.t_s > 2.5) & (one.t_s < 5.0)
    assert np.abs(one.ridge_hz[middle] - 12.003).max() < 0.5
    size = np.array([1.5, 0.8, 0.5]) + np.array([1.0, 0.4, 0.2])
    assert np.nanmax(one.power[:, middle]) == pytest.approx(np.sum(size**2) / 2, rel=0.15)


def test_sway_does_not_take_the_ridge_of_a_spectrogram():
    """Sway of 9 mm beside a line of 3 mm: the strongest frequency is that of the line."""
    path = scene.trajectory([1, 2, 3], 8.0)
    sway = 9.0 * np.sin(2 * np.pi * 1.0 * path.sample_t_s)
    path = replace(path, xyz_mm=path.xyz_mm + sway[..., None])
    shaken = slice(25, 50)
    assert np.median(spectrogram(path, 3, 15.0).ridge_hz[shaken]) < 3.0
    ridge = spectrogram(path, 3, 15.0, 2.5).ridge_hz[shaken]
    assert np.abs(ridge - 12.003).max() < 0.5


def test_lines_that_are_all_blind_leave_no_empty_figure():
    facts = page_facts(scene.content([1, 2, 17], LineStatus.BLIND, seconds=4.0))
    assert "frequency" not in facts["plates"]
    assert any("whose frequency" in why for _, why in facts["missing"])


def test_a_damaged_stage_is_named_and_the_rest_is_reported(tmp_path, capsys):
    trial = make_trial(tmp_path / "T05")
    with (trial.folder / "vibration.h5").open("ab") as file:
        file.write(b"x")
    assert main(["report", str(trial.folder)]) == 3  # its recordings are not there
    page = (trial.folder / "report.html").read_text(encoding="utf-8")
    assert "vibration.h5 is left out here" in page and "file-damaged" in page
    assert re.search("<svg", page)
    capsys.readouterr()
    assert main(["show", str(trial.folder)]) == 0
    assert "file-damaged" in capsys.readouterr().out
    (trial.folder / "report.html").write_text("<html>", encoding="utf-8")
    assert main(["check", str(trial.folder)]) in (1, 3)
    out = capsys.readouterr().out
    assert "remake   vibration.h5" in out and "remake   report.html" in out
