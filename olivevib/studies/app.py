"""How soon the app answers: first picture, keys while a stage runs, cancelling."""

from __future__ import annotations

import asyncio
import contextlib
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from olivevib import pipeline
from olivevib.errors import UsageError
from olivevib.progress import Tick
from olivevib.studies.seasons.processes import OLIVEVIB
from olivevib.studies.seasons.trials import ten_markers
from olivevib.studies.study import Effort, Goal, Study, Table

if TYPE_CHECKING:
    from olivevib.tui.app import OlivevibApp

STARTS, KEYS = 15, 200
SECONDS = 8.0  # of the recording that is tracked meanwhile
PATIENCE_S = 60.0
SIGN = b"quality"  # the head of the list of trials


def run(effort: Effort, tick: Tick) -> Study:
    """Start the app on a terminal again and again; press keys while it tracks; cancel."""
    with tempfile.TemporaryDirectory(prefix="olivevib_app_") as place:
        folder = Path(place) / "olive"
        trial = ten_markers(folder / "trials" / "T01", max(2.0, SECONDS * effort.share), tick)
        pipeline.run_stage(trial, "calibrate", tick)
        starts = np.array(
            [_start(folder, k, effort.count(STARTS), tick) for k in range(effort.count(STARTS))]
        )
        keys, cancel = asyncio.run(_pressed(folder, effort.count(KEYS, 20), tick))
    wall, cpu = np.median(starts, axis=0)
    p95 = 1e3 * float(np.percentile(keys, 95))
    rows = (
        ("first picture, wall, s", float(wall), float(starts[:, 0].max())),
        ("first picture, processor, s", float(cpu), float(starts[:, 1].max())),
        ("key while tracking, ms", 1e3 * float(np.median(keys)), 1e3 * float(keys.max())),
        ("cancelled after, ms", 1e3 * cancel, 1e3 * cancel),
    )
    goals = (
        Goal("first picture", "< 1 s", f"{cpu:.2f} s of processor, {wall:.2f} s wall",
             bool(min(wall, cpu) < 1)),
        Goal("key while a stage runs, 95 %", "< 20 ms", f"{p95:.1f} ms", p95 < 20),
    )  # fmt: skip
    facts = (("starts", str(len(starts))), ("keys", str(len(keys))), ("cores", str(os.cpu_count())))
    table = Table("The app", ("what", "median", "most"), rows)
    return Study("app", "How soon the app answers", (table,), (), goals, facts)


def _start(folder: Path, number: int, total: int, tick: Tick) -> tuple[float, float]:
    """Wall and processor seconds from the start of the process to the list of trials."""
    tick(number, total, "first picture")
    try:
        import pty
        import resource
        import select
    except ImportError as error:
        raise UsageError("The app's start is measured on Linux and macOS.", "", "") from error
    master, slave = pty.openpty()
    env = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", "LINES": "40"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began, seen = time.monotonic(), b""
    process = subprocess.Popen(
        OLIVEVIB, stdin=slave, stdout=slave, stderr=slave, cwd=folder, env=env
    )
    while SIGN not in seen and time.monotonic() - began < PATIENCE_S:
        if select.select([master], [], [], 0.1)[0]:
            seen += os.read(master, 65536)
    wall = time.monotonic() - began
    process.kill()
    process.wait()
    os.close(master)
    os.close(slave)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if SIGN not in seen:
        raise UsageError("The app showed no list of trials.", repr(seen[-300:]), "")
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, spent


async def _pressed(folder: Path, count: int, tick: Tick) -> tuple[np.ndarray, float]:
    """Seconds of each key while the app tracks; seconds from Esc to the end of the work."""
    from olivevib.tui.app import OlivevibApp

    app = OlivevibApp(folder)
    taken: list[float] = []
    async with app.run_test(size=(120, 40)) as pilot:
        await _filled(app)
        await pilot.press("enter")
        await _filled(app)
        while len(taken) < count:
            tick(len(taken), count, "keys while tracking")
            await pilot.press("ctrl+home", "down", "t")
            await _until(app, running=True)
            while app.progress is not None and len(taken) < count:
                taken.append(await _answered_s(app, ("down", "up")[len(taken) % 2]))
        began = time.monotonic()
        await pilot.press("escape")
        with contextlib.suppress(TimeoutError):
            await _until(app, running=False)
        return np.array(taken), time.monotonic() - began


async def _filled(app: OlivevibApp) -> None:
    """Wait until the list on screen has been read from the disk."""
    from textual.widgets import DataTable

    async with asyncio.timeout(PATIENCE_S):
        await asyncio.sleep(0.2)
        while not all(table.row_count for table in app.screen.query(DataTable)):
            await asyncio.sleep(0.05)
        await app.workers.wait_for_complete()


async def _until(app: OlivevibApp, running: bool) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while (app.progress is not None and app.progress.done > 2) != running:
            await asyncio.sleep(0.002)


async def _answered_s(app: OlivevibApp, key: str) -> float:
    """From a key to the moment when what it set off has been handled and drawn."""
    from textual import events

    await asyncio.sleep(0.03)
    done = asyncio.Event()
    began = time.monotonic()
    app.post_message(events.Key(key, None))
    app.screen.call_later(done.set)
    await done.wait()
    done.clear()
    focused = app.screen.focused or app.screen
    focused.call_later(done.set)
    await done.wait()
    return time.monotonic() - began
