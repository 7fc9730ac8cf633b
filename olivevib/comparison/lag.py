"""Which lag between the clocks: envelopes over a wide range, then correlation over a fine one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.fit import Seen
from olivevib.comparison.forward import SensorMotion, nuisance
from olivevib.comparison.settings import ComparisonSettings

_ENVELOPE_HOP_S = 0.02
_ENVELOPE_WINDOW_S = 0.25
_LIVELY = 0.15  # spread of an envelope, of its mean, from which it can tell a lag
_CHUNK = 64
_ALIKE = 0.005  # of correlation
_NONE = np.empty(0)


@dataclass(frozen=True)
class CoarseLag:
    """The best lag, how well both motions correlate there, and the best rival lag.

    scatter_s: rms distance of the lags that do as well as the rival; level: no envelope placed
    the search, so that lags outside it may do as well. alike_s (K,): every lag that does as well as
    the rival, the best among them.
    """

    offset_s: float
    peak: float
    rival_s: float
    second_peak: float
    scatter_s: float
    level: bool
    alike_s: Floats


def offsets_that_overlap(
    camera_s: Floats, motion: SensorMotion, settings: ComparisonSettings
) -> tuple[float, float] | None:
    """Offsets (sensor stamp minus trial clock) within the search that leave enough in common.

    Enough: half of the shorter record. None where no offset does.
    """
    length = float(camera_s[-1] - camera_s[0])
    common = 0.5 * min(length, motion.end_s - motion.start_s)
    low = motion.start_s - float(camera_s[-1]) + common
    high = motion.end_s - float(camera_s[0]) - common
    low = max(low, settings.expected_offset_s - settings.search_s)
    high = min(high, settings.expected_offset_s + settings.search_s)
    return (low, high) if low <= high and common > 0 else None


def envelope_offset(
    camera_s: Floats,
    camera_mm: Floats,
    motion: SensorMotion,
    limits: tuple[float, float],
    slow_hz: float,
) -> float | None:
    """The offset at which the rolling RMS of both correlate best; None where they are level.

    Start-up and shut-down shape the envelopes; a steady tone alone has none. The sensor is
    sampled at the camera's rate, so that what folds into the slow part is lost to both alike.
    """
    hop = _ENVELOPE_HOP_S
    columns = nuisance(camera_s, slow_hz)
    optical = _rolling(camera_s, columns.out(camera_mm), hop)
    sensor_s = _camera_like(camera_s, motion)
    predicted = nuisance(sensor_s, slow_hz).out(motion.seen(sensor_s, 0.0))
    sensor = _rolling(sensor_s, predicted, hop)
    if optical.size < 5 or sensor.size < 5 or not (_lively(optical) and _lively(sensor)):
        return None
    first = motion.start_s - float(camera_s[0])
    lags = np.arange(int((limits[0] - first) / hop), int((limits[1] - first) / hop) + 1)
    worth = [_correlation(optical, sensor, int(k)) for k in lags]
    return first + float(lags[int(np.argmax(worth))]) * hop


def _camera_like(camera_s: Floats, motion: SensorMotion) -> Floats:
    """The instants at which a camera of that rate would have sampled the sensor's record."""
    period = float(np.median(np.diff(camera_s)))
    count = int((motion.end_s - motion.start_s) / period)
    return np.asarray(motion.start_s + np.arange(count) * period, dtype=np.float64)


def _rolling(t_s: Floats, values: Floats, hop: float) -> Floats:
    """Rolling RMS on an even grid of ``hop`` from half a window after the first sample."""
    half = _ENVELOPE_WINDOW_S / 2
    times = np.arange(t_s[0], t_s[-1], hop)
    sums = np.concatenate([[0.0], np.cumsum(np.sum(values**2, axis=1))])
    low, high = np.searchsorted(t_s, times - half), np.searchsorted(t_s, times + half)
    return np.asarray(np.sqrt((sums[high] - sums[low]) / np.maximum(1, high - low)))


def _lively(envelope: Floats) -> bool:
    return bool(envelope.std() > _LIVELY * envelope.mean())


def _correlation(optical: Floats, sensor: Floats, lag: int) -> float:
    """Correlation of optical[i] with sensor[i - lag] over what both have."""
    low, high = max(0, -lag), min(optical.size, sensor.size - lag)
    if high - low < 5:
        return -1.0
    a, b = optical[low:high], sensor[low + lag : high + lag]
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0 else -1.0


def fine_lag(
    seen: Seen, motion: SensorMotion, offsets_s: Floats, apart_s: float, level: bool
) -> CoarseLag:
    """Correlation over a fine grid of offsets, the sensor turned as suits each best.

    The rival is the best lag at least apart_s away: with the sensor free to turn, a half-period
    slip of a single tone shows itself here. level: the envelopes could not place the grid.
    """
    worth = np.concatenate(
        [
            turned_correlation(seen, _seen(motion, seen, chunk))
            for chunk in np.array_split(offsets_s, max(1, offsets_s.size // _CHUNK))
        ]
    )
    best = int(np.argmax(worth))
    away = offsets_s - offsets_s[best]
    far = np.abs(away) >= apart_s
    if not far.any():
        return CoarseLag(float(offsets_s[best]), float(worth[best]), np.nan, 0.0, 0.0, level, _NONE)
    rival = int(np.flatnonzero(far)[np.argmax(worth[far])])
    good = worth > worth[rival] - _ALIKE
    tops = good & (worth >= np.roll(worth, 1)) & (worth >= np.roll(worth, -1))
    alike = away[good]
    return CoarseLag(
        offset_s=float(offsets_s[best]),
        peak=float(worth[best]),
        rival_s=float(offsets_s[rival]),
        second_peak=float(worth[rival]),
        scatter_s=float(np.sqrt(np.mean(alike**2))),
        level=level,
        alike_s=np.asarray(offsets_s[tops]),
    )


def _seen(motion: SensorMotion, seen: Seen, offsets_s: Floats) -> Floats:
    """(L, N, 3) prediction at each offset; 0 where the sensor does not reach."""
    q, exposure_s = offsets_s[:, None] + seen.t_s, seen.exposure_s
    inside = motion.usable(q.ravel(), exposure_s).reshape(q.shape)
    clipped = np.clip(q, motion.start_s + exposure_s, motion.end_s - exposure_s)
    mm = motion.seen(clipped.ravel(), exposure_s).reshape(*q.shape, 3)
    return np.asarray(np.where(inside[..., None], mm, 0.0))


def turned_correlation(seen: Seen, predicted_mm: Floats) -> Floats:
    """(L,) largest correlation over all rotations of what was seen with predictions (L, N, 3).

    With the singular values of the cross matrix s1 >= s2 >= s3: s1 + s2 +- s3, the sign of its
    determinant, over both sizes (Kabsch, Acta Cryst. A32 (1976) 922,
    doi 10.1107/S0567739476001873). The predictions' slow part counts for nothing: the camera's is
    out already, so only their size must lose it.
    """
    lags, n, _ = predicted_mm.shape
    flat = predicted_mm.transpose(1, 0, 2).reshape(n, -1)
    cross = (seen.mm.T @ flat).reshape(3, lags, 3).transpose(1, 0, 2)
    slow = (seen.slow.columns.T @ flat).reshape(-1, lags, 3)
    power = np.sum(predicted_mm**2, axis=(1, 2)) - np.sum(slow**2, axis=(0, 2))
    s = np.linalg.svd(cross, compute_uv=False)
    sign = np.where(np.linalg.det(cross) < 0, -1.0, 1.0)
    size = np.sqrt(np.sum(seen.mm**2) * np.maximum(power, 0.0))
    total = s[:, 0] + s[:, 1] + sign * s[:, 2]
    return np.asarray(np.divide(total, size, out=np.zeros_like(total), where=size > 0))
