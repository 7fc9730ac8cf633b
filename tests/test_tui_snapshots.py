"""Pictures of every screen at 120 x 40 and at 80 x 24, on a fixed trial."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import tui_scene as scene
from small_videos import make_video
from tui_app import press, settle

from olivevib.errors import InputError
from olivevib.tui.app import OlivevibApp
from olivevib.tui.views.progress import Progress

SIZES = ((120, 40), (80, 24))
JOURNEYS = {
    "trials": "",
    "search": "slash w a r n",
    "trial": "enter",
    "trial_with_warnings": "down enter",
    "new_trial_folder": "down down enter",
    "orbits": "enter v",
    "spectrum": "enter v 2 right",
    "spectrum_undecided": "down v 2",
    "markers": "enter v 3",
    "motion": "enter m plus",
    "comparison": "enter c",
    "report": "enter e down",
    "settings": "enter s s s",
    "pictures": "enter k",
    "form": "n T 0 7",
    "help": "enter v question_mark",
    "jump": "enter j",
    "palette": "enter ctrl+p",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = scene.workspace(tmp_path_factory.mktemp("snap") / "olive")
    for side in ("left", "right"):
        place = folder / "trials/2026-11-20_T04" / f"{side}.avi"
        make_video(place, "ffv1", frames=2, pixels="gray", size=(640, 480))
    scene.remeasure(folder / "trials/2026-11-20_T04")
    return folder


@pytest.fixture
def workspace(made, tmp_path, monkeypatch) -> Path:
    monkeypatch.delenv("NO_COLOR", raising=False)
    shutil.copytree(made, tmp_path / "olive")
    monkeypatch.chdir(tmp_path / "olive")
    return Path()


def keys_first(keys: str):
    async def run(pilot) -> None:
        await settle(pilot)
        await press(pilot, *keys.split())

    return run


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
@pytest.mark.parametrize("journey", JOURNEYS)
def test_screen(snap_compare, workspace, journey, size):
    app = OlivevibApp(workspace)
    before = keys_first(JOURNEYS[journey])
    assert snap_compare(app, terminal_size=size, run_before=before)


@pytest.mark.parametrize("journey", ["trials", "trial", "orbits"])
def test_sunlight(snap_compare, workspace, journey):
    app = OlivevibApp(workspace)
    before = keys_first(f"l {JOURNEYS[journey]}")
    assert snap_compare(app, terminal_size=(120, 40), run_before=before)


def test_without_colour(snap_compare, workspace, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    before = keys_first(JOURNEYS["spectrum"])
    assert snap_compare(OlivevibApp(workspace), terminal_size=(120, 40), run_before=before)


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
def test_empty(snap_compare, tmp_path, monkeypatch, size):
    (tmp_path / "olive").mkdir()
    monkeypatch.chdir(tmp_path / "olive")
    monkeypatch.setattr("olivevib.tui.screens.trials.whole_path", lambda path: "/home/ana/olive")
    app = OlivevibApp(Path())
    assert snap_compare(app, terminal_size=size, run_before=keys_first(""))


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
def test_busy(snap_compare, workspace, size):
    """Work under way: a fixed state of it, so that no clock is in the picture."""
    app = OlivevibApp(workspace)

    async def run(pilot) -> None:
        await settle(pilot)
        await press(pilot, "down", "down", "enter")
        app.progress = Progress("2026-11-21_T06: run", "tracking markers", 450, 1800, 31.0, 43.5)
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=run)


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
def test_error(snap_compare, workspace, size):
    app = OlivevibApp(workspace)
    faults = "  markers.size: there is no such key; did you mean 'size_mm'?\n  [b]: not markup"
    error = InputError("trial.toml has 2 fault(s):", faults, "Correct the file and run again.")

    async def run(pilot) -> None:
        await settle(pilot)
        await press(pilot, "enter")
        app.show_error(error)
        await settle(pilot)

    assert snap_compare(app, terminal_size=size, run_before=run)
