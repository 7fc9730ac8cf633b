"""One-sided amplitude spectrum and power spectral density, on the true sample times.

Conventions (CONVENTIONS.md): the mean is removed first; window w periodic over the record,
S1 = sum w, S2 = sum w^2; amplitude (peak) 2|X|/S1, at 0 Hz and at half the rate |X|/S1; density
2|X|^2/(rate S2). The density is then scaled so that its sum times the bin spacing is the variance
of the record: nothing changes for a steady motion, and a motion that grows or dies under the
window keeps its power. The grid ends at half the sampling rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from olivevib.arrays import Floats
from olivevib.vibration.clock import Clock, clock_of
from olivevib.vibration.sums import fourier_sums
from olivevib.vibration.windows import Window

_COINCIDE = 0.5  # |W2|/S1 from which cosine and sine are no longer told apart
_ONE_WAVE = 1e-9  # 1 - |W2|/S1 at which they are one and the same


@dataclass(frozen=True)
class Grid:
    """Frequencies k / span, up to half the rate: the grid all markers of a spectrum share."""

    rate_hz: float
    places: int

    @property
    def step_hz(self) -> float:
        """Bin spacing, Hz."""
        return self.rate_hz / self.places

    @property
    def f_hz(self) -> Floats:
        """(F,) frequencies, 0 to half the rate."""
        return np.asarray(np.arange(self.places // 2 + 1) * self.step_hz)


def grid_of(clock: Clock, segments: int = 1) -> Grid:
    """The grid of a record on ``clock`` cut into ``segments`` that overlap by half."""
    return Grid(clock.rate_hz, max(2, 2 * clock.places // (segments + 1)))


def spectra(t_s: Floats, values: Floats, grid: Grid, window: Window) -> tuple[Floats, Floats]:
    """Amplitude (F, C) and density (F, C) of one record, averaged over half-overlapping segments.

    t_s (N,), values (N, C). Even and complete segments go through the FFT; others through weighted
    least squares of a cosine and a sine at each frequency on the true times (gaps stay gaps). The
    two agree on even data but for the outer bins of wide windows. Amplitudes of several segments
    are averaged as powers.
    """
    start, span = t_s[0] - 0.5 / grid.rate_hz, grid.places / grid.rate_hz
    powers: list[Floats] = []
    densities: list[Floats] = []
    while start + span <= t_s[-1] + 0.6 / grid.rate_hz or not powers:
        inside = slice(*(int(k) for k in np.searchsorted(t_s, [start, start + span])))
        count = inside.stop - inside.start
        if count > 3:
            amplitude, density = _one(t_s[inside], values[inside], start, grid, window)
            powers.append(amplitude**2)
            densities.append(density)
        elif not powers:
            raise ValueError(f"a spectrum needs more than three samples, got {count}")
        start += span / 2
    density = np.mean(densities, axis=0)
    return np.sqrt(np.mean(powers, axis=0)), _to_variance(density, values, grid)


def _to_variance(density: Floats, values: Floats, grid: Grid) -> Floats:
    power = density.sum(axis=0) * grid.step_hz
    scale = np.divide(values.var(axis=0), power, out=np.ones_like(power), where=power > 0)
    return np.asarray(density * scale)


def _one(
    t_s: Floats, values: Floats, start_s: float, grid: Grid, window: Window
) -> tuple[Floats, Floats]:
    centred = values - values.mean(axis=0)
    clock = clock_of(t_s)
    if clock.even and clock.places == grid.places:
        return _even(centred, grid, window)
    return _uneven(t_s - start_s, centred, grid, window)


def _even(centred: Floats, grid: Grid, window: Window) -> tuple[Floats, Floats]:
    n = grid.places
    w = window.at(np.arange(n) / n)
    transform = fft.rfft(centred * w[:, None], axis=0)
    sides = np.full((transform.shape[0], 1), 2.0)
    sides[0] = 1.0
    if n % 2 == 0:
        sides[-1] = 1.0
    power = transform.real**2 + transform.imag**2
    return sides / w.sum() * np.sqrt(power), sides / (grid.rate_hz * np.sum(w * w)) * power


def _uneven(since_s: Floats, centred: Floats, grid: Grid, window: Window) -> tuple[Floats, Floats]:
    """Least squares with the window as weights, on the record's own times.

    Normal matrix of cosine and sine at f, turned into its own axes: eigenvalues (S1 +- |W2|)/2
    with W2 = sum w exp(-2 i w t). Near 0 Hz and half an even rate the two waves coincide; there
    the convention of even records is kept: 2|X|/S1, and |X|/S1 where they are one wave.
    """
    span = grid.places / grid.rate_hz
    w = window.at(since_s / span - 0.5 / grid.places)
    count = grid.places // 2 + 1
    x = fourier_sums(since_s, centred * w[:, None], grid.step_hz, count)
    w2 = fourier_sums(since_s, w[:, None], 2 * grid.step_hz, count)[:, 0]
    s1 = w.sum()
    turned = x * np.exp(-0.5j * np.angle(w2))[:, None]
    along = turned.real / (s1 + np.abs(w2))[:, None]
    across = turned.imag / np.maximum(s1 - np.abs(w2), s1 * _ONE_WAVE)[:, None]
    fitted = 2 * np.hypot(along, across)
    plain = np.where(np.abs(w2) > (1 - _ONE_WAVE) * s1, 1.0, 2.0)[:, None] * np.abs(x) / s1
    amplitude = np.where((np.abs(w2) < _COINCIDE * s1)[:, None], fitted, plain)
    density = amplitude**2 * s1**2 / (2 * grid.rate_hz * np.sum(w * w))
    return np.asarray(amplitude), np.asarray(density)
