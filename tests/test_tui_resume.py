"""Work that was cancelled in the app goes on to the same bytes as work that never was."""

from __future__ import annotations

import asyncio
import shutil

import pytest
from tui_app import press, settle, started
from tui_journey import SAMPLE

from olivevib.pipeline import run_stage
from olivevib.trial import Trial


@pytest.mark.slow
async def test_cancelled_tracking_goes_on_to_the_same_bytes(tmp_path, monkeypatch):
    folder = tmp_path / "olive" / "trials" / "T01"
    shutil.copytree(SAMPLE, folder)
    for made in folder.glob("*.h5"):  # a clone has none of them
        made.unlink()
    run_stage(Trial.open(folder), "calibrate")
    monkeypatch.chdir(tmp_path / "olive")
    async with started(tmp_path / "olive") as (app, pilot):
        await press(pilot, "enter", "down")
        await pilot.press("t")
        while app.progress is None or app.progress.done < 20:
            await asyncio.sleep(0.005)
        await pilot.press("escape")
        while app.progress is not None:
            await asyncio.sleep(0.005)
        assert (folder / ".olivevib" / "track.journal").exists()
        assert not (folder / "tracks.h5").exists()
        await pilot.press("t")
        await settle(pilot)
    resumed = (folder / "tracks.h5").read_bytes()
    (folder / "tracks.h5").unlink()
    run_stage(Trial.open(folder), "track")
    assert (folder / "tracks.h5").read_bytes() == resumed
