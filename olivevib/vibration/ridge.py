"""How frequency and strength of a motion change in time: the ridge of its spectrogram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from olivevib.arrays import Floats, floats
from olivevib.signals import Samples
from olivevib.vibration.clock import clock_of, measured
from olivevib.vibration.lsscan import scan
from olivevib.vibration.sway import sway_columns

_CHUNK = 256
_FEWEST = 8  # samples in a window


@dataclass(frozen=True)
class Ridge:
    """Along the record: t_s (K,) middle of each window, f_hz (K,) of the strongest line as seen at
    the sampling rate, rms (K,) of the vector; evidence (K,) of the line; NaN: too few samples.
    """

    t_s: Floats
    f_hz: Floats
    rms: Floats
    evidence: Floats
    window_s: float

    def __post_init__(self) -> None:
        for name in ("t_s", "f_hz", "rms", "evidence"):
            value = floats(name, getattr(self, name), (np.asarray(self.t_s).size,), nan=True)
            object.__setattr__(self, name, value)

    @property
    def hop_s(self) -> float:
        """Distance of the windows."""
        return float(self.t_s[1] - self.t_s[0]) if self.t_s.size > 1 else self.window_s


def camera_ridge(
    motion: Sequence[Samples], sway_hz: float, window_s: float = 1.0, hop_s: float = 0.1
) -> Ridge:
    """Ridge of one or more markers' displacement on their true times, all powers added.

    Sway is taken out over the whole record; each window is scanned by least squares from sway_hz
    to half the rate, so gaps do no harm. A line above half the rate shows where it folds.
    """
    parts = _moving(motion, sway_hz)
    if not parts:
        return _empty(window_s)
    top = max(clock_of(t).rate_hz for t, _ in parts) / 2
    times = _middles(parts, window_s, hop_s)
    rows = [_camera_window(parts, float(at), window_s, sway_hz, top) for at in times]
    columns = np.array(rows).reshape(-1, 3)
    return Ridge(times, columns[:, 0], columns[:, 1], columns[:, 2], window_s)


def camera_rms(motion: Sequence[Samples], sway_hz: float, window_s: float, hop_s: float) -> Ridge:
    """Rolling RMS of the markers' displacement, the sway taken out; no frequencies."""
    parts = _moving(motion, sway_hz)
    if not parts:
        return _empty(window_s)
    times = _middles(parts, window_s, hop_s)
    total, count = np.zeros(times.size), np.zeros(times.size)
    for t_s, values in parts:
        sums = np.concatenate([[0.0], np.cumsum(np.sum(values**2, axis=1))])
        first = np.searchsorted(t_s, times - window_s / 2)
        last = np.searchsorted(t_s, times + window_s / 2)
        enough = last - first >= _FEWEST
        power = (sums[last] - sums[first]) / np.maximum(1, last - first)
        total += np.where(enough, power, 0.0)
        count += enough
    unknown = np.full(times.size, np.nan)
    rms = np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan)
    return Ridge(times, unknown, rms, unknown, window_s)


def _moving(motion: Sequence[Samples], sway_hz: float) -> list[tuple[Floats, Floats]]:
    """Times and motion without sway of the markers that were seen often enough."""
    parts = [measured(samples) for samples in motion]
    return [(t, _without_sway(t, x, sway_hz)) for t, x in parts if t.size >= _FEWEST]


def _middles(parts: list[tuple[Floats, Floats]], window_s: float, hop_s: float) -> Floats:
    start, end = min(t[0] for t, _ in parts), max(t[-1] for t, _ in parts)
    return np.asarray(np.arange(start + window_s / 2, end - window_s / 2 + 1e-9, hop_s))


def _empty(window_s: float) -> Ridge:
    none = np.empty(0)
    return Ridge(none, none, none, none, window_s)


def _without_sway(t_s: Floats, values: Floats, sway_hz: float) -> Floats:
    columns = sway_columns(t_s, sway_hz)
    if columns is None:
        return np.asarray(values - values.mean(axis=0))
    return np.asarray(values - columns @ (columns.T @ values))


def _camera_window(
    parts: list[tuple[Floats, Floats]], at_s: float, window_s: float, low_hz: float, top_hz: float
) -> tuple[float, float, float]:
    """Frequency, RMS and evidence of one window."""
    power: Floats | None = None
    evidence: Floats | None = None
    squares, f_hz = [], np.empty(0)
    for t_s, values in parts:
        first, last = np.searchsorted(t_s, [at_s - window_s / 2, at_s + window_s / 2])
        if last - first < _FEWEST:
            continue
        x = values[first:last]
        found = scan(t_s[first:last], x, top_hz, span_s=window_s)
        squares.append(float(np.mean(np.sum(x * x, axis=1))))
        f_hz = found.f_hz
        power = found.power if power is None else power + found.power
        evidence = found.evidence if evidence is None else evidence + found.evidence
    if power is None or evidence is None:
        return np.nan, np.nan, np.nan
    inside = f_hz >= low_hz
    at = int(np.argmax(np.where(inside, power, -1.0)))
    return _vertex(f_hz, power, at), float(np.sqrt(np.mean(squares))), float(evidence[at])


def _vertex(f_hz: Floats, power: Floats, at: int) -> float:
    """Top of the parabola through the three points about a maximum."""
    if at == 0 or at == power.size - 1:
        return float(f_hz[at])
    left, middle, right = power[at - 1 : at + 2]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(f_hz[at] + np.clip(shift, -0.5, 0.5) * (f_hz[1] - f_hz[0]))


def sensor_ridge(
    t_s: Floats, values: Floats, band_hz: tuple[float, float], window_s: float, hop_s: float
) -> Ridge:
    """Ridge of an even record (N, C): Hann windows, axis powers added, Hann ratio at the peak.

    rms is that of the band. evidence: share of the band's power in the peak bin and its neighbours.
    """
    rate = (t_s.size - 1) / float(t_s[-1] - t_s[0])
    n, hop = max(8, round(window_s * rate)), max(1, round(hop_s * rate))
    starts = np.arange(0, t_s.size - n + 1, hop)
    f = fft.rfftfreq(n, 1 / rate)
    inside = (f >= band_hz[0]) & (f <= band_hz[1])
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    scale = 2.0 / (n * np.sum(hann**2))
    windows = sliding_window_view(np.ascontiguousarray(values.T), n, axis=1)[:, ::hop]  # (C, K, n)
    rows = []
    for first in range(0, starts.size, _CHUNK):
        frames = windows[:, first : first + _CHUNK]
        waves = fft.rfft((frames - frames.mean(axis=2, keepdims=True)) * hann, axis=2)
        power = np.sum(waves.real**2 + waves.imag**2, axis=0)
        rows.append(_peaks(power, f, inside, scale))
    columns = np.concatenate(rows) if rows else np.empty((0, 3))
    middle = t_s[0] + (starts + n / 2) / rate
    return Ridge(middle, columns[:, 0], columns[:, 1], columns[:, 2], window_s)


def _peaks(power: Floats, f: Floats, inside: np.ndarray, scale: float) -> Floats:
    """(K, 3): frequency by the Hann ratio, RMS in the band, share of the peak, of each window."""
    band = np.where(inside, power, 0.0)
    at = np.clip(np.argmax(band, axis=1), 1, f.size - 2)
    each = np.arange(at.size)
    peak, left, right = (np.sqrt(power[each, at + k]) for k in (0, -1, 1))
    side = np.where(right >= left, 1.0, -1.0)
    ratio = np.maximum(left, right) / np.where(peak > 0, peak, 1.0)
    shift = side * np.clip((2 * ratio - 1) / (ratio + 1), -0.5, 0.5)
    total = band.sum(axis=1)
    share = (peak**2 + left**2 + right**2) / np.where(total > 0, total, 1.0)
    return np.stack([(at + shift) * f[1], np.sqrt(total * scale), share], axis=1)


def sensor_rms(t_s: Floats, values: Floats, window_s: float, hop_s: float) -> Ridge:
    """Rolling RMS of an even record (N, C), the mean of each window left out; no frequencies.

    Leaving the means out keeps gravity and motion slower than the window away.
    """
    rate = (t_s.size - 1) / float(t_s[-1] - t_s[0])
    n, hop = max(4, round(window_s * rate)), max(1, round(hop_s * rate))
    first = np.arange(0, t_s.size - n + 1, hop)
    zero = np.zeros((1, values.shape[1]))
    sums = np.concatenate([zero, np.cumsum(values - values.mean(axis=0), axis=0)])
    squares = np.concatenate([zero, np.cumsum((values - values.mean(axis=0)) ** 2, axis=0)])
    mean = (sums[first + n] - sums[first]) / n
    power = (squares[first + n] - squares[first]) / n - mean**2
    rms = np.sqrt(np.maximum(power.sum(axis=1), 0.0))
    unknown = np.full(first.size, np.nan)
    return Ridge(t_s[0] + (first + n / 2) / rate, unknown, rms, unknown, window_s)
