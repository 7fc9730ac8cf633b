"""What the blur of the exposure leaves of each harmonic."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.types import MotionSettings

FREE = 0.05  # frequency x exposure up to which no gain is needed (below 0.5 %)
MOST = 0.25  # above which no amplitude is given


def exposures(observations: Observations) -> tuple[float, float]:
    """Median exposure of the left and right frames, s; 0 where unknown."""
    out = []
    for side in ("left", "right"):
        all_s = np.concatenate([getattr(m, side).exposure_s for m in observations.markers])
        known = all_s[np.isfinite(all_s)]
        out.append(float(np.median(known)) if known.size else 0.0)
    return out[0], out[1]


def gain_shares(
    observations: Observations, settings: MotionSettings, f_hz: float, amplitude_px: float
) -> Floats:
    """(H,) sigma of each harmonic's gain over the gain, the larger of both cameras."""
    share = np.zeros(settings.harmonics)
    for exposure in exposures(observations):
        for h in range(1, settings.harmonics + 1):
            product = h * f_hz * exposure
            if settings.gain is not None and 0 < product <= MOST:
                known = settings.gain(h * f_hz, exposure, amplitude_px)
                if known is not None:
                    share[h - 1] = max(share[h - 1], known[1] / known[0])
    return share


def blur_gains(
    observations: Observations, settings: MotionSettings, f_hz: float, amplitude_px: float
) -> tuple[Floats, str]:
    """Gains (2, H) of left and right, and why no amplitude may be given (empty: it may).

    It comes from ``settings.gain``; without one it is 1 up to f E = 0.05, and refused above.
    """
    gain, why = np.ones((2, settings.harmonics)), ""
    for side, exposure in enumerate(exposures(observations)):
        for h in range(1, settings.harmonics + 1):
            product = h * f_hz * exposure
            known = None
            if product == 0 or (settings.gain is None and product <= FREE):
                continue
            if settings.gain is not None and product <= MOST:
                known = settings.gain(h * f_hz, exposure, amplitude_px)
            if known is not None:
                gain[side, h - 1] = known[0]
            elif h == 1:
                why = (
                    f"Frequency x exposure is {product:.2f}: the blur takes an unknown share of "
                    "the amplitude. Use a shorter exposure."
                )
    return gain, why
