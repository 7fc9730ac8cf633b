"""How much noise there is where it counts: around the line as the camera sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.fit import ClockFit, Seen
from olivevib.comparison.forward import Nuisance
from olivevib.vibration.lsscan import OVERSAMPLING, scan
from olivevib.vibration.verdict import fold

_BINS = 12.0  # either side of the line


def with_local_noise(seen: Seen, clock: ClockFit, f_hz: float) -> ClockFit:
    """The fit with its covariance raised where noise near the line exceeds the white level."""
    noise = np.maximum(clock.noise_mm, 1e-12)
    excess = local_excess(seen.t_s, clock.residual_mm / noise, seen.slow, f_hz)
    return replace(clock, covariance=clock.covariance * excess)


def local_excess(t_s: Floats, whitened: Floats, slow: Nuisance, f_hz: float) -> float:
    """How far residuals (N, C) of size 1 exceed the white level around a line, at least 1.

    An accelerometer's noise, integrated twice, lies low and may pile up where a fast line is
    seen; a covariance from the residual's overall size would be too small there.
    """
    span = float(t_s[-1] - t_s[0])
    rate = 1.0 / float(np.median(np.diff(t_s)))
    left = scan(t_s, whitened, rate / 2, slow.count)
    near = np.abs(left.f_hz - fold(f_hz, rate)) * span < _BINS
    near &= left.f_hz > slow.limit_hz
    if near.sum() < 4 * OVERSAMPLING:
        return 1.0
    excess = float(left.explained[near].mean()) / 2  # a sine takes two variances out of noise
    return max(1.0, excess)
