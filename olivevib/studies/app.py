"""How soon the app answers: first picture, keys while a stage runs, cancelling."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import sqlite3
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
    from olivevib.trial import Trial
    from olivevib.tui.app import OlivevibApp
    from olivevib.tui.work import Result, Work

STARTS, KEYS, CANCELS = 15, 200, 12
SECONDS = 8.0  # of the recording that is tracked meanwhile
BETWEEN = 20  # frames of both cameras between two wishes to stop
PATIENCE_S = 60.0
STAGES = ("calibrate", "track", "reconstruct", "analyse")
SIGN = b"quality"  # the head of the list of trials


def run(effort: Effort, tick: Tick) -> Study:
    """Start the app on a terminal again and again; press keys while it tracks; cancel, go on."""
    with tempfile.TemporaryDirectory(prefix="olivevib_app_") as place:
        folder = Path(place) / "olive"
        trial = ten_markers(folder / "trials" / "T01", max(2.0, SECONDS * effort.share), tick)
        pipeline.run_stage(trial, "calibrate", tick)
        starts = np.array(
            [_start(folder, k, effort.count(STARTS), tick) for k in range(effort.count(STARTS))]
        )
        gaps, whole = _undisturbed(trial, tick)
        keys, cancels, same = asyncio.run(_pressed(folder, effort, whole, tick))
    frames, ends = np.array(cancels.frame_s), np.array(cancels.end_s)
    wall, cpu = np.median(starts, axis=0)
    p95 = 1e3 * float(np.percentile(keys, 95))
    rows = [
        ("first picture, wall, s", float(wall), float(starts[:, 0].max())),
        ("first picture, processor, s", float(cpu), float(starts[:, 1].max())),
        _row("key while tracking, ms", keys),
        _row("from Esc to the end of tracking, ms", ends),
        _row("one frame of both cameras, ms", frames),
    ]
    after = cancels.frames_after
    rows.append(("frames of two cameras finished after Esc", float(np.median(after)), max(after)))
    rows += [_row(f"{stage}: between two ticks, ms", gap) for stage, gap in gaps.items()]
    within = np.median(ends) <= np.median(frames) and ends.max() <= frames.max()
    told = f"{_spread(ends)} ms; a frame there takes {_spread(frames)} ms"
    goals = (
        Goal("first picture", "< 1 s", f"{cpu:.2f} s of processor, {wall:.2f} s wall",
             bool(min(wall, cpu) < 1)),
        Goal("key while a stage runs, 95 %", "< 20 ms", f"{p95:.1f} ms", p95 < 20),
        Goal("cancel", "≤ one frame", told, bool(within)),
        Goal("tracks after cancelling and going on", "bit-identical",
             f"{'the same' if same else 'other'} bytes after {len(ends)} cancels", same),
    )  # fmt: skip
    facts = (("starts", str(len(starts))), ("keys", str(len(keys))), ("cores", str(os.cpu_count())))
    table = Table("The app", ("what", "median", "most"), tuple(rows))
    return Study("app", "How soon the app answers", (table,), (), goals, facts)


def _row(what: str, seconds: np.ndarray) -> tuple[str, float, float]:
    return what, 1e3 * float(np.median(seconds)), 1e3 * float(seconds.max())


def _spread(seconds: np.ndarray) -> str:
    return f"{1e3 * np.median(seconds):.0f} (at most {1e3 * seconds.max():.0f})"


def _undisturbed(trial: Trial, tick: Tick) -> tuple[dict[str, np.ndarray], bytes]:
    """Seconds between two ticks of each stage, nothing else being done; the tracks.

    The trial is left calibrated, its tracks taken away again.
    """
    gaps = {}
    for number, stage in enumerate(STAGES):
        tick(number, len(STAGES), f"{stage}, undisturbed")
        told = [time.monotonic()]
        pipeline.run_stage(trial, stage, lambda *_, told=told: told.append(time.monotonic()))
        gaps[stage] = np.diff([*told, time.monotonic()])
    tracks = trial.folder / "tracks.h5"
    whole = tracks.read_bytes()
    tracks.unlink()
    return gaps, whole


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


class Cancels:
    """Tracking that is cancelled: how long it went on, in seconds and in frames.

    end_s: from Esc until other work may start. frames_after: frames of both cameras that were
    finished after the wish was known. frame_s: what a frame of both cameras took meanwhile.
    """

    def __init__(self) -> None:
        self.end_s: list[float] = []
        self.frames_after: list[int] = []
        self.frame_s: list[float] = []
        self._seen: dict[int, float] = {}  # frames done -> when

    def watched(self, job: Work) -> Work:
        """The same work; its frames are timed."""

        def do(tick: Tick) -> Result:
            def timed(done: int, total: int | None, note: str) -> None:
                if note.startswith("tracking"):
                    self._seen.setdefault(done, time.monotonic())
                tick(done, total, note)

            return job.do(timed)

        self._seen = {}
        return type(job)(job.title, do)

    @property
    def done(self) -> int:
        """Frames of both cameras so far, those of earlier goes with them."""
        return max(self._seen, default=0)

    async def cancel(self, app: OlivevibApp, journal: Path) -> None:
        """Press Esc and wait for the end."""
        from textual import events

        began = time.monotonic()
        app.post_message(events.Key("escape", None))
        while not app.cancelling and app.progress is not None:
            await asyncio.sleep(0.001)
        known = self.done
        while app.progress is not None:
            await asyncio.sleep(0.001)
        self.end_s.append(time.monotonic() - began)
        self.frames_after.append(_rows(journal) - known)
        seen = self._seen
        self.frame_s += [seen[k] - seen[k - 2] for k in seen if k - 2 in seen]


def _rows(journal: Path) -> int:
    """Frames that are kept."""
    if not journal.exists():
        raise UsageError("Tracking ended before it was cancelled.", "", "More effort.")
    with contextlib.closing(sqlite3.connect(f"file:{journal}?mode=ro", uri=True)) as db:
        return int(db.execute("SELECT COUNT(*) FROM row").fetchone()[0])


async def _pressed(
    folder: Path, effort: Effort, whole: bytes, tick: Tick
) -> tuple[np.ndarray, Cancels, bool]:
    """Seconds of each key while the app tracks; the cancels; whether the tracks are ``whole``.

    Tracking is cancelled again and again and goes on each time; the tracks are those of the last.
    """
    from olivevib.tui import jobs
    from olivevib.tui.app import OlivevibApp

    app = OlivevibApp(folder)
    taken: list[float] = []
    cancels = Cancels()
    count, wishes = effort.count(KEYS, 20), effort.count(CANCELS, 4)
    trial = folder / "trials" / "T01"
    private, job = trial / ".olivevib", jobs.run_one(trial, "track")
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
        app.action_cancel_work()
        await _until(app, running=False)
        shutil.rmtree(private, ignore_errors=True)  # and from the first frame again
        for number in range(wishes):
            tick(number, wishes, "cancelling")
            app.start(cancels.watched(job))
            await _until(app, running=True)
            began = cancels.done
            while app.progress is not None and cancels.done < began + BETWEEN:
                await asyncio.sleep(0.003)
            await cancels.cancel(app, private / "track.journal")
        app.start(job)
        await _until(app, running=True)
        await _until(app, running=False)
    return np.array(taken), cancels, (trial / "tracks.h5").read_bytes() == whole


async def _filled(app: OlivevibApp) -> None:
    """Wait until the list on screen has been read from the disk."""
    from textual.widgets import DataTable

    async with asyncio.timeout(PATIENCE_S):
        await asyncio.sleep(0.2)
        while not all(table.row_count for table in app.screen.query(DataTable)):
            await asyncio.sleep(0.05)
        await app.workers.wait_for_complete()


async def _until(app: OlivevibApp, running: bool) -> None:
    """Wait until frames are being tracked; or until no work runs any more."""
    async with asyncio.timeout(PATIENCE_S):
        while running and not (app.progress is not None and app.progress.done > 2):
            await asyncio.sleep(0.002)
        while not running and app.progress is not None:
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
