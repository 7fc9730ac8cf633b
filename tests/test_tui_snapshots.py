"""Pictures of every screen at 120 x 40 and at 80 x 24, on a fixed trial: one walk a size.

Make them anew with ``pytest tests/test_tui_snapshots.py --snapshot-update`` and look at them.
"""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path

import pytest
import tui_scene as scene
from pytest_textual_snapshot import SVGImageExtension
from small_videos import make_video
from textual.widgets import Input, Static
from tui_app import press, settle, started
from tui_live import board, live

from olivevib.errors import Caution, InputError
from olivevib.pipeline.machine import Check
from olivevib.trial import Trial
from olivevib.tui.capturing import Recorded, Recording, told_of
from olivevib.tui.screens.live import LivePage
from olivevib.tui.views.progress import Progress

PATIENCE_S = (0.0, 0.2, 1.0, 3.0)  # a snapshot is compared again after each
SIZES = ((120, 40), (80, 24))
WALK = (
    ("trials", ""),
    ("search", "slash w a r n enter"),
    ("trial_with_warnings", "enter"),
    ("spectrum_undecided", "v 2"),
    ("trial_new", "escape escape escape down down enter"),
    ("results_empty", "v"),
    ("trial", "escape escape up up enter"),
    ("jump", "j"),
    ("palette", "escape ctrl+p"),
    ("orbits", "escape v"),
    ("help", "question_mark"),
    ("spectrum", "escape 2 right"),
    ("markers", "3 down"),
    ("motion", "escape m plus"),
    ("comparison", "escape c"),
    ("calibration", "escape b"),
    ("report", "escape e"),
    ("export", "down down down"),
    ("export_markers", "f down down enter"),
    ("settings", "escape s right_square_bracket right_square_bracket"),
    ("edit", "enter"),
    ("pictures", "escape escape k"),
    ("parameters", "p down down plus"),
    ("spectrogram", "p escape g"),
    ("phases", "escape m p"),
    ("form", "escape escape escape n T 0 7"),
    ("form_wrong", "tab x enter"),
    ("choose", "tab tab tab ctrl+o"),
    ("form_sensors", "escape f2"),
    ("capture", "escape c ctrl+r"),
    ("plan", "escape P"),
    ("plan_one", "tab tab tab 2 5 enter"),
    ("batch", "escape B"),
    ("row_time", "escape W"),
    ("prints", "escape M enter enter 1 - 8 enter 6 0 enter"),
    ("libraries", "escape L tab 7 enter"),
    ("machine", "escape D"),
    ("outcome", "escape enter A enter"),
)

MACHINE = (
    Check("versions", "python", "ok", "3.12.1 (3.11 or newer is needed)"),
    Check("extras", "textual_serve", "note", "optional: needed only for the app in a browser"),
    Check("cameras", "0: /dev/video0", "ok", "Webcam, 30.0 frames/s, manual exposure holds"),
    Check("disk", "/home/ana/olive", "missing", "0 GB free: about 1 minutes of two MJPEG webcams"),
)


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
    monkeypatch.setattr("olivevib.tui.screens.capture.camera_lines", tuple)
    monkeypatch.setattr("olivevib.tui.screens.machine.machine_checks", lambda folder: MACHINE)
    monkeypatch.setattr("olivevib.batch.cores", lambda: 2)
    return Path()


@pytest.fixture
def svg(snapshot):
    return snapshot.use_extension(SVGImageExtension)


async def taken(app, pilot) -> str:
    """A picture of the app, with the cursors at rest."""
    for field in app.screen.query(Input):
        field.cursor_blink = False
    await settle(pilot)
    return app.export_screenshot()


async def looks(app, pilot, expected) -> bool:
    """Whether the app comes to rest as the snapshot has it; on a loaded machine it takes longer."""
    for wait in PATIENCE_S:
        await asyncio.sleep(wait)
        if await taken(app, pilot) == expected:
            return True
    return False


def name_of(picture: str, size: tuple[int, int]) -> str:
    return f"{picture} {size[0]}x{size[1]}"


async def changed_on(walk, svg, workspace, size) -> list[str]:
    """The pictures of a walk (name, keys) from the list of trials that look otherwise now."""
    changed = []
    async with started(workspace, size) as (app, pilot):
        for picture, keys in walk:
            await press(pilot, *keys.split())
            if not await looks(app, pilot, svg(name=name_of(picture, size))):
                changed.append(picture)
    return changed


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
async def test_every_screen_looks_as_it_did(svg, workspace, size):
    assert await changed_on(WALK, svg, workspace, size) == []


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
async def test_work_errors_and_an_empty_folder(svg, workspace, tmp_path, monkeypatch, size):
    """A fixed state of the work, so that no clock is in the picture."""
    changed = []
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "down", "down", "enter")
        app.progress = Progress("2026-11-21_T06: run", "tracking markers", 450, 1800, 31.0, 43.5)
        await settle(pilot)
        if not await looks(app, pilot, svg(name=name_of("busy", size))):
            changed.append("busy")
        app.progress = None
        faults = "  markers.size: there is no such key; did you mean 'size_mm'?\n  [b]: no markup"
        app.show_error(InputError("trial.toml has 2 fault(s):", faults, "Correct the file."))
        await settle(pilot)
        if not await looks(app, pilot, svg(name=name_of("error", size))):
            changed.append("error")
    (tmp_path / "new").mkdir()
    monkeypatch.chdir(tmp_path / "new")
    monkeypatch.setattr("olivevib.tui.screens.trials.whole_path", lambda path: "/home/ana/olive")
    async with started(workspace, size) as (app, pilot):
        if not await looks(app, pilot, svg(name=name_of("empty", size))):
            changed.append("empty")
    assert not changed


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
async def test_a_running_capture_looks_as_it_did(svg, workspace, size, monkeypatch):
    """Fixed states of a capture, so that no clock and no camera is in the picture."""
    changed = []
    async with started(workspace, size) as (app, pilot):
        monkeypatch.setattr(app, "start", lambda job: None)
        told = told_of({"trial": "T09", "left": "0", "right": "1"})
        page = LivePage(workspace, Recording(workspace, told))
        await app.push_screen(page)
        for name, state in (("aiming", live(0.0)), ("recording", live(4.0)), ("board", board())):
            page.post_message(LivePage.Seen(state))
            await settle(pilot)
            if not await looks(app, pilot, svg(name=name_of(f"live {name}", size))):
                changed.append(name)
        cautions = (Caution("dropped-frames", "The left camera skipped 3 of 600 frames.", "Use …"),)
        words = "8 of 8 markers, 3 drops, cameras 9.3 ms apart: good for 5–29.6, 30.4–45 Hz"
        page.post_message(LivePage.Over(Recorded(words, cautions, workspace / "trials/T09", None)))
        await settle(pilot)
        if not await looks(app, pilot, svg(name=name_of("live verdict", size))):
            changed.append("verdict")
    assert not changed


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
async def test_failed_and_old_results_look_as_they_did(svg, workspace, size):
    Trial.open(workspace / "trials/2026-11-20_T04").changed({"markers.size_mm": 45.0})
    scene.swapped(workspace / "trials/2026-11-20_T05")
    walk = (("old", "enter v 3"), ("failed", "escape escape down"), ("failed_trial", "enter"))
    assert await changed_on(walk, svg, workspace, size) == []


@pytest.mark.slow
async def test_sunlight_and_no_colour(svg, workspace, monkeypatch):
    changed = []
    async with started(workspace) as (app, pilot):
        for picture, keys in (("trials", "l"), ("trial", "enter"), ("orbits", "v")):
            await press(pilot, *keys.split())
            if not await looks(app, pilot, svg(name=f"sunlight {picture}")):
                changed.append(picture)
    shutil.rmtree(workspace / ".olivevib")
    monkeypatch.setenv("NO_COLOR", "1")
    async with started(workspace) as (app, pilot):
        await press(pilot, "enter", "v", "2", "right")
        if not await looks(app, pilot, svg(name="without colour")):
            changed.append("without colour")
    assert not changed


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
async def test_the_map_of_sigma_looks_as_it_did(svg, workspace, size):
    scene.unsure(workspace / "trials/2026-11-20_T04")
    async with started(workspace, size) as (app, pilot):
        await press(pilot, "enter", "b", "S")
        assert await looks(app, pilot, svg(name=name_of("sigma", size)))


async def picking(app, pilot, workspace) -> None:
    """The picker on a fixed folder, narrowed by two letters."""
    folder = Path("raw")
    (folder / "calibration").mkdir(parents=True)
    (folder / "left").mkdir()
    (folder / "left" / "1.png").write_bytes(b"x")
    for name, size in (("left.mkv", 12_345_678), ("right.mkv", 12_000_000), ("logger.csv", 900)):
        (folder / name).write_bytes(bytes(size // 1000))
    app.keep(folder=str(folder))
    await press(pilot, "n", "tab", "ctrl+o", "l", "e")
    app.screen.query_one("#here", Static).update("/home/ana/olive/raw")


@pytest.mark.parametrize("size", SIZES, ids=["120x40", "80x24"])
async def test_picking_a_file_looks_as_it_did(svg, workspace, size):
    async with started(workspace, size) as (app, pilot):
        await picking(app, pilot, workspace)
        assert await looks(app, pilot, svg(name=name_of("pick", size)))
