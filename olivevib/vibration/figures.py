"""The figures of a motion in one phase: RMS, peaks, crest, resultant, dose (CONVENTIONS.md)."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np

from olivevib.arrays import Floats, floats

CLASSES_M_S2 = (50.0, 100.0, 200.0, 300.0)  # upper ends of the resultant's classes; then more


@dataclass(frozen=True)
class Figures:
    """What a technician reads off a waveform; NaN where a figure is not known.

    Per axis (3,), mean removed: rms, peak (largest absolute value), peak_to_peak, crest
    (peak/rms), kurtosis (sine 1.5), noise (standard deviation of measurement noise in the
    waveform), line_amplitude (peak) with sigma, thd_percent. Of the resultant r = |x|: mean, rms
    (= total RMS), median, p95, p99, largest;
    extent: peak-to-peak along the direction of largest motion, with the sigma of the noise of two
    samples. Accelerations also: class_percent (5,) of time below 50, 100, 200, 300
    m/s2 and above; energy_m2_s3 integral of r^2; dose_m_s175 fourth root of the integral of r^4.
    """

    quantity: str
    unit: str
    rms: Floats
    peak: Floats
    peak_to_peak: Floats
    crest: Floats
    kurtosis: Floats
    noise: Floats
    line_amplitude: Floats
    line_amplitude_sigma: Floats
    thd_percent: Floats
    resultant_mean: float
    resultant_rms: float
    resultant_median: float
    resultant_p95: float
    resultant_p99: float
    resultant_max: float
    extent: float
    class_percent: Floats
    energy_m2_s3: float
    dose_m_s175: float
    extent_sigma: float = nan

    def __post_init__(self) -> None:
        for name in _AXES:
            object.__setattr__(self, name, floats(name, getattr(self, name), (3,), nan=True))
        shares = floats("class_percent", self.class_percent, (5,), nan=True)
        object.__setattr__(self, "class_percent", shares)


_AXES = (
    "rms",
    "peak",
    "peak_to_peak",
    "crest",
    "kurtosis",
    "noise",
    "line_amplitude",
    "line_amplitude_sigma",
    "thd_percent",
)


@dataclass(frozen=True)
class LineFigures:
    """The line's part in the figures: amplitude (3,), sigma (3,), harmonics (H, 3), all peak."""

    amplitude: Floats
    sigma: Floats
    harmonics: Floats

    @property
    def thd_percent(self) -> Floats:
        """(3,) harmonic distortion sqrt(A2^2 + A3^2 + ...)/A1 of the harmonics that are known."""
        known = np.isfinite(self.harmonics).any(axis=0) if self.harmonics.size else np.zeros(3)
        total = np.sqrt(np.nansum(self.harmonics**2, axis=0)) if self.harmonics.size else known
        good = np.asarray(known, bool) & (self.amplitude > 0)
        out = np.full(3, np.nan)
        return np.asarray(np.divide(100 * total, self.amplitude, out=out, where=good))


NO_LINE = LineFigures(np.full(3, np.nan), np.full(3, np.nan), np.empty((0, 3)))


def figures(
    values: Floats, quantity: str, unit: str, duration_s: float, noise: Floats, line: LineFigures
) -> Figures:
    """Figures of values (N, 3), N >= 2, lasting duration_s; the mean of each axis is removed."""
    x = values - values.mean(axis=0)
    square = x * x
    rms = np.sqrt(square.mean(axis=0))
    low, high = x.min(axis=0), x.max(axis=0)
    peak = np.maximum(high, -low)
    power = square.sum(axis=1)
    r = np.sqrt(power)
    p50, p95, p99 = np.percentile(r, [50, 95, 99])
    direction, extent = _extent(x)
    accelerations = quantity == "acceleration"
    return Figures(
        quantity=quantity,
        unit=unit,
        rms=rms,
        peak=peak,
        peak_to_peak=high - low,
        crest=_ratio(peak, rms),
        kurtosis=_ratio(np.einsum("nc,nc->c", square, square) / len(x), rms**4),
        noise=noise,
        line_amplitude=line.amplitude,
        line_amplitude_sigma=line.sigma,
        thd_percent=line.thd_percent,
        resultant_mean=float(r.mean()),
        resultant_rms=float(np.sqrt(power.mean())),
        resultant_median=float(p50),
        resultant_p95=float(p95),
        resultant_p99=float(p99),
        resultant_max=float(r.max()),
        extent=extent,
        extent_sigma=float(np.sqrt(2 * np.sum((direction * noise) ** 2))),
        class_percent=_shares(r) if accelerations else np.full(5, np.nan),
        energy_m2_s3=float(power.mean() * duration_s) if accelerations else np.nan,
        dose_m_s175=float((power @ power / len(x) * duration_s) ** 0.25)
        if accelerations
        else np.nan,
    )


def unknown(quantity: str, unit: str, line: LineFigures = NO_LINE) -> Figures:
    """Figures that are not known (the true frequency is not), with what is known of the line."""
    axes, nan = np.full(3, np.nan), float("nan")
    return Figures(
        quantity=quantity,
        unit=unit,
        rms=axes,
        peak=axes,
        peak_to_peak=axes,
        crest=axes,
        kurtosis=axes,
        noise=axes,
        line_amplitude=line.amplitude,
        line_amplitude_sigma=line.sigma,
        thd_percent=line.thd_percent,
        resultant_mean=nan,
        resultant_rms=nan,
        resultant_median=nan,
        resultant_p95=nan,
        resultant_p99=nan,
        resultant_max=nan,
        extent=nan,
        class_percent=np.full(5, nan),
        energy_m2_s3=nan,
        dose_m_s175=nan,
    )


def _ratio(above: Floats, below: Floats) -> Floats:
    out = np.full(above.shape, np.nan)
    return np.asarray(np.divide(above, below, out=out, where=below > 0))


def _extent(x: Floats) -> tuple[Floats, float]:
    """Direction of largest motion (3,) and peak-to-peak along it."""
    direction = np.linalg.eigh(x.T @ x)[1][:, -1]
    return direction, float(np.ptp(x @ direction))


def _shares(r: Floats) -> Floats:
    above = [float(np.count_nonzero(r >= limit)) for limit in CLASSES_M_S2]
    counts = -np.diff([r.size, *above, 0.0])
    return np.asarray(100.0 * counts / r.size)
