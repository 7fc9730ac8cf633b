"""Whether the speed of a machine changes too fast for one line to describe it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.signals import Samples
from olivevib.vibration.ridge import camera_ridge

_WINDOW_S = 1.0
_HOP_S = 0.25
_LEAST_WINDOWS = 9
_STRONG = 12.0  # evidence of a line in one window (Gamma(3): 5e-4 at one frequency)
_MOST = 0.7  # share of windows that must show a line


@dataclass(frozen=True)
class Chirp:
    """Lowest and highest frequency at which the line was seen, Hz."""

    low_hz: float
    high_hz: float


def find_chirp(samples: Samples, sway_hz: float) -> Chirp | None:
    """The range of a line that moves by more than half its width from window to window, or None.

    Windows of 1 s: a line is 1 Hz wide, so it moves by more than 0.5 Hz a second.
    """
    if samples.duration_s < _WINDOW_S + _HOP_S * (_LEAST_WINDOWS - 1):
        return None
    ridge = camera_ridge([samples], sway_hz, _WINDOW_S, _HOP_S)
    strong = np.nan_to_num(ridge.evidence) > _STRONG
    if strong.mean() < _MOST:
        return None
    lag = round(_WINDOW_S / _HOP_S)
    both = strong[lag:] & strong[:-lag]
    moves = np.abs(ridge.f_hz[lag:] - ridge.f_hz[:-lag])[both]
    if moves.size < _LEAST_WINDOWS // 2 or np.median(moves) <= 0.5 / _WINDOW_S:
        return None
    f = ridge.f_hz[strong]
    return Chirp(float(f.min()), float(f.max()))
