"""What a fit says of a marker's blur: rounder, along a longer path, or moving at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.detection.blur import Blur

VARIANCES_PX2 = (0.15, 6.0)  # round blur that is believed
ELONGATED_PX2 = 0.3  # difference of the blur's two variances that is a motion
LONGEST_STEP_PX = 4.0  # of a path, between two drawings


def rounder(blur: Blur, further: Floats) -> Blur:
    """A blur whose variance is larger by the first of ``further``, as far as it is believed."""
    return replace(blur, variance_px2=_believed(blur.variance_px2 + float(further[0])))


def further_blur(blur: Blur, further: Floats) -> Blur:
    """A blur with further variance, and where it moves a further path (x, y)."""
    out = rounder(blur, further)
    if further.size < 3:
        return out
    step = further[1:] * min(1.0, LONGEST_STEP_PX / max(float(np.hypot(*further[1:])), 1e-9))
    x, y = np.array(blur.motion_px) + step
    return replace(out, motion_px=(float(x), float(y)))


def motion_of(blur: Blur, further: Floats) -> Blur:
    """The motion in a round blur with further variances xx, xy, yy, if it is clearly longer."""
    V = blur.variance_px2 * np.eye(2) + further[[0, 1, 1, 2]].reshape(2, 2)
    small, large = np.linalg.eigvalsh(V)
    if large - small < ELONGATED_PX2:
        return replace(blur, motion_px=(0.0, 0.0))
    angle = 0.5 * np.arctan2(2 * V[0, 1], V[0, 0] - V[1, 1])
    small = _believed(float(small))
    length = float(np.sqrt(12 * (large - small))) if large > small else 0.0
    return Blur(small, (length * float(np.cos(angle)), length * float(np.sin(angle))))


def _believed(variance_px2: float) -> float:
    return float(np.clip(variance_px2, *VARIANCES_PX2))
