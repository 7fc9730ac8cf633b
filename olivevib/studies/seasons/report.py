"""How long a report and every export take, and how large they are; each as a fresh command."""

from __future__ import annotations

import importlib.util
import statistics
import tempfile
from pathlib import Path

import numpy as np

from olivevib import pipeline
from olivevib.files.exports import FORMATS
from olivevib.progress import Tick
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import State
from olivevib.studies.seasons.processes import Timing, timed
from olivevib.studies.seasons.trials import ten_markers
from olivevib.studies.study import Cell, Effort, Goal, Study, Table

SECONDS = 10.0
REPEATS = 5
MARKERS, SAMPLES = 12, 1800  # of the exports
NEEDS = {"c3d": "ezc3d", "parquet": "pyarrow"}


def run(effort: Effort, tick: Tick) -> Study:
    """Measure one trial with ten markers, report it, and export twelve markers of a minute."""
    with tempfile.TemporaryDirectory(prefix="olivevib_report_") as place:
        folder = Path(place)
        trial = ten_markers(folder / "T10", max(2.0, SECONDS * min(1.0, effort.share)), tick)
        for _ in pipeline.run(trial, tick):
            pass
        repeats = effort.count(REPEATS)
        pages, goals = _pages(trial.folder, repeats, tick)
        exports, export_goals = _exports(folder, repeats, tick)
    facts = (
        ("trial", f"10 markers, {max(2.0, SECONDS * min(1.0, effort.share)):g} s at 30 frames/s"),
        ("repeats", f"{repeats}; medians"),
        ("processor seconds", "of the whole command, start of Python and imports included"),
    )
    return Study("report", "Reports and exports: time and size", (pages, exports), (),
                 (*goals, *export_goals), facts)  # fmt: skip


def _pages(folder: Path, repeats: int, tick: Tick) -> tuple[Table, list[Goal]]:
    """The page alone and with its PDF, by the command line."""
    rows: list[tuple[Cell, ...]] = []
    goals = []
    for what, options, limit in (("HTML", (), 4.0), ("HTML and PDF", ("--pdf",), 6.0)):
        if options and importlib.util.find_spec("typst") is None:
            goals.append(Goal(f"report, {what}", f"<= {limit:g} s", "typst is not installed", None))
            continue
        found = []
        for k in range(repeats):
            tick(k, repeats, f"report, {what}")
            found.append(timed("report", "-q", folder, *options))
        wall, cpu = _medians(found)
        rows.append((what, wall, cpu))
        goals.append(_time_goal(f"report, {what}", limit, wall, cpu))
    for name in ("report.html", "report.pdf"):
        if (folder / name).exists():
            mb = (folder / name).stat().st_size / 1e6
            goals.append(Goal(f"size of {name}", "<= 3 MB", f"{mb:.2f} MB", mb <= 3))
    return Table("Reports", ("what", "wall, s", "processor, s"), tuple(rows)), goals


def _medians(found: list[Timing]) -> tuple[float, float]:
    return statistics.median(t.wall_s for t in found), statistics.median(t.cpu_s for t in found)


def _time_goal(what: str, limit: float, wall: float, cpu: float) -> Goal:
    """Judged by processor time: what else runs on the machine does not count against it."""
    words = f"{cpu:.2f} s of processor, {wall:.2f} s wall"
    return Goal(what, f"<= {limit:g} s", words, min(wall, cpu) <= limit)


def _exports(folder: Path, repeats: int, tick: Tick) -> tuple[Table, list[Goal]]:
    """Each export of twelve markers and 1800 samples, in this process (imports apart)."""
    import time

    from olivevib.files.exports import export

    path = moving(MARKERS, SAMPLES)
    rows: list[tuple[Cell, ...]] = []
    slow, missing = [], []
    for done, to in enumerate(FORMATS):
        tick(done, len(FORMATS), f"export {to}")
        if to in NEEDS and importlib.util.find_spec(NEEDS[to]) is None:
            missing.append(to)
            continue
        target = folder / f"paths.{to}"
        spent, first = [], 0.0
        for k in range(repeats + 1):
            started = time.process_time()
            export(path, to, target)
            spent.append(time.process_time() - started)
            first = spent[0] if k == 0 else first
        middle = statistics.median(spent[1:])
        rows.append((to, middle, first, target.stat().st_size / 1e6))
        if first > (3.0 if to == "dxf" else 1.0):
            slow.append(f"{to} {first:.2f} s")
    words = "slower: " + ", ".join(slow) if slow else _worst(rows)
    words += f"; not installed: {', '.join(missing)}" if missing else ""
    goal = Goal(f"exports of {MARKERS} x {SAMPLES}", "<= 1 s, dxf <= 3 s", words, not slow)
    columns = ("format", "processor, s", "the first time, with imports, s", "MB")
    return Table("Exports", columns, tuple(rows)), [goal]


def _worst(rows: list[tuple[Cell, ...]]) -> str:
    """The slowest of the others, and dxf, the first time."""
    first = {str(row[0]): float(str(row[2])) for row in rows}
    others = {to: s for to, s in first.items() if to != "dxf"}
    slowest = max(others, key=lambda to: others[to])
    return f"{slowest} {others[slowest]:.2f} s, dxf {first['dxf']:.2f} s (the first time)"


def moving(markers: int, samples: int) -> Trajectory:
    """Markers on orbits at 12 Hz with a gap in every third."""
    t = np.arange(samples) / 30.0
    seen_t = np.repeat(t[:, None], markers, axis=1)
    place = np.stack([np.linspace(-400, 400, markers), np.zeros(markers), np.full(markers, 1400.0)])
    turn = 2 * np.pi * 12.0 * seen_t[:, :, None] + np.array([0.0, 0.7, 1.4])
    xyz = place.T + np.array([4.0, 2.0, 1.0]) * np.cos(turn)
    state = np.full((samples, markers), int(State.SEEN))
    state[samples // 3 : samples // 3 + 40, ::3] = State.HIDDEN
    gone = state == State.HIDDEN
    xyz[gone], seen_t = np.nan, np.where(gone, np.nan, seen_t)
    sigma = np.where(gone[..., None], np.nan, 0.05)
    nothing = np.full((samples, markers, 3), np.nan)
    return Trajectory(
        t, np.arange(1, markers + 1), seen_t, xyz, np.broadcast_to(sigma, xyz.shape).copy(),
        np.full((*xyz.shape, 3), np.nan), nothing, nothing, state,
        np.full((samples, markers), np.nan), "left camera", "optimal",
    )  # fmt: skip
