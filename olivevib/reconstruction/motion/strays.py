"""Whether a fitted speed that wanders is the one that the pictures show, at every moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.reconstruction.motion.solve import SHARED, Branch, Model
from olivevib.reconstruction.motion.wander import Ridge
from olivevib.vibration.verdict import fold

STRAY_HZ = 0.5  # that fit and pictures may differ by; windows of a second tell 0.1 Hz apart
MARGIN_HZ = 0.05  # nearer to a multiple of half the frame rate counts as across it
INSTANTS = 200


@dataclass(frozen=True)
class Seen:
    """What was seen on the way to a fit, for its verdict.

    fast_hz_s: largest change of the apparent frequency; offset_lost: the cameras' offset was
    searched for in vain; stray: in words, where a wandering speed is not that of the pictures.
    """

    fast_hz_s: float = 0.0
    offset_lost: bool = False
    stray: str = ""


def speed(model: Model, branch: Branch, t_s: Floats) -> Floats:
    """Frequency (N,) Hz of the fundamental at t_s."""
    f = np.full(t_s.size, branch.theta[0])
    if model.psi is not None:
        bend = model.psi.values(branch.theta[SHARED:, None], t_s, 1)[:, 0]
        f = f + bend / (2 * np.pi)
    return np.asarray(f)


def stray_of(
    model: Model, branch: Branch, ridge: Ridge, span: tuple[float, float], rate_hz: float
) -> str:
    """What is wrong with a wandering speed, or nothing.

    Where it crosses a multiple of half the frame rate it meets its own mirror image there, and
    either way on is as good.
    """
    t = np.linspace(*span, INSTANTS)
    f = speed(model, branch, t)
    half = rate_hz / 2
    if np.floor((f.min() - MARGIN_HZ) / half) != np.floor((f.max() + MARGIN_HZ) / half):
        return (
            "its speed crosses a multiple of half the frame rate, where it meets its mirror image"
        )
    seen = np.interp(t, ridge.t_s, ridge.f_hz)
    away = min(
        max(abs(fold(h * one, rate_hz) - at) for one, at in zip(f, seen, strict=True))
        for h in (1, 2)
    )
    if away > STRAY_HZ:
        return f"the fitted speed leaves that of the pictures by {away:.1f} Hz at some moment"
    return ""
