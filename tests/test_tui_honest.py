"""What failed is told whole, what is old is marked, no value has more digits than it deserves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import tui_scene as scene
from rich.style import Style
from textual.widgets import DataTable
from tui_app import press, screen_text, started
from tui_live import live

from olivevib.trial import Trial
from olivevib.tui.screens.error import ErrorScreen
from olivevib.tui.views.live import state_text
from olivevib.tui.views.of_results import orbits_of
from olivevib.tui.views.old import old_words
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.tables import facts_text, marker_row
from olivevib.tui.views.words import alone, marker_frequency, with_spread

SIZES = pytest.mark.parametrize("size", [(120, 40), (80, 24)], ids=["120x40", "80x24"])
FAULT = scene.FAULT


@pytest.fixture(scope="session")
def measured(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("honest") / "olive"
    (folder / "trials").mkdir(parents=True)
    scene.measured_trial(folder / "trials/T04")
    return folder


@pytest.fixture
def workspace(measured, tmp_path, monkeypatch) -> Path:
    return scene.at_work(measured, tmp_path, monkeypatch)


def flat(text: str) -> str:
    """What is on screen without the lines of the panes and the breaks of wrapped text."""
    return " ".join(text.translate(dict.fromkeys(map(ord, "│▁▅▆▇█▃▂▄▊▎"), " ")).split())


# -- what failed ----------------------------------------------------------------------------------


@SIZES
async def test_a_failure_is_told_whole_in_the_list_on_the_trial_and_behind_enter(workspace, size):
    scene.swapped(workspace / "trials/T04")
    async with started(workspace, size) as (app, pilot):
        for part in (FAULT.what, "Next: Exchange [cameras.left]", FAULT.why):
            assert part in flat(screen_text(app))
        await press(pilot, "enter")
        text = flat(screen_text(app))
        assert "No warnings" not in text
        assert "What failed" in text
        pane = flat(str(app.screen.query_one("#warning-text").render()))
        for part in (f"✗ reconstruct failed: {FAULT.what}", FAULT.why, f"Next: {FAULT.remedy}"):
            assert part in pane
        assert pane.count("✗") == 1  # what only waits for it is not a failure of its own
        await press(pilot, "down", "down", "enter")
        assert isinstance(app.screen, ErrorScreen)
        sheet = flat(str(app.screen.query_one(".dialog > Static").render()))
        for part in (FAULT.what, FAULT.why, FAULT.remedy):
            assert part in sheet


@SIZES
async def test_no_pane_reads_for_ever_where_a_stage_failed(workspace, size):
    scene.swapped(workspace / "trials/T04")
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "enter")
        for page in ("v", "v 2", "m", "c", "g"):
            await press(pilot, *page.split())
            assert "reading …" not in screen_text(app)
            assert FAULT.remedy in flat(screen_text(app))
            await press(pilot, "escape")


async def test_a_trial_that_is_not_calibrated_says_so_in_every_pane(workspace):
    scene.new_trial(workspace / "trials/T05")
    async with started(workspace) as (app, pilot):
        await press(pilot, "down", "enter", "b")
        assert screen_text(app).count("No calibration: calibrate") == 3
        assert "reading …" not in screen_text(app)


async def test_a_page_whose_files_cannot_be_read_says_so_where_it_would_show_them(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter")
        (workspace / "trials/T04/trial.toml").write_text("[markers]\nsize = 5\n", encoding="utf-8")
        await press(pilot, "v", "escape")
        assert "reading …" not in screen_text(app)
        assert "markers.size" in screen_text(app)


# -- what is old ----------------------------------------------------------------------------------


@SIZES
async def test_old_numbers_say_since_when_at_the_numbers(workspace, size):
    Trial.open(workspace / "trials/T04").changed({"markers.size_mm": 45.0})
    old = "from before the setting markers.size_mm changed"
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "enter")
        assert old in flat(str(app.screen.query_one("#fact-text").render()))
        for page in ("v", "m", "c", "g"):
            await press(pilot, page)
            assert f"OLD NUMBERS, {old}" in flat(screen_text(app))
            await press(pilot, "escape")
        await press(pilot, "v", "3")
        assert screen_text(app).count(old) >= 2  # above all, and on the table's own border
        table = app.screen.query_one("#markers", DataTable)
        cells = [str(cell) for cell in table.get_row_at(0)]
        assert all(cells[k].startswith("◐ ") for k in (2, 3, 5, 6, 7, 8))


async def test_numbers_of_now_carry_no_mark(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "v")
        assert "OLD" not in screen_text(app)
        assert "◐" not in screen_text(app)


def test_the_words_are_those_of_show_of_the_first_stage_that_is_old():
    told = {"track": None, "reconstruct": None, "analyse": "are from before left.nut changed"}
    summary = {"stages": {name: {"old": old} for name, old in told.items()}}
    assert old_words(summary, "reconstruct", "analyse") == "from before left.nut changed"
    assert old_words(summary, "track", "reconstruct") == ""


# -- values ---------------------------------------------------------------------------------------


def marker(size: float, sigma: float) -> dict[str, object]:
    axes = dict.fromkeys("xyz", size)
    return {
        "id": 3, "place": "trunk", "seen_fraction": 1.0, "frequency_hz": 25.0,
        "frequency_sigma_hz": 0.01, "frequency_clock_sigma_hz": 0.00125,
        "frequency_status": "direct", "frequency_candidates_hz": [],
        "amplitude_mm": axes, "amplitude_sigma_mm": dict.fromkeys("xyz", sigma),
        "displacement_pp_mm": 2 * size, "displacement_pp_sigma_mm": 2 * sigma,
        "acceleration_rms_m_s2": 30.0,
    }  # fmt: skip


def test_a_value_has_its_sigma_and_no_more_digits_than_that_allows():
    assert with_spread(1.897, 1.1, 3) == "1.9 ± 1.1"
    assert with_spread(1.8974, 0.0123, 3) == "1.897 ± 0.012"
    assert with_spread(1.8974, None, 3) == "1.897"
    assert with_spread(None, 1.0, 3) == "–"
    assert with_spread(2.0e-3, 5e-5, 2, 1e3, "ms") == "2.000 ± 0.050 ms"
    assert alone(31.234, 2.2, 2) == "31.2"
    cells = [cell.plain for cell in marker_row(marker(1.897, 1.1), Palette())]
    assert cells[5:8] == ["1.9 ± 1.1"] * 3
    assert cells[3] == "3.8 ± 2.2"
    assert cells[8] == "30 ± 10"  # three axes, each of them 58 % in doubt


def test_an_old_row_is_marked_in_words_and_in_style():
    warn = Palette(warn=Style(color="yellow"))
    now, old = (marker_row(marker(2.0, 0.1), warn, old) for old in (False, True))
    assert not any("◐" in cell.plain for cell in now)
    assert old[7].plain == "◐ 2.00 ± 0.10"
    assert old[7].style == warn.warn
    assert now[7].style != warn.warn


def test_offset_and_orbits_are_told_as_far_as_they_are_known(measured):
    from olivevib.trial.summary import summary

    told = summary(Trial.open(measured / "trials/T04"))
    assert "offset 2.100 ± 0.050 ms" in facts_text(told, Palette()).plain
    told["markers"][0]["displacement_pp_sigma_mm"] = 3.0
    path = Trial.open(measured / "trials/T04").trajectory
    assert path is not None
    size = told["markers"][0]["displacement_pp_mm"]
    assert orbits_of(path, None, told)[0].caption == f"trunk · {size:.1f} mm"


def test_cameras_in_step_are_said_to_be_in_step():
    step, apart = (
        state_text(replace(live(4.0), offset_s=offset), Palette()).plain
        for offset in (0.00001, -0.0093)
    )
    assert "cameras in step (0.0 ms apart)" in step
    assert "cameras 9.3 ms apart ·" in apart


def test_a_frequency_reads_as_in_show_its_clock_included(measured):
    from olivevib.cli.summary_text import frequency
    from olivevib.trial.summary import summary

    markers = summary(Trial.open(measured / "trials/T04"))["markers"]
    assert markers
    for told in markers:
        assert marker_frequency(told) == frequency(told)
        assert marker_frequency({**told, "frequency_clock_sigma_hz": 0.1}) != frequency(told)
