"""The app while the board is waved: guidance of running cameras, and over the recordings after."""

from __future__ import annotations

import asyncio

import pytest
from test_calibrate_live import SPEC, films, server  # noqa: F401
from textual.widgets import Input
from tui_app import press, quiet, screen_text, started

from olivevib.cli import main
from olivevib.trial import Trial

PATIENCE_S = 60.0


async def until(pilot, condition):
    """Wait until something is on screen, however loaded the machine is."""
    for _ in range(int(PATIENCE_S / 0.1)):
        if condition(screen_text(pilot.app)):
            return
        await asyncio.sleep(0.1)
    raise AssertionError(screen_text(pilot.app))


@pytest.mark.parametrize("size", [(120, 40), (80, 24)])
async def test_running_cameras_guide_whoever_waves_the_board(films, tmp_path, size):  # noqa: F811
    (tmp_path / "trials").mkdir()
    with server(films, "left") as left, server(films, "right") as right:
        async with started(tmp_path, size) as (app, pilot):
            await press(pilot, "c")
            for name, value in (("trial", "T1"), ("left", left.address), ("right", right.address),
                                ("board", SPEC)):  # fmt: skip
                app.screen.query_one(f"#{name}", Input).value = value
            await pilot.press("ctrl+s")
            await until(pilot, lambda text: "NOT RECORDING YET" in text)
            await pilot.press("space")
            await until(pilot, lambda text: "show the board" in text and "REC" in text)
            await until(pilot, lambda text: "██" in text and "views in both cameras" in text)
            await asyncio.sleep(2.0)
            await pilot.press("space")
            await until(pilot, lambda text: "closed and safe" in text)
            assert "Verdict" in screen_text(app)
            assert "board" in screen_text(app)
    assert (tmp_path / "trials/T1/calibration/left.nut").stat().st_size > 10_000
    assert (tmp_path / "trials/T1/calibration/right.stamps.csv").is_file()


@pytest.mark.parametrize("size", [(120, 40), (80, 24)])
async def test_the_calibration_page_goes_through_the_board_recordings(
    films, tmp_path, monkeypatch, size, capsys  # noqa: F811
):  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trials").mkdir()
    with server(films, "left") as left, server(films, "right") as right:
        command = ["calibrate", "T1", "--preview", "--left", left.address, "--right"]
        assert main([*command, right.address, "--board", SPEC, "--seconds", "2.5"]) == 3
    trial = Trial.open(tmp_path / "trials/T1")
    async with started(tmp_path, size) as (app, pilot):
        await press(pilot, "enter", "b")
        assert "Not calibrated yet" in screen_text(app)
        await pilot.press("p")
        await until(pilot, lambda text: "Coverage of the board recordings" in text)
        await quiet(pilot)
        shown = screen_text(app)
        assert "██" in shown and "show the board" in shown
    assert not (trial.folder / "calibration.h5").exists()  # nothing but a look
