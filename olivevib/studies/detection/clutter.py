"""False markers in pictures of leaves, branches and spots that hold none."""

from __future__ import annotations

from dataclasses import dataclass

from olivevib.progress import Tick
from olivevib.studies.detection.canvas import clutter, photo
from olivevib.studies.detection.readers import apriltag, aruco, facts, ours
from olivevib.studies.study import Effort, Goal, Study, Table

FRAMES = 10_000
PEER_EVERY = 20  # frames that the peers read too: their count is no goal of ours


@dataclass
class _Count:
    frames: int = 0
    markers: int = 0


def run(effort: Effort, tick: Tick) -> Study:
    """Markers reported in empty clutter, every frame anew."""
    frames = effort.count(FRAMES, 2)
    mine, peers = ours(), [aruco("none"), apriltag()]
    counts = {peer.name: _Count() for peer in (mine, *peers)}
    for k in range(frames):
        tick(k, frames, "frames of leaf clutter")
        rng = effort.draws(7, k)
        leaves = (int(rng.integers(900, 2700)), int(rng.integers(10, 40)), int(rng.integers(400)))
        grey = photo(clutter(rng, leaves), 2.0, rng)
        for peer in (mine, *(peers if k % PEER_EVERY == 0 else [])):
            counts[peer.name].frames += 1
            counts[peer.name].markers += len(peer.read(grey))
    tick(1, 1, "clutter")
    own = counts[mine.name]
    return Study(
        name="detection-clutter",
        title="False markers in leaf clutter",
        tables=(
            Table(
                "False markers",
                ("detector", "frames", "false markers"),
                tuple((name, c.frames, c.markers) for name, c in counts.items()),
            ),
        ),
        goals=(
            Goal(
                "false markers in 10,000 clutter frames",
                "0",
                f"{own.markers} in {own.frames} frames",
                own.markers == 0 if own.frames >= FRAMES or own.markers else None,
            ),
        ),
        facts=facts(),
    )
