"""Board views to the arrays of the joint problem: poses, chains, corner tracks in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.calibration.bundle import LEFT, RIGHT, RIGHT_ALONE, Observations
from olivevib.calibration.views import BoardView, common_ids, frame_period_s, stamped, times


@dataclass(frozen=True)
class BoardShape:
    """What the bow needs to know of a board: its middle (2,) and half-width, mm."""

    centre_mm: Floats
    half_mm: float


def shape_of(views: Sequence[BoardView]) -> BoardShape:
    """Middle and half-width of the board from all points that were seen."""
    points = np.concatenate([view.board_mm[:, :2] for view in views])
    low, high = points.min(axis=0), points.max(axis=0)
    return BoardShape((low + high) / 2, float((high - low).max()) / 2)


def flatten(
    views: Sequence[BoardView], chain: int, poses: Sequence[int], shape: BoardShape
) -> Observations:
    """Observations of one camera; view k belongs to board pose ``poses[k]``."""
    counts = [view.ids.size for view in views]
    px = np.concatenate([view.px for view in views]) if views else np.zeros((0, 2))
    track = np.zeros((len(px), 4, 2))
    track[:, 0] = px
    return Observations(
        chain=np.full(len(px), chain, dtype=np.int64),
        pose=np.repeat(np.asarray(poses, dtype=np.int64), counts),
        ids=np.concatenate([view.ids for view in views]) if views else np.zeros(0, np.int64),
        board_mm=np.concatenate([view.board_mm for view in views]) if views else np.zeros((0, 3)),
        track=track,
        sigma_px=np.concatenate([view.sigma_px for view in views]) if views else np.zeros(0),
        centre_mm=shape.centre_mm,
        half_mm=shape.half_mm,
    )


def join(parts: Sequence[Observations]) -> Observations:
    """One set of observations, sorted by chain."""
    first = parts[0]
    names = ("chain", "pose", "ids", "board_mm", "track", "sigma_px")
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    order = np.argsort(arrays["chain"], kind="stable")
    return Observations(
        **{name: array[order] for name, array in arrays.items()},
        centre_mm=first.centre_mm,
        half_mm=first.half_mm,
    )
