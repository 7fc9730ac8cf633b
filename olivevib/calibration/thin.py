"""Long videos: enough views to know everything, few enough to solve at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.calibration.joint import Pair
from olivevib.calibration.tracks import speeds
from olivevib.calibration.views import pair_views


def thin(pair: Pair, most: int) -> Pair:
    """At most ``most`` common views (and half as many of one camera alone), spread in time.

    Of each stretch of a video the slowest view counts, every third time the fastest: slow views
    tell the geometry, fast ones the lag. The corner tracks keep all views.
    """
    pairs = np.array(pair_views(pair.left.views, pair.right.views), dtype=np.int64).reshape(-1, 2)
    speed = speeds(pair.left.views) if pair.timed else np.zeros(len(pair.left.views))
    keep = _spread(np.nan_to_num(speed[pairs[:, 0]], nan=1e9), most)
    left, right = (
        np.union1d(pairs[keep, k], _alone(len(side.views), pairs[:, k], most // 2))
        for k, side in enumerate(pair.sides)
    )
    return replace(pair, left=pair.left.only(left.tolist()), right=pair.right.only(right.tolist()))


def _spread(speed: Floats, most: int) -> Ints:
    """Indices of at most ``most`` views, one a stretch: slow, slow, fast, ..."""
    if speed.size <= most:
        return np.arange(speed.size)
    stretches = np.array_split(np.arange(speed.size), most)
    return np.array([
        part[(speed[part].argmax() if k % 3 == 2 else speed[part].argmin())]
        for k, part in enumerate(stretches)
    ])  # fmt: skip


def _alone(count: int, common: Ints, most: int) -> Ints:
    """Views of one camera that the other does not share, evenly thinned."""
    alone = np.setdiff1d(np.arange(count), common)
    if alone.size <= most:
        return alone
    return alone[np.linspace(0, alone.size - 1, most).round().astype(np.int64)]
