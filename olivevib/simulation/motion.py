"""How trunk, branches, cars and boards move: analytic functions of time.

A motion gives (N, 6) at times (N,): displacement x, y, z in mm and rotation vector in rad, both in
the left camera's frame and about the rest pose. Terms add up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from olivevib.arrays import Floats, floats


class Term(Protocol):
    """One part of a motion."""

    def __call__(self, t_s: Floats) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6), at times (N,)."""
        ...


@dataclass(frozen=True)
class Motion:
    """The sum of its terms; without terms: still."""

    terms: tuple[Term, ...] = ()

    def __call__(self, t_s: ArrayLike) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6), at times (N,)."""
        t = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
        out = np.zeros((t.size, 6))
        for term in self.terms:
            out += term(t)
        return out


def smooth(u: Floats) -> Floats:
    """The step 10 u³ - 15 u⁴ + 6 u⁵ from 0 to 1, flat to the second derivative at both ends."""
    u = np.clip(u, 0.0, 1.0)
    out: Floats = u**3 * (10 + u * (6 * u - 15))
    return out


def smooth_integral(u: Floats) -> Floats:
    """Integral of ``smooth`` from 0; it grows by 1 per unit beyond 1."""
    inside = np.clip(u, 0.0, 1.0)
    out: Floats = inside**4 * (2.5 + inside * (inside - 3)) + np.maximum(u - 1, 0.0)
    return out


@dataclass(frozen=True)
class Phases:
    """When the shaker runs: rest, start-up from ``start_s``, steady, shut-down from ``stop_s``."""

    start_s: float
    rise_s: float
    stop_s: float
    fall_s: float

    def __post_init__(self) -> None:
        if min(self.rise_s, self.fall_s) <= 0 or self.stop_s < self.start_s + self.rise_s:
            raise ValueError(f"phases out of order: {self}")

    @property
    def steady_s(self) -> tuple[float, float]:
        """First and last instant of steady shaking."""
        return self.start_s + self.rise_s, self.stop_s

    def turns(self, t_s: Floats) -> Floats:
        """Revolutions since the start, in periods of the steady frequency."""
        up = self.rise_s * smooth_integral((t_s - self.start_s) / self.rise_s)
        return up - self.fall_s * smooth_integral((t_s - self.stop_s) / self.fall_s)

    def envelope(self, t_s: Floats, surge: float) -> Floats:
        """Share of the steady amplitude; start-up and shut-down overshoot by about ``surge``."""
        up = np.clip((t_s - self.start_s) / self.rise_s, 0, 1)
        down = np.clip((t_s - self.stop_s) / self.fall_s, 0, 1)
        bump = 64 * ((up * (1 - up)) ** 3 + (down * (1 - down)) ** 3)
        out: Floats = smooth(up) * (1 - smooth(down)) * (1 + surge * bump)
        return out


def _six(name: str, value: ArrayLike) -> Floats:
    return floats(name, value, (6,))


@dataclass(frozen=True)
class Shake:
    """Forced vibration: an orbit cos, sin (6,) at ``f_hz`` through the phases of a trial.

    Start-up and shut-down are phase-continuous chirps between 0 and f_hz. cos2, sin2 (6,): the
    second harmonic.
    """

    f_hz: float
    phases: Phases
    cos: Floats
    sin: Floats
    cos2: Floats
    sin2: Floats
    surge: float = 0.2

    def __post_init__(self) -> None:
        for name in ("cos", "sin", "cos2", "sin2"):
            object.__setattr__(self, name, _six(name, getattr(self, name)))

    def __call__(self, t_s: Floats) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6)."""
        angle = 2 * np.pi * self.f_hz * self.phases.turns(t_s)[:, None]
        size = self.phases.envelope(t_s, self.surge)[:, None]
        first = np.cos(angle) * self.cos + np.sin(angle) * self.sin
        second = np.cos(2 * angle) * self.cos2 + np.sin(2 * angle) * self.sin2
        out: Floats = size * (first + second)
        return out

    @property
    def amplitude(self) -> Floats:
        """Peak amplitude (6,) of the steady fundamental along each axis."""
        return np.hypot(self.cos, self.sin)


@dataclass(frozen=True)
class Sway:
    """Slow sinusoidal motion with amplitude (6,), as wind makes it or a hand that waves a board."""

    f_hz: float
    amplitude: Floats
    phase_rad: Floats  # (6,)

    def __post_init__(self) -> None:
        for name in ("amplitude", "phase_rad"):
            object.__setattr__(self, name, _six(name, getattr(self, name)))

    def __call__(self, t_s: Floats) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6)."""
        out: Floats = self.amplitude * np.sin(2 * np.pi * self.f_hz * t_s[:, None] + self.phase_rad)
        return out


@dataclass(frozen=True)
class Decay:
    """Free vibration of a branch after the shaker stops, grown in over ``onset_s``."""

    f_hz: float
    damping: float  # ratio to critical
    start_s: float
    amplitude: Floats  # (6,)
    onset_s: float = 0.15

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", _six("amplitude", self.amplitude))

    def __call__(self, t_s: Floats) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6)."""
        after = np.maximum(t_s - self.start_s, 0.0)
        w = 2 * np.pi * self.f_hz
        free = np.exp(-self.damping * w * after) * np.sin(w * _damped(self.damping) * after)
        out: Floats = (smooth(after / self.onset_s) * free)[:, None] * self.amplitude
        return out


@dataclass(frozen=True)
class Release:
    """A branch pulled aside by ``held`` (6,) and let go at ``start_s``: the exact free decay.

    Position and velocity are continuous; acceleration jumps, as it does when a rope is cut.
    """

    f_hz: float  # undamped natural frequency
    damping: float
    start_s: float
    held: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "held", _six("held", self.held))

    def __call__(self, t_s: Floats) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6)."""
        after = np.maximum(t_s - self.start_s, 0.0)
        w, root = 2 * np.pi * self.f_hz, _damped(self.damping)
        wave = np.cos(w * root * after) + self.damping / root * np.sin(w * root * after)
        out: Floats = (np.exp(-self.damping * w * after) * wave)[:, None] * self.held
        return out

    @property
    def damped_hz(self) -> float:
        """The frequency that the record shows."""
        return self.f_hz * _damped(self.damping)


def _damped(ratio: float) -> float:
    if not 0 <= ratio < 1:
        raise ValueError(f"the damping ratio must lie in [0, 1), got {ratio}")
    return float(np.sqrt(1 - ratio**2))


@dataclass(frozen=True)
class Lap:
    """A toy car on a closed oval track, pushed by hand: it turns with the track's tangent.

    axes (2, 3): unit vectors of the oval's half axes radii_mm (2,); the rest pose is the track's
    centre, the car heading along the first axis. uneven: relative change of speed within a lap.
    """

    axes: Floats
    radii_mm: Floats
    lap_s: float
    start_turn: float = 0.0
    uneven: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", floats("axes", self.axes, (2, 3)))
        object.__setattr__(self, "radii_mm", floats("radii_mm", self.radii_mm, (2,)))
        if not abs(self.uneven) < 1:
            raise ValueError("a car that turns back is not a lap: |uneven| must be below 1")

    def __call__(self, t_s: Floats) -> Floats:
        """Displacement (mm) and rotation vector (rad), (N, 6)."""
        turn = 2 * np.pi * (t_s / self.lap_s + self.start_turn)
        angle = turn + self.uneven * np.sin(turn)
        c, s = np.cos(angle), np.sin(angle)
        a, b = self.radii_mm
        place = (a * c)[:, None] * self.axes[0] + (b * s)[:, None] * self.axes[1]
        heading = angle + np.pi / 2 + np.arctan2((a - b) * s * c, a * s * s + b * c * c)
        normal = np.cross(self.axes[0], self.axes[1])
        return np.column_stack([place, heading[:, None] * normal])


def acceleration_m_s2(place_mm: Term, t_s: Floats, step_s: float = 5e-4) -> Floats:
    """Acceleration (N, 3) of the first three columns of ``place_mm`` by a five-point difference.

    Truncation is step⁴/90 times the sixth derivative: 1e-6 of the value at 25 Hz.
    """
    weights = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12
    steps = np.arange(-2, 3) * step_s
    total = sum(w * place_mm(t_s + h)[:, :3] for w, h in zip(weights, steps, strict=True))
    return np.asarray(total, dtype=np.float64) / step_s**2 / 1000.0
