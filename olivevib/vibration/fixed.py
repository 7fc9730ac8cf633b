"""The cameras' own motion, taken out by markers that stand still."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from olivevib.arrays import Floats
from olivevib.signals import Samples
from olivevib.vibration.clock import clock_of, measured


def without_camera_motion(
    motion: Mapping[int, Samples], fixed: Collection[int]
) -> dict[int, Samples]:
    """Every marker's displacement less the mean displacement of the fixed markers, frame by frame.

    A tripod or a ground that shakes moves all markers alike; markers on a wall or a post show it.
    Each sample takes the fixed markers' samples of its own frame (nearest in time, within half a
    frame: nothing is interpolated); where none was seen the sample is left out. Only shifts are
    taken out, no turning of the cameras. Unknown ids raise ValueError; no fixed marker: unchanged.
    """
    missing = set(fixed) - set(motion)
    if missing:
        raise ValueError(f"fixed markers {sorted(missing)} were not seen")
    if not fixed:
        return dict(motion)
    still = [measured(motion[marker]) for marker in sorted(fixed)]
    still = [(t, x - x.mean(axis=0)) for t, x in still if t.size > 1]
    if not still:
        return dict(motion)
    half = 0.5 / clock_of(still[0][0]).rate_hz
    return {marker: _less(samples, still, half) for marker, samples in motion.items()}


def _less(samples: Samples, still: list[tuple[Floats, Floats]], half_s: float) -> Samples:
    t_s, values = measured(samples)
    total, count = np.zeros_like(values), np.zeros(t_s.size)
    for fixed_s, moved in still:
        at = np.clip(np.searchsorted(fixed_s, t_s), 1, fixed_s.size - 1)
        at -= t_s - fixed_s[at - 1] < fixed_s[at] - t_s
        near = np.abs(fixed_s[at] - t_s) <= half_s
        total[near] += moved[at[near]]
        count += near
    seen = count > 0
    left = values[seen] - total[seen] / count[seen, None]
    return Samples(t_s[seen], left, samples.quantity, samples.unit, samples.axes)
