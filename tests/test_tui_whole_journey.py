"""From raw files to a report and a DXF in the app: by keys alone, and by mouse alone."""

from __future__ import annotations

import asyncio

import pytest
from textual.pilot import Pilot
from tui_app import press, screen_text, settle, started
from tui_journey import KEYS, MOST, WAIT, check_outcome, keystrokes, raw_workspace

from olivevib.tui.screens.error import ErrorScreen


@pytest.fixture
def raw(tmp_path, monkeypatch):
    folder = raw_workspace(tmp_path / "olive")
    monkeypatch.chdir(folder)
    return folder


async def until_free(pilot: Pilot[None]) -> None:
    """Wait for the work, and that it did not fail."""
    while pilot.app.progress is not None:
        await asyncio.sleep(0.05)
    await settle(pilot)
    assert not isinstance(pilot.app.screen, ErrorScreen), screen_text(pilot.app)


def test_the_journey_is_short():
    assert keystrokes() <= MOST


@pytest.mark.slow
async def test_by_keys_alone(raw):
    async with started(raw) as (app, pilot):
        for key in KEYS:
            if key == WAIT:
                await until_free(pilot)
            else:
                await press(pilot, key)
                assert not isinstance(app.screen, ErrorScreen), screen_text(app)
    check_outcome(raw)


async def click(pilot: Pilot[None], words: str, row: str = "", last: bool = False) -> None:
    """Click on words where they stand on screen (in the line that holds ``row``)."""
    for _ in range(100):
        for y, line in enumerate(screen_text(pilot.app).split("\n")):
            at = line.rfind(words) if last else line.find(words)
            if row in line and at >= 0:
                await pilot.click(offset=(at + len(words) // 2, y))
                await settle(pilot)
                return
        await asyncio.sleep(0.05)
    raise AssertionError(f"{words!r} is not on screen:\n{screen_text(pilot.app)}")


async def choose(pilot: Pilot[None], label: str, *words: str) -> None:
    """The button of a line of the form, then what to click in the sheet over it."""
    await click(pilot, "▾", label, last=True)
    for word in words:
        await click(pilot, word)


@pytest.mark.slow
async def test_by_mouse_alone(raw):
    async with started(raw) as (_, pilot):
        await click(pilot, "New trial")
        await click(pilot, "…", "left recording", last=True)
        await click(pilot, " raw")
        await click(pilot, "left.nut")
        await choose(pilot, " board ", "charuco:7x5,square=50")
        await choose(pilot, "marker size", " 6 ", " 7 ", " . ", " 8 ", "take it")
        await choose(pilot, "marker ids", "1-6")
        await choose(pilot, "marker library", "aruco:DICT_4X4_50")
        await choose(pilot, "shutter", "global")
        await choose(pilot, "band, Hz", "5-14")
        await choose(pilot, "its marker", " 2 ", "take it")
        await click(pilot, "Make the trial", "^s")
        await until_free(pilot)
        await click(pilot, "Run all")
        await until_free(pilot)
        await click(pilot, "Results", " v ")
        await click(pilot, "‹ olivevib")
        await click(pilot, " compare ", "●")
        await click(pilot, " compare ", "●")
        await click(pilot, "‹ olivevib")
        await click(pilot, "Report", " e ")
        await click(pilot, "Make the report", " e ")
        await until_free(pilot)
        await click(pilot, "dxf")
        await click(pilot, "dxf")
        await until_free(pilot)
    check_outcome(raw)
