"""Displacement, velocity, acceleration: each from the other without differences or drift."""

from __future__ import annotations

import numpy as np
from scipy import fft

from olivevib.arrays import Floats
from olivevib.signals import Samples
from olivevib.vibration.clock import clock_of, measured
from olivevib.vibration.figures import LineFigures
from olivevib.vibration.line import LineFit
from olivevib.vibration.sway import sway_basis
from olivevib.vibration.types import Line

QUANTITIES = ("displacement", "velocity", "acceleration")
UNITS = {"displacement": "mm", "velocity": "mm/s", "acceleration": "m/s2"}
FROM_MM = {"displacement": 1.0, "velocity": 1.0, "acceleration": 1e-3}
NEARLY_EVEN = 0.02  # periods: nearer to an even clock than this, what the fit leaves is even


def line_motion(line: Line, derivative: int, f_hz: float | None = None) -> LineFigures:
    """Amplitudes of a line's n-th derivative: w^n A, from displacement in mm.

    Relative variance (sA/A)^2 + (n sf/f)^2. f_hz: the frequency to take (a candidate); the line's
    own where it is not given. Velocity in mm/s, acceleration in m/s2.
    """
    f = line.f_hz if f_hz is None else f_hz
    omega = (2 * np.pi * f) ** derivative * FROM_MM[QUANTITIES[derivative]]
    amplitude = omega * line.amplitude
    relative = derivative * line.f_sigma_hz / f
    sigma = np.sqrt((omega * line.amplitude_sigma) ** 2 + (amplitude * relative) ** 2)
    multiples = np.arange(2, len(line.harmonics) + 2)[:, None] ** derivative
    return LineFigures(amplitude, sigma, omega * multiples * line.harmonics)


def derive(found: LineFit, samples: Samples, derivative: int, top_hz: float) -> Floats | None:
    """The n-th derivative (N, C) of a displacement at its own times, in its unit per s^n.

    The fitted waves and the slow sway are differentiated exactly; what they leave is
    differentiated in the frequency domain up to top_hz where the times are even, and counts as
    noise where they are not (no value is made up in a gap). None where uneven times hold no line.
    Only for lines whose true frequency is known.
    """
    t_s, values = measured(samples)
    rest = values - values.mean(axis=0)
    waves = np.zeros_like(values)
    if found.fit is not None:
        rest = rest - found.fit.motion(t_s)
        waves = waves + found.fit.motion(t_s, derivative)
    if found.sway_hz > 0:
        slow, moved = _slow(t_s, rest, found.sway_hz, derivative)
        rest, waves = rest - slow, waves + moved
    clock = clock_of(t_s)
    if clock.complete and clock.worst_periods < NEARLY_EVEN:
        return waves + spectral_derivative(rest, clock.rate_hz, derivative, top_hz)
    return waves if found.fit is not None else None


def _slow(t_s: Floats, rest: Floats, limit_hz: float, derivative: int) -> tuple[Floats, Floats]:
    """The sway in ``rest`` and its derivative (see sway.py)."""
    basis = sway_basis(t_s, limit_hz)
    if basis is None:
        return np.zeros_like(rest), np.zeros_like(rest)
    columns = basis.at(t_s)
    coefficients = np.linalg.lstsq(columns, rest, rcond=None)[0]
    return columns @ coefficients, basis.at(t_s, derivative) @ coefficients


def spectral_derivative(
    values: Floats, rate_hz: float, derivative: int, top_hz: float = np.inf
) -> Floats:
    """n-th derivative of evenly sampled values (N, C), exact below half the rate: times (iw)^n.

    The record is taken as it stands (mean removed): what does not fit whole periods errs near the
    ends, so take fitted waves out first. Frequencies above top_hz are left out.
    """
    n = values.shape[0]
    f = fft.rfftfreq(n, 1.0 / rate_hz)
    gain = (2j * np.pi * f) ** derivative
    gain[f > top_hz] = 0.0
    if derivative % 2 and n % 2 == 0:
        gain[-1] = 0.0
    centred = values - values.mean(axis=0)
    return np.asarray(fft.irfft(gain[:, None] * fft.rfft(centred, axis=0), n, axis=0))


def derived_noise(noise: Floats, rate_hz: float, derivative: int, top_hz: float) -> Floats:
    """Standard deviation of white displacement noise (C,) after the n-th derivative up to top_hz.

    s (2 pi top)^n sqrt(2 top / (rate (2n + 1))): s (pi rate)^2/sqrt 5 for acceleration up to half
    the rate.
    """
    top = min(top_hz, rate_hz / 2)
    share = np.sqrt(2 * top / (rate_hz * (2 * derivative + 1)))
    return np.asarray(noise * (2 * np.pi * top) ** derivative * share)


def to_displacement(
    acceleration_m_s2: Floats, rate_hz: float, corner_hz: float = 3.0, finer: int = 1
) -> Floats:
    """Displacement in mm (N finer, C) from even acceleration (N, C), by omega arithmetic.

    Linear detrend, zero-pad to twice the length, times -1/w^2 / (1 + (corner/f)^8), inverse, cut.
    No drift: a constant bias vanishes. corner_hz below half the lowest line wanted. finer: that
    many output samples per input sample (band-limited, exact). The first and last half period of
    the corner are disturbed. Source: vibration analysis, conversion (CONVENTIONS.md).
    """
    n = acceleration_m_s2.shape[0]
    padded = fft.next_fast_len(2 * n, real=True)
    f = fft.rfftfreq(padded, 1.0 / rate_hz)
    gain = np.zeros(f.size)
    gain[1:] = -1e3 / (2 * np.pi * f[1:]) ** 2 / (1 + (corner_hz / f[1:]) ** 8)
    transform = fft.rfft(detrended(acceleration_m_s2), padded, axis=0) * gain[:, None]
    if padded % 2 == 0 and finer > 1:
        transform[-1] *= 0.5
    out = fft.irfft(transform, padded * finer, axis=0) * finer
    return np.asarray(out[: (n - 1) * finer + 1])


def detrended(values: Floats) -> Floats:
    """The values (N, C) without their mean and linear trend, in closed form."""
    n = values.shape[0]
    centred = values - values.mean(axis=0)
    if n < 3:
        return np.asarray(centred)
    u = np.arange(n) - (n - 1) / 2
    return np.asarray(centred - np.outer(u, u @ centred) / np.sum(u * u))
