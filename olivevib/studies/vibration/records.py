"""Records with known truth: tones, trials of a shaker, what camera and logger get of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from olivevib.arrays import Floats
from olivevib.signals import Samples

AXES = ("x", "y", "z")


def displacement(t_s: ArrayLike, mm: ArrayLike) -> Samples:
    """Samples of displacement."""
    return Samples(np.asarray(t_s), np.asarray(mm), "displacement", "mm", AXES)


def acceleration(t_s: ArrayLike, m_s2: ArrayLike) -> Samples:
    """Samples of acceleration."""
    return Samples(np.asarray(t_s), np.asarray(m_s2), "acceleration", "m/s2", AXES)


def rotation(rng: np.random.Generator, size: float | None = None) -> Floats:
    """A random rotation matrix; size: angle in rad instead of any."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle = rng.uniform(0, np.pi) if size is None else size
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k))


@dataclass(frozen=True)
class Tone:
    """One tone on three axes: x(t) = amplitude cos(2 pi f t + phase)."""

    f_hz: float
    amplitude: Floats
    phase: Floats

    def at(self, t_s: Floats, derivative: int = 0) -> Floats:
        """Its values (N, 3), or those of a derivative."""
        omega = 2 * np.pi * self.f_hz
        turn = omega * t_s[:, None] + self.phase + derivative * np.pi / 2
        return np.asarray(omega**derivative * self.amplitude * np.cos(turn))


def random_tone(rng: np.random.Generator, low_hz: float = 2.0, high_hz: float = 13.0) -> Tone:
    """A tone of any frequency in the band and any phases, 1, 0.5 and 0.2 on the axes."""
    return Tone(
        rng.uniform(low_hz, high_hz), np.array([1.0, 0.5, 0.2]), rng.uniform(0, 2 * np.pi, 3)
    )


def frequency_bound(tone: Tone, t_s: Floats, noise: float) -> float:
    """Cramer-Rao bound of the frequency for white noise of one size on all axes, Hz."""
    spread = np.sum((t_s - t_s.mean()) ** 2)
    power = np.sum(tone.amplitude**2)
    return float(noise / (2 * np.pi) * np.sqrt(2 / (power * spread)))


def noise_for(tone: Tone, decibels: float) -> float:
    """Noise per axis at which the tone's total power stands so far above the total noise's."""
    return float(np.sqrt(np.sum(tone.amplitude**2) / 2 / 3 / 10 ** (decibels / 10)))


@dataclass(frozen=True)
class Shaker:
    """A trial of a trunk shaker: rest, spin-up, steady, shut-down, free decay."""

    f_hz: float = 25.0
    amplitude_mm: float = 4.0
    minor: float = 0.5  # of the orbit
    harmonic: float = 0.12
    rest_s: float = 1.5
    start_up_s: float = 1.2
    steady_s: float = 6.0
    shut_down_s: float = 0.8
    decay_s: float = 1.5
    decay_hz: float = 4.0
    damping: float = 0.04
    sway_mm: float = 5.0
    sway_hz: float = 0.9
    precession_hz: float = 0.0

    @property
    def limits(self) -> Floats:
        """Start of start-up, steady, shut-down, decay, and the end, s."""
        parts = [0, self.start_up_s, self.steady_s, self.shut_down_s, self.decay_s]
        return np.asarray(self.rest_s + np.cumsum(parts))


def truth(
    shaker: Shaker, rng: np.random.Generator, rate_hz: float = 20_000.0, margin_s: float = 1.0
) -> tuple[Floats, Floats]:
    """Times and displacement (mm, without sway) of the trial; margin: rest before and after."""
    a, b, c, d, end = shaker.limits
    t = np.arange(-margin_s, end + margin_s, 1 / rate_hz)
    speed = np.interp(t, [a, b, c, d], [0, 1, 1, 0], left=0, right=0)
    turn = 2 * np.pi * np.cumsum(shaker.f_hz * speed) / rate_hz
    size = shaker.amplitude_mm * speed**2
    main, side = size * np.cos(turn), shaker.minor * size * np.sin(turn)
    lean = 2 * np.pi * shaker.precession_hz * t
    path = np.stack(
        [
            main * np.cos(lean) - side * np.sin(lean),
            main * np.sin(lean) + side * np.cos(lean),
            shaker.harmonic * size * np.cos(2 * turn + 0.3),
        ],
        axis=1,
    )
    since = np.maximum(t - d, 0.0)
    omega = 2 * np.pi * shaker.decay_hz
    path[:, 0] += (
        (t > d)
        * shaker.amplitude_mm
        / 2
        * np.exp(-shaker.damping * omega * since)
        * np.sin(omega * since)
    )
    return t, np.asarray(path @ rotation(rng).T)


def camera(
    t: Floats,
    path: Floats,
    rng: np.random.Generator,
    times: Floats,
    noise_mm: float = 0.06,
    exposure_s: float = 0.0,
    shaker: Shaker | None = None,
) -> Samples:
    """What a camera measures at times (mid-exposure): exact exposure mean, noise, sway."""
    spline = CubicSpline(t, path)
    if exposure_s:
        whole = spline.antiderivative()
        seen = (whole(times + exposure_s / 2) - whole(times - exposure_s / 2)) / exposure_s
    else:
        seen = spline(times)
    seen = seen + noise_mm * rng.normal(size=seen.shape)
    if shaker is not None:
        slow = shaker.sway_mm * np.sin(2 * np.pi * shaker.sway_hz * times + 0.4)
        seen = seen + slow[:, None] * np.array([1.0, 0.6, 0.2])
    return displacement(times, seen)


@dataclass(frozen=True)
class Logger:
    """An accelerometer and its clock: stamp = t + offset + drift (t - t_mid)."""

    rate_hz: float = 2000.0
    offset_s: float = 0.2
    drift: float = 30e-6
    t_mid_s: float = 5.0
    bias: tuple[float, float, float] = (0.3, -0.2, 0.35)
    noise_m_s2: float = 0.02 * 9.80665


def sensor(
    t: Floats, path: Floats, rng: np.random.Generator, logger: Logger, turn: Floats
) -> Samples:
    """What the logger writes: acceleration in sensor axes (turn carries them to the camera's).

    Each sample is the mean over its period (a change of velocity): impacts keep their impulse.
    """
    stamp = t + logger.offset_s + logger.drift * (t - logger.t_mid_s)
    speed = CubicSpline(stamp, path).derivative()
    period = 1 / logger.rate_hz
    times = np.arange(stamp[0] + period, stamp[-1] - period, period)
    mean = (speed(times + period / 2) - speed(times - period / 2)) / period * 1e-3
    values = mean @ turn + np.array(logger.bias)
    return acceleration(times, values + logger.noise_m_s2 * rng.normal(size=values.shape))
