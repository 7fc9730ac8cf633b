"""What each camera saw at the times of its own rows against what the sensor predicts, in pixels.

A path that was fitted at one frequency repeats itself, so half a period more or less fits it as
well, and its samples are no independent measurements. What each camera saw, start-up and shut-down
included, is both: it tells which of several lags is right, and fits the clocks with honest sigmas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, floats
from olivevib.comparison.fit import LIMIT, STEPS, STOP, ClockFit, solve
from olivevib.comparison.forward import Nuisance, SensorMotion, nuisance
from olivevib.comparison.noise import local_excess
from olivevib.geometry import rotation_from_vector
from olivevib.vibration.verdict import fold

_FEWEST = 30  # frames that a view needs
_NARROWEST_HZ = 0.3


@dataclass(frozen=True)
class View:
    """A marker in one camera: t_s (N,) on the trial clock, px (N, 2), px_per_mm (2, 3), exposure.

    px_per_mm: how the centre's picture moves with its place, about its mean, in the axes of the
    paths that are compared.
    """

    t_s: Floats
    px: Floats
    px_per_mm: Floats
    exposure_s: float = 0.0

    def __post_init__(self) -> None:
        t_s = floats("t_s", self.t_s, (None,))
        object.__setattr__(self, "t_s", t_s)
        object.__setattr__(self, "px", floats("px", self.px, (t_s.size, 2)))
        object.__setattr__(self, "px_per_mm", floats("px_per_mm", self.px_per_mm, (2, 3)))


@dataclass(frozen=True)
class Misfits:
    """left_px2 (L,) what each lag leaves of total_px2; freedom: of both cameras together."""

    left_px2: Floats
    total_px2: float
    freedom: int

    def chi_square(self) -> Floats:
        """(L,) in units of the noise that the best leaves."""
        return np.asarray(self.left_px2 / (self.left_px2.min() / max(1, self.freedom)))

    def coherence(self) -> float:
        """Share of the pictures' motion that the best explains."""
        return float(1 - self.left_px2.min() / self.total_px2) if self.total_px2 > 0 else 0.0


@dataclass(frozen=True)
class _Frames:
    """The frames of a view that the sensor covers at every lag in question; px less slow part."""

    view: View
    good: Bools
    slow: Nuisance
    px: Floats

    @property
    def t_s(self) -> Floats:
        """(N,) their times."""
        return np.asarray(self.view.t_s[self.good])

    def shown(self, mm: Floats) -> Floats:
        """Motion (N, 3) in mm as this camera shows it (N, 2), px, without its slow part."""
        return self.slow.out(mm @ self.view.px_per_mm.T)


def misfits(
    views: Sequence[View],
    motion: SensorMotion,
    states: Sequence[ClockFit],
    slow_hz: float,
    line_hz: float,
) -> Misfits | None:
    """How badly each state (lag, turn, gain) predicts what the cameras saw; None: too few frames.

    slow_hz: motion slower than that is taken out, unless the sensor's line (line_hz, NaN: none) is
    seen there.
    """
    offsets = [s.offset_s for s in states]
    parts = [_frames(v, motion, (min(offsets), max(offsets)), slow_hz, line_hz) for v in views]
    kept = [part for part in parts if part is not None]
    if not kept:
        return None
    left = [sum(_left(part, motion, state) for part in kept) for state in states]
    count = sum(2 * (int(p.good.sum()) - p.slow.count) for p in kept)
    return Misfits(np.array(left), float(sum(np.sum(p.px**2) for p in kept)), count)


def _frames(
    view: View,
    motion: SensorMotion,
    ends_s: tuple[float, float],
    slow_hz: float,
    line_hz: float,
) -> _Frames | None:
    good = motion.usable(view.t_s + ends_s[0], view.exposure_s)
    good &= motion.usable(view.t_s + ends_s[1], view.exposure_s)
    t_s = view.t_s[good]
    if t_s.size < _FEWEST:
        return None
    rate = 1.0 / float(np.median(np.diff(t_s)))
    seen_hz = fold(line_hz, rate) if np.isfinite(line_hz) else np.inf
    slow = nuisance(t_s, min(slow_hz, max(_NARROWEST_HZ, 0.6 * seen_hz)))
    return _Frames(view, good, slow, slow.out(view.px[good]))


def _left(part: _Frames, motion: SensorMotion, state: ClockFit) -> float:
    """Sum of squares that a state leaves of one view, px²."""
    return float(np.sum((part.px - part.shown(state.gain * _felt(part, motion, state))) ** 2))


def _felt(part: _Frames, motion: SensorMotion, state: ClockFit) -> Floats:
    """(N, 3) the sensor's motion at the frames of a view, in camera axes, mm."""
    seen = motion.seen(_sensor_times(part, state), part.view.exposure_s)
    return np.asarray(seen @ state.R_camera_sensor.T)


def _sensor_times(part: _Frames, state: ClockFit) -> Floats:
    since = part.t_s - state.t_ref_s
    return np.asarray(part.t_s + state.offset_s + state.drift * since)


def fit_views(
    views: Sequence[View], motion: SensorMotion, start: ClockFit, slow_hz: float, line_hz: float
) -> ClockFit | None:
    """The clock, gain and turn that predict both cameras' pictures best, from a start nearby.

    Gauss-Newton as fit_clock, each coordinate of each camera weighted by its own noise, which is
    that around the line. None where the sensor covers too few frames.
    """
    ends = (start.offset_s, start.offset_s)
    parts = [p for v in views if (p := _frames(v, motion, ends, slow_hz, line_hz)) is not None]
    if not parts:
        return None
    state = start
    for _ in range(STEPS):
        jacobian, left, noise = _linearised(parts, motion, state)
        step = np.clip(solve(jacobian / noise, left / noise)[0], -LIMIT, LIMIT)
        state = _stepped(state, step)
        if (np.abs(step) < STOP).all():
            break
    jacobian, left, noise = _linearised(parts, motion, state)
    excess = float(np.mean([_excess(part, motion, state, line_hz) for part in parts]))
    return replace(state, covariance=solve(jacobian / noise, left / noise)[1] * excess)


def _linearised(
    parts: Sequence[_Frames], motion: SensorMotion, state: ClockFit
) -> tuple[Floats, Floats, Floats]:
    """Jacobian (K, 6), what is left (K, 1) and its noise (K, 1) of all coordinates of all views."""
    rows, left, noise = [], [], []
    for part in parts:
        speed = motion.speed(_sensor_times(part, state), part.view.exposure_s)
        speed = state.gain * speed @ state.R_camera_sensor.T
        moved = _felt(part, motion, state)
        since = (part.t_s - state.t_ref_s)[:, None]
        turns = [np.cross(axis, state.gain * moved) for axis in np.eye(3)]
        columns = [part.shown(c) for c in (speed, speed * since, moved, *turns)]
        rest = part.px - state.gain * columns[2]
        freedom = max(1, len(rest) - part.slow.count - 2)
        size = np.sqrt(np.sum(rest**2, axis=0) / freedom)
        rows.append(np.stack(columns, axis=2).reshape(-1, len(columns)))
        left.append(rest.reshape(-1, 1))
        noise.append(np.broadcast_to(np.maximum(size, 1e-12), rest.shape).reshape(-1, 1))
    return np.concatenate(rows), np.concatenate(left), np.concatenate(noise)


def _stepped(state: ClockFit, step: Floats) -> ClockFit:
    return replace(
        state,
        offset_s=state.offset_s + float(step[0]),
        drift=state.drift + float(step[1]),
        gain=state.gain + float(step[2]),
        R_camera_sensor=rotation_from_vector(step[3:]) @ state.R_camera_sensor,
    )


def _excess(part: _Frames, motion: SensorMotion, state: ClockFit, line_hz: float) -> float:
    """By how much the noise around the line exceeds the white level in one view, at least 1."""
    if not np.isfinite(line_hz):
        return 1.0
    rest = part.px - part.shown(state.gain * _felt(part, motion, state))
    noise = np.sqrt(np.mean(rest**2, axis=0))
    return local_excess(part.t_s, rest / np.maximum(noise, 1e-12), part.slow, line_hz)
