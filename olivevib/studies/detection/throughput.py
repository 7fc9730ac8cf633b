"""Pairs of frames a second that ``track`` takes, beside reading the same videos with cv2.aruco."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from olivevib import pipeline
from olivevib.pipeline.recordings import SIDES
from olivevib.progress import Tick
from olivevib.signals import State
from olivevib.studies.detection.readers import aruco, facts
from olivevib.studies.detection.speed import one_thread
from olivevib.studies.seasons.processes import busy_core_s
from olivevib.studies.seasons.trials import ten_markers
from olivevib.studies.study import Effort, Goal, Study, Table
from olivevib.trial import Trial

SECONDS, LEAST_S = 10.0, 2.0
REPEATS = 3
ASKED = 60.0  # pairs a second on two cores: twice real time
BUSY = 0.1  # cores that others may use before a time of the clock says little


@dataclass(frozen=True)
class Spent:
    """Of one pass over both videos: wall and processor s, cores that other programs used."""

    wall_s: float
    cpu_s: float
    others_cores: float


def run(effort: Effort, tick: Tick) -> Study:
    """Track ten coded markers; decode the same frames, and read them with cv2.aruco."""
    with TemporaryDirectory(prefix="olivevib_track_") as place:
        folder = Path(place) / "T01"
        trial = ten_markers(folder, max(LEAST_S, SECONDS * effort.share), tick, "olive49")
        pipeline.run_stage(trial.reopen(), "calibrate", tick)
        pairs = _decode(trial, lambda grey: None)
        reader = aruco("none")
        passes: dict[str, Callable[[], object]] = {
            "track": lambda: pipeline.track(trial.reopen(), tick),
            "decoding alone": lambda: _decode(trial, lambda grey: None),
            "decoding and cv2.aruco": lambda: _decode(trial, reader.read),
        }
        spent = {name: [_timed(work) for _ in range(REPEATS)] for name, work in passes.items()}
        seen = _seen(trial.reopen())
    rows = tuple((name, *_figures(found, pairs)) for name, found in spent.items())
    best = min(spent["track"], key=lambda s: s.wall_s)
    quiet = best.others_cores < BUSY
    rate, cpu = pairs / best.wall_s, _cpu_ms(spent["track"], pairs)
    ratio = cpu / _cpu_ms(spent["decoding and cv2.aruco"], pairs)
    disturbed = "" if quiet else f", {best.others_cores:.1f} cores in other use"
    return Study(
        name="detection-track",
        title="Tracking ten markers through two videos of 1280 x 720",
        tables=(
            Table(
                "Least of the passes",
                ("pass", "pairs/s", "processor ms a pair", "others, cores"),
                rows,
                note="cv2.aruco reads 4 x 4 codes, of which these videos hold none.",
            ),
        ),
        goals=(
            Goal(
                "track, ten markers, two cores",
                f">= {ASKED:g} pairs/s",
                f"{rate:.0f} pairs/s{disturbed}",
                rate >= ASKED if rate >= ASKED or quiet else None,
            ),
            Goal("markers in both videos, share of frames", ">= 0.99", f"{seen:.4f}", seen >= 0.99),
        ),
        facts=(
            *facts(),
            ("frames of each camera", str(pairs)),
            ("passes", str(REPEATS)),
            ("processor time over that of decoding and cv2.aruco", f"{ratio:.2f}"),
        ),
    )


def _timed(work: Callable[[], object]) -> Spent:
    busy, cpu, wall = busy_core_s(), time.process_time(), time.monotonic()
    work()
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    return Spent(wall, cpu, (busy_core_s() - busy - cpu) / wall)


def _figures(found: list[Spent], pairs: int) -> tuple[float, float, float]:
    best = min(found, key=lambda s: s.wall_s)
    return (
        round(pairs / best.wall_s, 1),
        round(_cpu_ms(found, pairs), 1),
        round(max(0.0, best.others_cores), 2),
    )


def _cpu_ms(found: list[Spent], pairs: int) -> float:
    return 1e3 * min(s.cpu_s for s in found) / pairs


def _decode(trial: Trial, read: Callable[[np.ndarray], object]) -> int:
    """Frames of the shorter video; both are decoded by OpenCV, each frame handed to ``read``."""
    counts = []
    with one_thread():
        for side in SIDES:
            name = getattr(trial.settings.cameras, side).video
            video = cv2.VideoCapture(str(trial.path(name)))
            count = 0
            while True:
                good, frame = video.read()
                if not good:
                    break
                read(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY))
                count += 1
            video.release()
            counts.append(count)
    return min(counts)


def _seen(trial: Trial) -> float:
    """The least share of frames in which any marker was measured."""
    tracks = trial.tracks
    if tracks is None:
        return 0.0
    measured = (State.SEEN, State.FLAGGED)
    return min(float(np.isin(t.state, measured).mean()) for s in SIDES for t in tracks.of(s))
