"""CPU time of a full scan on one thread, beside aruco 4 x 4 and AprilTag 3 in the same run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np

from olivevib.arrays import Grey
from olivevib.progress import Tick
from olivevib.studies.detection.canvas import SIZE, Look, clutter, lay, photo, pose
from olivevib.studies.detection.readers import Peer, apriltag, aruco, facts, ours
from olivevib.studies.detection.scenes import places
from olivevib.studies.study import Effort, Goal, Study, Table

COUNTS = (0, 1, 10, 30)
FRAMES = 20
REPEATS = 3
SIZE_PX, TILT_DEG = 56.0, (0.0, 50.0)
ASKED = {("aruco none", 0): 0.3, ("AprilTag 3", 0): 0.2, ("aruco none", 10): 0.5}
ASKED[("aruco none", 30)] = 0.8


def run(effort: Effort, tick: Tick) -> Study:
    """Process time a frame, least of the repeats, median over frames."""
    peers = [ours(), aruco("none"), apriltag()]
    frames = effort.count(FRAMES, 2)
    spent: dict[tuple[str, int], list[float]] = {(p.name, n): [] for p in peers for n in COUNTS}
    with one_thread():
        for k in range(frames):
            for count in COUNTS:
                tick(
                    k * len(COUNTS) + COUNTS.index(count), frames * len(COUNTS), f"{count} markers"
                )
                for peer in peers:
                    grey = _frame(peer, count, effort.draws(8, k, count))
                    spent[peer.name, count].append(_cpu_ms(peer, grey))
    tick(1, 1, "speed")
    median = {key: float(np.median(ms)) for key, ms in spent.items()}
    return Study(
        name="detection-speed",
        title="CPU time of a full scan, 1280 x 720, one thread",
        tables=(_table(peers, median),),
        goals=tuple(_goal(peer, count, asked, median) for (peer, count), asked in ASKED.items()),
        facts=(*facts(), ("frames", str(frames)), ("size of the markers, px", f"{SIZE_PX:g}")),
    )


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV on one thread within."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def _frame(peer: Peer, count: int, rng: np.random.Generator) -> Grey:
    light = clutter(rng)
    at = places(48)
    more = (at[:6] + at[6:12]) / 2 + [106, 0]
    at = rng.permutation(np.vstack([at, more[:5], [(at[0] + at[6]) / 2 - [0, 0]]]))[:count]
    for marker, place in zip(list(peer.prints), at, strict=False):
        what = peer.prints[marker]
        angles = (rng.uniform(*TILT_DEG), rng.uniform(0, 360), rng.uniform(0, 360))
        lay(light, what, pose(what.modules, SIZE_PX, angles, place), Look())
    return photo(light, 2.0, rng)


def _cpu_ms(peer: Peer, grey: Grey) -> float:
    best = np.inf
    for _ in range(REPEATS):
        start = time.process_time()
        peer.read(grey)
        best = min(best, time.process_time() - start)
    return 1e3 * float(best)


def _table(peers: list[Peer], ms: dict[tuple[str, int], float]) -> Table:
    rows = tuple(
        (
            count,
            *(round(ms[peer.name, count], 1) for peer in peers),
            *(round(ms["olivevib", count] / ms[peer.name, count], 2) for peer in peers[1:]),
        )
        for count in COUNTS
    )
    columns = ("markers", *(f"{peer.name}, ms" for peer in peers))
    columns += tuple(f"ratio to {peer.name}" for peer in peers[1:])
    return Table(f"CPU time a frame of {SIZE[0]} x {SIZE[1]} in clutter", columns, rows)


def _goal(peer: str, count: int, asked: float, ms: dict[tuple[str, int], float]) -> Goal:
    ratio = ms["olivevib", count] / ms[peer, count]
    measured = f"{ratio:.2f} ({ms['olivevib', count]:.1f} / {ms[peer, count]:.1f} ms)"
    name = f"CPU time against {peer}, {count} markers"
    return Goal(name, f"<= {asked} x", measured, ratio <= asked)
