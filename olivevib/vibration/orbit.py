"""The orbit of a line: ellipse in space, its sense, and how its long axis turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, floats
from olivevib.signals import Samples
from olivevib.vibration.clock import measured
from olivevib.vibration.types import Line

_STRAIGHT = 3.0  # a minor axis below that many of its noise means says "linear"


@dataclass(frozen=True)
class Orbit:
    """The ellipse that a line draws, from x(t) = Re(P exp(i w t)).

    major, minor: semi-axes in ``unit``; major_axis, normal (3,): unit vectors, the motion runs
    counter-clockwise seen against the normal. straight: the minor axis is within noise of zero;
    then normal and sense mean nothing (NaN). minor_noise: the minor axis that noise alone gives a
    straight motion. folded: the frequency is not known, so an odd fold may reverse the sense.
    """

    major: float
    minor: float
    major_axis: Floats
    normal: Floats
    straight: bool
    minor_noise: float
    unit: str
    folded: bool

    def __post_init__(self) -> None:
        for name in ("major_axis", "normal"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (3,), nan=True))


def complex_amplitude(line: Line) -> NDArray[np.complex128]:
    """(3,) P of x(t) = Re(P exp(2 pi i f (t - t_ref)))."""
    return np.asarray(line.amplitude * np.exp(1j * line.phase_rad))


def orbit(line: Line) -> Orbit:
    """The orbit of a line with three axes; NaN where the line has no amplitudes.

    S = P.P without conjugate, n = |P|^2: semi-axes sqrt((n +- |S|)/2); the real and the imaginary
    part of P exp(-i arg(S)/2) are the two axes. Noise gives a straight motion a minor axis of
    1.24 sigma; below three of these it is called straight. Degenerate for a circle (any axis is
    the long one).
    """
    amplitude = complex_amplitude(line)
    unknown = np.full(3, np.nan)
    if not np.isfinite(amplitude).all():
        return Orbit(np.nan, np.nan, unknown, unknown, False, np.nan, line.unit, True)
    square = complex(np.sum(amplitude**2))
    size = float(np.sum(np.abs(amplitude) ** 2))
    major = float(np.sqrt((size + abs(square)) / 2))
    minor = float(np.sqrt(max(0.0, (size - abs(square)) / 2)))
    turned = amplitude * np.exp(-0.5j * np.angle(square))
    across = np.cross(turned.real, -turned.imag)
    noise = 1.24 * _noise_across(line, turned.real)
    straight = minor < _STRAIGHT * noise
    length = float(np.linalg.norm(across))
    return Orbit(
        major=major,
        minor=minor,
        major_axis=turned.real / major if major > 0 else unknown,
        normal=unknown if straight or length == 0 else across / length,
        straight=straight,
        minor_noise=noise,
        unit=line.unit,
        folded=len(line.candidates_hz) > 1,
    )


def largest(line: Line) -> tuple[float, float]:
    """The largest amplitude of a line in any direction, and its sigma: the long half axis.

    The sigma is that of axes that err alike (an exposure that is corrected), an upper bound.
    """
    found = orbit(line)
    return found.major, float(np.abs(found.major_axis) @ line.amplitude_sigma)


def _noise_across(line: Line, major_axis: Floats) -> float:
    """Sigma of an amplitude across the long axis, rms of the two directions."""
    size = float(np.linalg.norm(major_axis))
    if size == 0:
        return float(np.sqrt(np.mean(line.amplitude_sigma**2)))
    e = major_axis / size
    variance = line.amplitude_sigma**2
    return float(np.sqrt(np.sum(variance * (1 - e**2)) / 2))


@dataclass(frozen=True)
class Precession:
    """How the long axis of an orbit turns: rate and its sigma, angles (K,) in windows at t_s (K,).

    Angles are in the plane ``axes``, unwrapped modulo 180 degrees.
    """

    rate_deg_s: float
    rate_sigma_deg_s: float
    t_s: Floats
    angle_deg: Floats
    axes: tuple[str, str]


def precession(samples: Samples, line: Line, window_s: float = 0.5) -> Precession | None:
    """Turning of the orbit's long axis, from fits of the line's frequency in short windows.

    In the plane of the two axes of largest amplitude. None where a window holds fewer than six
    samples, or fewer than three windows fit, or the line is not known.
    """
    t_s, values = measured(samples)
    if not np.isfinite(line.amplitude).all() or t_s.size < 18:
        return None
    two = np.sort(np.argsort(line.amplitude)[-2:])
    starts = np.arange(t_s[0], t_s[-1] - window_s, window_s / 2)
    at, angles = [], []
    for start in starts:
        inside = (t_s >= start) & (t_s < start + window_s)
        if inside.sum() < 6:
            return None
        p = _window_amplitude(t_s[inside], values[inside][:, two], line)
        turned = (p * np.exp(-0.5j * np.angle(np.sum(p**2)))).real
        at.append(float(start) + window_s / 2)
        angles.append(float(np.arctan2(turned[1], turned[0])))
    if len(at) < 3:
        return None
    return _turning(np.array(at), np.array(angles), (samples.axes[two[0]], samples.axes[two[1]]))


def _window_amplitude(t_s: Floats, values: Floats, line: Line) -> NDArray[np.complex128]:
    turn = 2 * np.pi * line.f_hz * (t_s - line.t_ref_s)
    columns = np.stack([np.ones(t_s.size), t_s - t_s.mean(), np.cos(turn), np.sin(turn)], axis=1)
    c = np.linalg.lstsq(columns, values, rcond=None)[0]
    return np.asarray(c[2] - 1j * c[3])


def _turning(at_s: Floats, angles: Floats, axes: tuple[str, str]) -> Precession:
    unwrapped = np.unwrap(angles, period=np.pi)
    since = at_s - at_s.mean()
    rate = float(np.sum(since * unwrapped) / np.sum(since**2))
    rest = unwrapped - unwrapped.mean() - rate * since
    # windows overlap by half: half as many are independent
    sigma = np.sqrt(2 * np.sum(rest**2) / max(1, at_s.size - 2) / np.sum(since**2))
    return Precession(
        float(np.degrees(rate)), float(np.degrees(sigma)), at_s, np.degrees(unwrapped), axes
    )
