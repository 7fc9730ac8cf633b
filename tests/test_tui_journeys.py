"""Journeys through the app by keys and by mouse, on a real workspace on disk."""

from __future__ import annotations

import shutil
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import tui_scene as scene
from small_videos import make_video
from test_row_time_verb import film
from textual.widgets import DataTable, Input, Static
from tui_app import press, screen_text, settle, shown, started

from olivevib.cli import main
from olivevib.errors import InputError
from olivevib.files.prints import marker_text
from olivevib.marker import load_library
from olivevib.pipeline.machine import Check
from olivevib.progress import Cancelled
from olivevib.trial import Trial
from olivevib.tui.screens.error import ErrorScreen
from olivevib.tui.screens.new_trial import NewTrialPage
from olivevib.tui.screens.report import ReportPage
from olivevib.tui.screens.results import ResultsPage
from olivevib.tui.screens.trial import TrialPage
from olivevib.tui.screens.trials import TrialsPage
from olivevib.tui.themes import DARK, SUNLIGHT
from olivevib.tui.views.folder import bytes_words
from olivevib.tui.widgets.picture import Picture
from olivevib.tui.work import Result, Work


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> Path:
    return scene.workspace(tmp_path_factory.mktemp("tui") / "olive")


@pytest.fixture
def workspace(made, tmp_path, monkeypatch) -> Path:
    shutil.copytree(made, tmp_path / "olive")
    monkeypatch.chdir(tmp_path / "olive")
    return tmp_path / "olive"


async def test_the_list_tells_the_state_of_every_trial(workspace):
    async with started(workspace) as (app, pilot):
        text = screen_text(app)
        for start in ("2026-11-20_T04  clean", "2026-11-20_T05  warnings", "2026-11-21_T06  unfi"):
            assert start in text
        assert "○ missing" in text
        assert "– skipped" in text
        await press(pilot, "down")
        assert "frequency-undecided" in words(app, "#why")


async def test_from_the_list_to_results_report_and_back_by_keys(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter")
        assert isinstance(app.screen, TrialPage)
        assert "● done" in screen_text(app)
        await press(pilot, "v")
        assert isinstance(app.screen, ResultsPage)
        await press(pilot, "escape", "e")
        assert isinstance(app.screen, ReportPage)
        await press(pilot, "down", "down", "down")
        contents = words(app, "#preview")
        assert "time_s, marker, x_mm" in contents
        assert "marker 9 12 times in 1 stretch" in contents
        said = contents.split(" · ")[1].split("\n")[0]
        await press(pilot, "enter")
        size = (workspace / "trials/2026-11-20_T04/exports/2026-11-20_T04.csv").stat().st_size
        assert bytes_words(size) == said  # the preview told the size of what is written
        assert (workspace / "trials/2026-11-20_T04/exports/2026-11-20_T04.csv").is_file()
        assert "made" in screen_text(app)
        await press(pilot, "escape", "escape")
        assert isinstance(app.screen, TrialsPage)


async def test_an_export_holds_the_markers_that_were_chosen_by_keys(workspace):
    target = workspace / "trials/2026-11-20_T04/exports/2026-11-20_T04.csv"
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "e", "down", "down", "down")
        assert "holds    markers 1, 2, 5, 9" in words(app, "#preview")
        await press(pilot, "f", "tab", "text:9,2", "enter")
        assert "exports hold markers 9, 2 only" in screen_text(app)
        assert "holds    markers 2, 9" in words(app, "#preview")
        await press(pilot, "enter")
        rows = target.read_text(encoding="utf-8").splitlines()
        assert {row.split(",")[1] for row in rows if row[:1].isdigit()} == {"2", "9"}
        await press(pilot, "f", "down", "down", "enter")  # the list: all, 1, 2, 5, 9
        assert "exports hold marker 2 only" in screen_text(app)
        await press(pilot, "f", "tab", *["backspace"] * 3, "text:7", "enter")
        assert "this trajectory has no marker 7" in words(app, "#preview")
        await press(pilot, "f", "tab", "backspace", "enter")
        assert "holds    markers 1, 2, 5, 9" in words(app, "#preview")


@pytest.mark.slow
async def test_the_report_is_made_and_its_place_shown(workspace):
    async with started(workspace, (80, 24)) as (app, pilot):
        await press(pilot, "enter", "e", "p")
        page = workspace / "trials/2026-11-20_T04/report.html"
        assert page.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
        assert page.read_text(encoding="utf-8").lower().startswith("<!doctype html>")
        assert "Made: trials/2026-11-20_T04/report.html" in screen_text(app)


async def test_one_stage_runs_and_the_state_is_read_from_the_files(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "down", "down", "enter", "t")
        folder = workspace / "trials/2026-11-21_T06"
        assert (folder / "calibration.h5").is_file()
        assert app.progress is None
        table = app.screen.query_one("#stages", DataTable)
        assert str(table.get_cell_at((0, 1))) == "● done"
        shutil.copy(folder / "shared_rig.toml", folder / "calibration.h5")
        app.revision += 1
        await settle(pilot)
        assert str(table.get_cell_at((0, 1))) == "◐ stale"


async def test_a_failure_is_shown_until_it_is_read_and_keeps_what_was_done(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "down", "down", "enter", "r")
        assert isinstance(app.screen, ErrorScreen)
        text = words(app, ".dialog > Static")
        assert "left.avi is not a video" in text
        assert "Next:" in text
        await press(pilot, "escape")
        table = app.screen.query_one("#stages", DataTable)
        assert [str(table.get_cell_at((k, 1))) for k in range(2)] == ["● done", "✗ failed"]
        recording = workspace / "trials/2026-11-21_T06/left.avi"
        assert recording.read_bytes() == b"not decoded in these tests"


class Endless:
    """Work that goes on until it is cancelled."""

    def __init__(self) -> None:
        self.started, self.stopped = threading.Event(), threading.Event()

    def __call__(self, tick) -> Result:
        try:
            while True:
                tick(30, 120, "tracking markers")
                self.started.set()
                time.sleep(0.005)
        except Cancelled:
            self.stopped.set()
            raise


def told(app) -> str:
    """The outcome of the last work."""
    return app.said.words if app.said else ""


def words(app, selector: str) -> str:
    """The text of a widget."""
    return str(app.screen.query_one(selector, Static).render())


async def running(pilot, endless: Endless) -> None:
    """Wait until the work has been shown."""
    while not (endless.started.is_set() and pilot.app.progress.total):
        await pilot.pause(0.01)


async def test_escape_cancels_and_says_that_work_is_kept(workspace):
    endless = Endless()
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter")
        app.start(Work("T04: run", endless))
        await running(pilot, endless)
        assert "30/120" in screen_text(app)
        assert "Esc cancels, work is kept" in screen_text(app)
        await press(pilot, "escape")
        assert endless.stopped.is_set()
        assert isinstance(app.screen, TrialPage)
        assert app.progress is None
        assert "Cancelled; finished work is kept" in told(app)
        await press(pilot, "escape")
        assert isinstance(app.screen, TrialsPage)


async def test_the_table_of_stages_follows_the_work(workspace):
    folder = workspace / "trials/2026-11-20_T04"
    (folder / "comparison.h5").rename(folder / "away")
    (folder / "vibration.h5").rename(folder / "too")
    endless = Endless()
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter")
        table = app.screen.query_one("#stages", DataTable)

        def states() -> list[str]:
            return [str(table.get_cell_at((k, 1))) for k in (2, 3, 4)]

        app.start(Work("2026-11-20_T04: run", endless))
        await running(pilot, endless)
        await pilot.pause(0.1)
        assert states() == ["● done", "▶ running", "○ missing"]
        (folder / "too").rename(folder / "vibration.h5")  # as the work would
        while states()[1] != "● done":
            await pilot.pause(0.05)
        assert states() == ["● done", "● done", "▶ running"]
        app.action_cancel_work()
        await settle(pilot)
        assert states()[2] == "○ missing"


async def test_one_work_at_a_time_and_screens_stay_usable(workspace):
    endless = Endless()
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter")
        app.start(Work("T04: run", endless))
        await running(pilot, endless)
        await pilot.press("r")
        await pilot.pause()
        assert isinstance(app.screen, ErrorScreen)
        await pilot.press("escape")
        await pilot.press("l")
        await pilot.pause()
        assert app.theme == SUNLIGHT
        app.action_cancel_work()
        await settle(pilot)
        assert endless.stopped.is_set()


async def test_leaving_stops_the_work_first(workspace):
    endless = Endless()
    async with started(workspace) as (app, pilot):
        app.start(Work("T04: run", endless))
        await running(pilot, endless)
        await pilot.press("q")
        await settle(pilot)
    assert endless.stopped.is_set()
    assert app.return_code == 0


async def test_an_unforeseen_error_does_not_take_the_app_down(workspace):
    async with started(workspace) as (app, pilot):
        app.start(Work("x", lambda tick: 1 / 0))
        await settle(pilot)
        assert isinstance(app.screen, ErrorScreen)
        assert "ZeroDivisionError" in screen_text(app)


# -- results --------------------------------------------------------------------------------------


async def test_markers_are_chosen_by_key_table_mouse_and_palette(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "v")
        await press(pilot, "right_square_bracket")
        assert "▶2 trunk" in screen_text(app)
        await press(pilot, "left_square_bracket", "left_square_bracket")
        assert "▶9 twig" in screen_text(app)
        await pilot.click("#orbits", offset=(5, 3))
        await settle(pilot)
        assert "▶1 trunk" in screen_text(app)
        await press(pilot, "j", "m", "down", "down")
        assert "▶5 branch" in screen_text(app)
        await press(pilot, "ctrl+p", "text:marker9", "down", "enter")
        assert "▶9 twig" in screen_text(app)
        assert "marker 9 twig" in screen_text(app)


async def test_spectrum_cursor_axis_and_quantity(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "v", "2", "right")
        assert "12.000 Hz" in screen_text(app)
        await press(pilot, "a")
        assert "displacement x ·" in screen_text(app)
        await press(pilot, "y", "y")
        assert "acceleration x ·" in screen_text(app)
        assert "m/s²│" in screen_text(app)
        await pilot.click("#spectrum", offset=(20, 8))
        await settle(pilot)
        assert "12.000 Hz" not in screen_text(app).replace("12.0000", "")


async def test_a_small_terminal_shows_one_pane_at_a_time(workspace):
    async with started(workspace, (80, 24)) as (app, pilot):
        await press(pilot, "enter", "v")
        panes = app.screen.query("#results > .pane")
        assert [pane.id for pane in panes if pane.display] == ["orbits"]
        await press(pilot, "z")
        assert "direct" in screen_text(app)
        await press(pilot, "3")
        assert "p-p mm" in screen_text(app)


async def test_an_undecided_frequency_is_never_a_single_number(workspace):
    async with started(workspace, (80, 24)) as (app, pilot):
        await press(pilot, "down", "v", "2")
        text = screen_text(app)
        assert "ambiguous: 5.00, 12.00, 18.00, 25.00, 42.00 Hz" in text
        assert "12.0000" not in text


async def test_a_trial_without_results_says_what_to_do(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "down", "down", "v")
        assert "No path of any marker: reconstruct is blocked" in screen_text(app)
        assert "r runs the stages" in screen_text(app)
        await press(pilot, "m")
        assert "Not analysed yet" in screen_text(app)
        await press(pilot, "escape", "escape", "c")
        assert "no accelerometer file is named" in screen_text(app)


# -- motion, comparison, settings, pictures -------------------------------------------------------


async def test_motion_zooms_and_moves_along(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "m")
        assert "start-up" in screen_text(app)
        await press(pilot, "plus", "plus", "right", "right", "home")
        assert app.screen._zoom == 0
        await pilot.click("#curves", offset=(60, 10))
        await settle(pilot)
        assert app.screen._zoom == 1
        await press(pilot, "right_square_bracket")
        assert "marker 2 trunk" in screen_text(app)


async def test_the_comparison_shows_overlay_difference_and_verdict(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "c")
        assert "agrees: the gain is within two" in screen_text(app)
        assert "camera, over it the sensor" in screen_text(app)
        await press(pilot, "d")
        assert "camera − sensor" in screen_text(app)


async def test_a_setting_is_changed_checked_and_makes_stale(workspace):
    folder = workspace / "trials/2026-11-20_T04"
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "s", "ctrl+p", "text:setmarkerssize", "down", "enter")
        field = app.screen.query_one("#value", Input)
        assert field.value == "60.0"
        field.value = "wide"
        await press(pilot, "enter")
        assert isinstance(app.screen, ErrorScreen)
        assert Trial.open(folder).settings.markers.size_mm == 60.0
        await press(pilot, "escape", "enter")
        app.screen.query_one("#value", Input).value = "45"
        await press(pilot, "enter")
        assert Trial.open(folder).settings.markers.size_mm == 45
        await press(pilot, "escape")
        assert "the setting markers.size_mm changed" in screen_text(app)


@pytest.mark.slow
async def test_an_accelerometer_is_bound_to_a_marker(workspace):
    folder = workspace / "trials/2026-11-20_T05"
    async with started(workspace) as (app, pilot):
        await press(
            pilot, "down", "enter", "s", "ctrl+p", "text:setaccelerometers", "down", "enter"
        )
        app.screen.query_one("#value", Input).value = '[{file = "accelerometer.csv", marker = 5}]'
        await press(pilot, "enter", "escape")
        assert [(a.file, a.marker) for a in Trial.open(folder).settings.accelerometers] == [
            ("accelerometer.csv", 5)
        ]
        assert "○ missing" in screen_text(app)
        await press(pilot, "s", "ctrl+p", "text:setaccelerometers", "down", "enter")
        app.screen.query_one("#value", Input).value = ""
        await press(pilot, "enter", "escape")
        assert Trial.open(folder).settings.accelerometers == ()


@pytest.mark.slow
async def test_pictures_show_markers_and_step_through_the_recording(workspace):
    folder = workspace / "trials/2026-11-20_T04"
    make_video(folder / "left.avi", "ffv1", frames=12, size=(640, 480))
    make_video(folder / "right.avi", "ffv1", frames=12, size=(640, 480))
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "k")
        assert "left  frame 0 of 240" in screen_text(app)
        assert "4 markers" in screen_text(app)
        await press(pilot, "right", "right", "left")
        assert "frame 1 of 240" in screen_text(app)
        await press(pilot, "o")
        assert "right  frame 1 of 240" in screen_text(app)
        await press(pilot, "right_square_bracket")
        assert "marker 2 seen" in screen_text(app)
        await press(pilot, "pagedown")
        assert "frame 11 of 240" in screen_text(app)
        await press(pilot, "home", "space")
        while app.screen._shot.index < 2:
            await pilot.pause(0.05)
        await press(pilot, "space")
        assert app.screen._playing is None


async def test_markers_are_found_in_one_picture_with_the_parameters_of_now(workspace):
    folder = workspace / "trials/2026-11-20_T04"
    for side in ("left", "right"):
        scene.marker_video(folder / f"{side}.avi", 5)
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "k", "i")
        assert "1 marker found in this picture alone" in screen_text(app)
        assert "marker 5 seen" in screen_text(app)
        trial = Trial.open(folder).changed({"detection.fill": 1.0, "detection.mode": "paper"})
        assert trial.settings.detection.fill == 1.0
        await press(pilot, "right", "left")
        assert "no markers found in this picture alone" in screen_text(app)
        await press(pilot, "i")
        assert "4 markers tracked here" in screen_text(app)


async def test_a_broken_recording_is_told_where_the_picture_would_be(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "k")
        assert isinstance(app.screen, ErrorScreen)
        await press(pilot, "escape")
        assert "is not a video" in screen_text(app)


# -- new trials -----------------------------------------------------------------------------------


async def test_a_new_trial_is_made_from_two_recordings_by_keys(workspace, tmp_path):
    raw = tmp_path / "raw"
    raw.mkdir()
    for side in ("left", "right"):
        make_video(raw / f"{side}.avi", frames=5, size=(640, 480))
    shutil.copy(workspace / "trials/2026-11-21_T06/shared_rig.toml", raw / "rig.toml")
    async with started(workspace) as (app, pilot):
        await press(pilot, "n")
        assert isinstance(app.screen, NewTrialPage)
        await press(pilot, "text:T07", "enter")
        app.screen.query_one("#left", Input).value = str(raw / "left.avi")
        await press(pilot, "enter")
        assert app.screen.query_one("#right", Input).value == str(raw / "right.avi")
        assert "left, 640 × 480 px" in str(app.screen.query_one("#left-first").border_title)
        app.screen.query_one("#rig", Input).value = str(raw / "rig.toml")
        app.screen.query_one("#band", Input).value = "5-14"
        await press(pilot, "ctrl+s")
        assert isinstance(app.screen, TrialPage), screen_text(app)
    trial = Trial.open(workspace / "trials/T07")
    assert trial.settings.vibration.band_hz == (5.0, 14.0)
    assert (raw / "left.avi").is_file()


async def test_several_accelerometers_are_added_and_taken_out_by_keys(workspace, tmp_path):
    raw = tmp_path / "raw"
    raw.mkdir()
    for side in ("left", "right"):
        make_video(raw / f"{side}.avi", frames=5, size=(640, 480))
    for name in ("a", "b", "c"):
        rows = "".join(f"{k / 100:.2f},0.0,9.81,{0.1 * (k % 7):.2f}\n" for k in range(200))
        (raw / f"{name}.csv").write_text(f"t [s],x [m/s2],y [m/s2],z [m/s2]\n{rows}")
    async with started(workspace) as (app, pilot):
        await press(pilot, "n", "text:T07")
        for side in ("left", "right"):
            app.screen.query_one(f"#{side}", Input).value = str(raw / f"{side}.avi")
        for line in ("accelerometer", "accelerometer2", "accelerometer3"):
            if line != "accelerometer":
                await press(pilot, "f2")
                assert app.focused.id == line
            app.screen.query_one(f"#{line}", Input).focus()
            name = {"accelerometer": "a", "accelerometer2": "b"}.get(line, "c")
            keys = ("enter", "text:5", "enter", "text:x,-z,y", "enter", "text:0,25,-8")
            await press(pilot, f"text:{raw / name}.csv", *keys)
        app.screen.query_one("#accelerometer_marker", Input).value = "9"
        app.screen.query_one("#accelerometer3_lever", Input).value = "25"
        await press(pilot, "ctrl+s")
        assert "“lever of 3, mm”: '25' cannot be read" in words(app, ".dialog > Static")
        await press(pilot, "escape")
        assert app.focused.id == "accelerometer3_lever"
        app.screen.query_one("#accelerometer3_lever", Input).value = ""
        app.screen.query_one("#accelerometer2", Input).focus()
        await press(pilot, "f3")
        assert app.focused.id == "accelerometer2"
        assert not app.screen.query("#accelerometer3")
        await press(pilot, "ctrl+s")
        assert isinstance(app.screen, TrialPage), screen_text(app)
    trial = Trial.open(workspace / "trials/T07")
    sensors = trial.settings.accelerometers
    assert [(s.marker, s.axes, s.lever_mm) for s in sensors] == [
        (9, ("x", "-z", "y"), (0, 25, -8)), (5, ("x", "-z", "y"), (0.0, 0.0, 0.0))
    ]  # fmt: skip
    copies = [trial.path(s.file).read_bytes() for s in sensors]
    assert copies == [(raw / f"{name}.csv").read_bytes() for name in ("a", "c")]


async def test_a_new_trial_takes_over_the_settings_of_the_marked_one(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "N")
        form = {f: app.screen.query_one(f"#{f}", Input).value for f in ("size", "ids", "shutter")}
        assert form == {"size": "60", "ids": "1,2,5,9", "shutter": "global"}
        assert app.screen.query_one("#rig", Input).value.endswith("2026-11-20_T04/rig.toml")
        assert app.screen.query_one("#left", Input).value == ""


async def test_the_calibration_page_tells_coverage_and_verdict(workspace):
    async with started(workspace, (80, 24)) as (app, pilot):
        await press(pilot, "enter", "enter")
        assert "taken over from shared_rig.toml" in screen_text(app)
        assert "hardly any upper left" in screen_text(app)
        await press(pilot, "o")
        assert "right camera" in screen_text(app)
        await press(pilot, "escape", "escape", "down", "down", "enter", "b")
        assert "Not calibrated yet" in screen_text(app)


async def test_the_sigma_to_expect_is_mapped_by_key_as_the_command_prints_it(workspace, capsys):
    folder = workspace / "trials/2026-11-20_T04"
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "b", "S")
        assert "carries no covariance" in words(app, ".dialog > Static")
        await press(pilot, "escape")
        scene.unsure(folder)
        await press(pilot, "S")
        assert "exports/2026-11-20_T04-sigma.csv" in told(app), screen_text(app)
        map_ = words(app, "#verdict-text")
    assert main(["calibrate", "--sigma", "2026-11-20_T04"]) == 0
    printed = capsys.readouterr().out
    assert (folder / "exports/2026-11-20_T04-sigma.csv").read_text(encoding="utf-8") == printed
    rows = np.array([line.split(",") for line in printed.splitlines()[1:]], dtype=float)
    assert f"{len(rows)} places" in map_
    farthest = rows[rows[:, 2] == rows[:, 2].max()]
    depth = np.hypot(farthest[:, 5], farthest[:, 8]).max()
    assert f"{farthest[0, 2]:.0f} mm" in map_
    assert f"{depth:.3f}" in map_.split("in depth")[1].splitlines()[1]
    assert f"{rows[:, 9].max():.3f} mm." in map_


async def test_a_new_trial_that_cannot_be_made_says_why_and_keeps_the_form(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "n", "text:T07", "ctrl+s")
        assert isinstance(app.screen, ErrorScreen)
        assert "left recording is not named" in screen_text(app)
        await press(pilot, "escape")
        assert app.screen.query_one("#trial", Input).value == "T07"
        assert not (workspace / "trials/T07").exists()


async def test_a_file_is_picked_by_typing_part_of_its_name(workspace, tmp_path):
    (tmp_path / "raw").mkdir()
    for name in ("left.avi", "right.avi"):
        make_video(tmp_path / "raw" / name, frames=3)
    async with started(workspace) as (app, pilot):
        await press(
            pilot, "n", "tab", "ctrl+o", "backspace", "text:raw", "enter", "text:le", "enter"
        )
        assert app.screen.query_one("#left", Input).value == str(tmp_path / "raw" / "left.avi")
        assert app.screen.query_one("#right", Input).value == str(tmp_path / "raw" / "right.avi")
        assert app.screen.query_one("#left-first", Picture)._shown is not None
        await press(pilot, "escape", "n", "tab", "ctrl+o")  # begins where it was left
        assert "left.avi" in screen_text(app)
        await press(pilot, "text:nothing")
        assert "nothing here by that name" in screen_text(app)
        await press(pilot, "escape", "tab", "tab", "ctrl+o", "ctrl+t")
        assert app.screen.query_one("#calibration_left", Input).value == str(tmp_path / "raw")


async def test_a_second_trial_begins_as_the_last_one(workspace):
    folder = workspace / "trials/2026-11-20_T05"
    said = {"cameras.left.exposure_ms": 2.5, "markers.size_mm": 72.5, "session.operator": "Ana"}
    Trial.open(folder).changed(said)
    async with started(workspace) as (app, pilot):
        await press(pilot, "n")
        names = ("size", "exposure", "operator", "place", "cultivar", "rig", "left")
        form = [app.screen.query_one(f"#{name}", Input).value for name in names]
        assert form == ["72.5", "2.5", "Ana", "Bari, plot 7", "Coratina", "", ""]
        assert "Taken from 2026-11-20_T05, check it: " in screen_text(app)


async def test_the_form_says_in_its_own_words_what_is_wrong(workspace, tmp_path):
    for side in ("left", "right"):
        make_video(tmp_path / f"{side}.avi", frames=3)
    (tmp_path / "broken.avi").write_bytes(b"no video")
    async with started(workspace) as (app, pilot):
        await press(pilot, "n", "tab", f"text:{tmp_path / 'broken.avi'}", "enter")
        assert "“left recording”" in words(app, "#told")
        assert "is not a video" in words(app, "#told")
        app.screen.query_one("#left", Input).value = str(tmp_path / "left.avi")
        app.screen.query_one("#right", Input).value = str(tmp_path / "right.avi")
        for name, text in (("size", "wide"), ("ids", "1-400"), ("band", "9"), ("board", "x:1")):
            line = app.screen.query_one(f"#{name}", Input)
            was, line.value = line.value, text
            await press(pilot, "ctrl+s")
            assert isinstance(app.screen, ErrorScreen)
            told = words(app, ".dialog > Static")
            assert f"“{line.parent.query_one('Label').content}”" in told
            assert "--" not in told
            await press(pilot, "escape")
            assert app.focused is line
            line.value = was
        await press(pilot, "enter")
        assert "Not said yet" in words(app, "#told")
        assert "--" not in words(app, "#told")


# -- everywhere -----------------------------------------------------------------------------------


async def test_an_empty_folder_says_what_to_do_first(tmp_path):
    async with started(tmp_path, (80, 24)) as (app, pilot):
        assert "is no workspace yet" in screen_text(app)
        assert "make a trial from two recordings" in screen_text(app)
        await press(pilot, "r", "enter", "v", "l", "q")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
async def test_help_footer_and_palette_on_every_screen(workspace):
    async with started(workspace, (80, 24)) as (app, pilot):
        for keys in ("", "enter", "v", "escape m", "escape c", "escape b", "escape e", "escape s"):
            await press(pilot, *keys.split())
            await look_around(app, pilot)
        await press(pilot, "escape", "escape", "n")
        await look_around(app, pilot)
        for tool in "PBWML":
            await press(pilot, "escape", tool)
            await look_around(app, pilot)


async def look_around(app, pilot) -> None:
    """At most seven keys in the footer; help and palette open and close."""
    name = app.screen.NAME
    footer = [b for b in app.screen.active_bindings.values() if b.binding.show and b.enabled]
    assert len({b.binding.action for b in footer}) <= 6  # and the palette's key makes seven
    footer_end = app.screen.query("FooterKey").last().region
    assert footer_end.right <= app.size.width
    await press(pilot, "f1")
    assert f"Help: {name}" in screen_text(app)
    await press(pilot, "escape", "ctrl+p")
    assert "Search for commands" in screen_text(app)
    await press(pilot, "escape")
    assert name == app.screen.NAME


async def test_jump_mode_reaches_panes_by_letter(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "j")
        assert "press a letter" in screen_text(app)
        await press(pilot, "f")
        assert app.focused.id == "facts"
        await press(pilot, "j", "escape")
        assert app.focused.id == "facts"


async def test_the_palette_opens_a_trial_by_name(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "ctrl+p", "text:opent05", "down", "enter")
        assert isinstance(app.screen, TrialPage)
        assert app.screen.folder.name == "2026-11-20_T05"


async def test_search_narrows_the_list_and_escape_ends_it(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "slash", "text:warn", "enter")
        table = app.screen.query_one("#trials", DataTable)
        assert table.row_count == 1
        await press(pilot, "escape")
        assert table.row_count == 3
        assert app.focused is table


@pytest.mark.slow
async def test_theme_trial_screen_and_marker_are_kept(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "l", "enter", "v", "right_square_bracket")
        assert app.theme == SUNLIGHT
    async with started(workspace) as (app, pilot):
        assert app.theme == SUNLIGHT
        assert isinstance(app.screen, ResultsPage)
        assert "▶2 trunk" in screen_text(app)
        await press(pilot, "l", "escape", "escape")
        assert app.theme == DARK
        assert isinstance(app.screen, TrialsPage)


async def test_the_mouse_alone_reaches_results(workspace):
    async with started(workspace) as (app, pilot):
        await pilot.click("#trials", offset=(6, 2))
        await settle(pilot)
        assert isinstance(app.screen, TrialPage)
        keys = app.screen.query("FooterKey")
        await pilot.click(next(k for k in keys if k.key == "v"))
        await settle(pilot)
        assert isinstance(app.screen, ResultsPage)
        await pilot.click("#title")
        await settle(pilot)
        assert isinstance(app.screen, TrialPage)


EVIL = "[red]x[b] \x1b[31m\u202e\u200b" + "橄" * 40


@pytest.mark.slow
async def test_hostile_names_and_metadata_are_shown_harmless(workspace):
    folder = workspace / "trials" / EVIL
    toml = scene.TOML.replace('"Bari, plot 7"', '"""\\u001b[2J[b]' + "A" * 10_000 + '"""')
    scene.new_trial(folder, toml)
    (workspace / "trials" / "broken\x07").mkdir()
    (workspace / "trials" / "broken\x07" / "trial.toml").write_text("[x\x1b", encoding="utf-8")
    for size in ((120, 40), (80, 24)):
        shutil.rmtree(workspace / ".olivevib", ignore_errors=True)
        async with started(workspace, size) as (app, pilot):
            await shown(pilot, "[red]x[b]", "unreadable")
            await press(pilot, "end", "up", "up", "enter", "s", "escape", "escape", "down", "enter")
            assert not any(ord(c) < 32 for c in screen_text(app).replace("\n", ""))
            await press(pilot, "escape", "ctrl+p", "text:open")
            assert not any(ord(c) < 32 for c in screen_text(app).replace("\n", ""))


# from the trial's own page: what the other pages are opened with, and back
NEW_PAGES = (
    ("EditScreen", ["o"], ["escape"]),
    ("PicturesPage", ["k", "p", "plus"], ["escape"]),
    ("CalibrationPage", ["b"], ["escape"]),
    ("ReportPage", ["e", "down"], ["escape"]),
    ("EditScreen", ["escape", "o"], ["escape"]),
    ("TrialsPage", ["d", "h"], ["h", "d"]),
    ("CapturePage", ["c", "ctrl+r"], ["escape"]),
)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(120, 40), (80, 24)], ids=["120x40", "80x24"])
async def test_notes_archive_parameters_and_capture_show_it_harmless_too(workspace, size):
    shutil.rmtree(workspace / "trials")
    evil = "\\u001b[2J\\u202e[b]" + "橄" * 10_000
    record = f'notes = "{evil}"\nplace = "{evil}"\noperator = "{evil}"\n[tree]'
    toml = scene.TOML.replace("[tree]", record, 1).replace('place = "Bari, plot 7"', "", 1)
    toml = toml.replace('operator = "M. Rossi"', "", 1)
    folder = scene.new_trial(workspace / "trials" / EVIL, toml)
    for side in ("left", "right"):
        scene.marker_video(folder / f"{side}.avi", 5)
    async with started(workspace, size) as (app, pilot):
        assert "unreadable" not in screen_text(app)
        await press(pilot, "enter")
        for page, there, back in NEW_PAGES:
            await press(pilot, *there)
            assert type(app.screen).__name__ == page, there
            text = screen_text(app).replace("\n", "")
            assert not any(ord(c) < 32 or c in "\u202e\u200b\u2066" for c in text), there
            await press(pilot, *back)
            assert app.is_running, there


async def test_a_damaged_result_is_told_and_the_app_lives_on(workspace):
    place = workspace / "trials/2026-11-20_T04/vibration.h5"
    place.write_bytes(place.read_bytes()[:-300])
    async with started(workspace) as (app, pilot):
        assert "stale" in screen_text(app)
        await press(pilot, "enter")
        assert "vibration.h5 is damaged" in words(app, "#warning-text")
        await press(pilot, "v")
        assert isinstance(app.screen, ErrorScreen)
        assert "vibration.h5 is damaged" in words(app, ".dialog > Static")
        await press(pilot, "escape", "escape", "escape")
        assert isinstance(app.screen, TrialsPage | TrialPage)


def test_the_cli_refuses_without_a_terminal(capsys):
    from olivevib.cli import main

    assert main([]) == 2
    assert "needs a terminal" in capsys.readouterr().err


def test_input_errors_have_remedies():
    assert InputError("a", "b", "c").remedy == "c"


# -- what is about the workspace, not one trial ---------------------------------------------------


async def test_a_recording_is_planned(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "P")
        assert "zones to avoid" in words(app, "#outlook-text")
        assert "25.00" in words(app, "#outlook-text")  # a line of the whole band
        for name, text in (("readout", "20"), ("offset", "10"), ("frequency", "25")):
            app.screen.query_one(f"#{name}", Input).value = text
        await press(pilot, "enter")
        told = words(app, "#outlook-text")
        assert "25 Hz, 3 mm peak (74.0 m/s²): confirmable" in told
        assert "For the trial:" in told
        app.screen.query_one("#distance", Input).value = "far"
        await press(pilot, "enter")
        assert "“distance, mm”: 'far' is no number" in words(app, "#outlook-text")


async def test_this_machine_is_looked_at(workspace, monkeypatch):
    checks = (
        Check("codecs", "mjpeg", "ok", "reads webcams"),
        Check("disk", "x", "missing", "full"),
    )
    monkeypatch.setattr("olivevib.tui.screens.machine.machine_checks", lambda folder: checks)
    async with started(workspace) as (app, pilot):
        await press(pilot, "D")
        assert "reads webcams" in screen_text(app)
        assert "1 missing" in screen_text(app)


async def test_a_library_is_shown_proved_pictured_and_drawn_as_the_commands_do(workspace, capsys):
    async with started(workspace) as (app, pilot):
        await press(pilot, "L")
        told_of = words(app, "#outlook-text")
        assert f"olive49 1\n{marker_text(load_library('olive49'), 1)}" in told_of
        assert main(["markers", "check"]) == 0
        assert capsys.readouterr().out.strip() in told_of.replace("\nsmallest", "\n  smallest")
        await press(pilot, "enter", "text:5-6", "enter")
        assert "olive49 5" in words(app, "#outlook-text")
        assert "olive49 1\n" not in words(app, "#outlook-text")
        await press(pilot, "ctrl+s")
        assert "Marker 5 of olive49: " in told(app)
        await press(pilot, "ctrl+g")
        assert "“new: distance”" in words(app, ".dialog > Static")
        await press(pilot, "escape")
        app.screen.query_one("#distance", Input).value = "20"
        app.screen.query_one("#seed", Input).value = "3"
        assert await pilot.click("#generate")
        await settle(pilot)
        assert "41 codes." in told(app)
        made = next((workspace / "markers").glob("*20*.toml"))
        app.screen.query_one("#library", Input).value = f"markers/{made.name}"
        app.screen.query_one("#ids", Input).focus().value = "400"
        await press(pilot, "enter")
        assert "has no marker 400" in words(app, "#outlook-text")
    assert main(["markers", "draw", "5", "-o", "cli.png"]) == 0
    assert main(["markers", "generate", "--distance", "20", "--seed", "3", "-o", "cli.toml"]) == 0
    assert Path("marker-5.png").read_bytes() == Path("cli.png").read_bytes()
    assert made.read_text(encoding="utf-8") == Path("cli.toml").read_text(encoding="utf-8")


async def test_markers_and_a_board_are_printed_as_the_command_prints_them(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "M", "ctrl+s")
        assert "“marker size, mm”: how large the markers are" in words(app, ".dialog > Static")
        await press(pilot, "escape", "enter", "enter", "text:1-8", "enter", "text:60", "enter")
        assert "8 markers of olive49, 60 mm, on A4, 2 pages" in words(app, "#found-text")
        await press(pilot, "ctrl+s")
        assert "check the 150 mm ruler" in told(app)
        app.screen.query_one("#ids", Input).value = "900"
        await press(pilot, "enter")
        assert "library olive49 has no marker 900" in words(app, "#found-text")
        app.screen.query_one("#ids", Input).value = "1-8"
        app.screen.query_one("#output", Input).value = "sheet.svg"
        await press(pilot, "ctrl+s")
        assert "sheet-1.svg and 1 file more" in told(app)
        app.screen.query_one("#output", Input).value = "sheet.png"
        await press(pilot, "ctrl+s")
        assert "A print is a PDF or an SVG" in words(app, ".dialog > Static")
        await press(pilot, "escape")
        app.screen.query_one("#output", Input).value = ""
        app.screen.query_one("#what", Input).value = "board"
        app.screen.query_one("#board", Input).value = "coded:5x5,pitch=60,size=44"
        app.screen.query_one("#paper", Input).value = "A5"
        await press(pilot, "enter")
        assert "Choose “paper” A2" in words(app, "#found-text")
        app.screen.query_one("#paper", Input).value = ""
        assert await pilot.click("#make")  # by mouse as well
        await settle(pilot)
        assert "board.pdf" in told(app)
    sheet = ["markers", "sheet", "--ids", "1-8", "--size", "60", "-o"]
    board = ["markers", "board", "--board", "coded:5x5,pitch=60,size=44", "-o"]
    for argv, name, file in (
        (sheet, "markers.pdf", "cli.pdf"),
        (sheet, "sheet-2.svg", "cli.svg"),
        (board, "board.pdf", "cli-board.pdf"),
    ):
        assert main([*argv, str(workspace / file)]) == 0
        same = "cli-2.svg" if file.endswith("svg") else file
        assert (workspace / name).read_bytes() == (workspace / same).read_bytes()


@pytest.mark.slow
async def test_a_row_time_is_measured_from_a_lamp_and_kept(workspace, tmp_path):
    video = film(tmp_path)
    async with started(workspace) as (app, pilot):
        await press(pilot, "W", "ctrl+s")
        assert "recording of the lamp is not named" in words(app, ".dialog > Static")
        await press(pilot, "escape")
        for name, text in (("recording", str(video)), ("led", "500"), ("camera", "left cam")):
            app.screen.query_one(f"#{name}", Input).value = text
        await press(pilot, "ctrl+s")
        told = words(app, "#found-text")
        assert "row time 37.49" in told
        assert "kept for left cam" in told
        assert "left cam, 160 × 720" in told
    assert "left cam" in (workspace / "cameras.toml").read_text(encoding="utf-8")


@pytest.mark.slow
async def test_all_trials_are_measured_by_workers_and_make_a_season(workspace):
    for name in ("2026-11-20_T04", "2026-11-20_T05"):
        shutil.rmtree(workspace / "trials" / name / ".olivevib", ignore_errors=True)
    async with started(workspace) as (app, pilot):
        await press(pilot, "B", "w", "text:1", "enter", "r")
        table = app.screen.query_one("#batch", DataTable)
        results = [str(table.get_cell_at((k, 3))) for k in range(3)]
        assert results == ["done", "done, with warnings", "failed"]
        assert len(str(table.get_cell_at((0, 4)))) == 12
        await press(pilot, "down", "down")
        assert "is not a video" in words(app, "#why")
        assert "2 of 3 trials done, 1 failed, 1 with warnings" in told(app)
        await press(pilot, "space", "e")
        assert "reports/season.html" in told(app)
    assert (workspace / "reports" / "season.html").is_file()


async def test_how_an_accelerometer_is_read_is_kept_for_other_trials(workspace):
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "A", "enter")
        assert "a new trial names it as its preset" in told(app)
    assert (workspace / "presets" / "logger.toml").is_file()
