"""The best other lag: how near it comes, and what excludes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.fit import ClockFit, Seen
from olivevib.comparison.forward import SensorMotion
from olivevib.comparison.lag import CoarseLag
from olivevib.comparison.views import View, misfits
from olivevib.geometry import vector_from_rotation

CLOSE = 0.05  # a rival lag whose correlation comes that near is told
_NOISE_ONLY = 0.95  # coherence below which what is left is more than noise: chi-square cannot tell
_DECISIVE = 25.0  # chi-square by which the best lag must beat the rival to be sure

_SAME_S = 2e-3  # lags that near are one

Refine = Callable[[float], tuple[Seen, ClockFit]]


@dataclass(frozen=True)
class Rival:
    """The best other lag: whether it is near enough to tell, and whether it is excluded.

    scatter_s: how far apart the lags lie that fit alike; NaN where they go on without end.
    by_views: what the cameras saw at the times of their rows excludes it.
    """

    near: bool
    excluded: bool
    distance_s: float
    scatter_s: float
    offset_s: float = np.nan
    turn_deg: float = np.nan
    by_views: bool = False

    @property
    def open(self) -> bool:
        """Both lags remain."""
        return self.near and not self.excluded


def rival_of(
    refine: Refine, lag: CoarseLag, clock: ClockFit, seen_mm: Floats, borne_out: bool | None
) -> Rival:
    """The rival of the fitted lag; borne_out: whether the cameras' own rows exclude every other.

    None: there are none to ask, and the path tells. A fitted path cannot: its samples are not
    independent, so chi-square would exclude lags that it cannot tell apart.
    """
    if not np.isfinite(lag.rival_s) or lag.peak - lag.second_peak >= CLOSE:
        return Rival(False, True, 0.0, 0.0)
    _, other = refine(lag.rival_s)
    distance = abs(lag.rival_s - lag.offset_s)
    noise = np.maximum(clock.noise_mm, 1e-12)
    excluded = bool(borne_out)
    if borne_out is None and np.isfinite(
        other.gain
    ):  # the two may share all frames but a few at the ends
        now, then = (np.mean((c.residual_mm / noise) ** 2) for c in (clock, other))
        frames = min(len(clock.residual_mm), len(other.residual_mm))
        by_path = bool(3 * frames * (then - now) > _DECISIVE)
        excluded = by_path and coherence_of(seen_mm, clock.residual_mm) > _NOISE_ONLY
    if np.isfinite(other.gain):
        distance = abs(other.offset_s - clock.offset_s)
    turn = angle_deg(other.R_camera_sensor @ clock.R_camera_sensor.T)
    scatter = np.nan if lag.level else max(distance, lag.scatter_s)
    return Rival(True, excluded, distance, scatter, lag.rival_s, turn, bool(borne_out))


def borne_out_by(
    views: Sequence[View],
    motion: SensorMotion,
    lag: CoarseLag,
    refine: Refine,
    slow_hz: float,
    line_hz: float,
) -> tuple[CoarseLag, bool]:
    """The lag, of all that the path leaves open, that the cameras bear out; whether they decide.

    They decide where the best explains what they saw but for noise, and beats the next by more
    than noise could. Without views, or with one lag only, the lag stays as it is.
    """
    if not views or lag.alike_s.size < 2 or lag.peak - lag.second_peak >= CLOSE:
        return lag, False
    states: list[tuple[float, ClockFit]] = []
    for offset in lag.alike_s.tolist():
        state = refine(offset)[1]
        same = any(abs(state.offset_s - other.offset_s) < _SAME_S for _, other in states)
        if np.isfinite(state.gain) and not same:
            states.append((offset, state))
    if len(states) < 2:
        return lag, False
    told = misfits(views, motion, [state for _, state in states], slow_hz, line_hz)
    if told is None:
        return lag, False
    order = np.argsort(told.left_px2)
    worth = told.chi_square()[order]
    decided = bool(worth[1] - worth[0] > _DECISIVE) and told.coherence() > _NOISE_ONLY
    best, second = (states[int(k)][0] for k in order[:2])
    return replace(lag, offset_s=best, rival_s=second), decided


def angle_deg(R: Floats) -> float:
    """The angle of a rotation; NaN where it is not known."""
    if not np.isfinite(R).all():
        return np.nan
    return float(np.degrees(np.linalg.norm(vector_from_rotation(R))))


def coherence_of(optical: Floats, residual: Floats) -> float:
    """Share of what the camera saw that the fit explains, 0 … 1."""
    total = float(np.sum(optical**2))
    return float(np.clip(1 - np.sum(residual**2) / total, 0, 1)) if total > 0 else np.nan
