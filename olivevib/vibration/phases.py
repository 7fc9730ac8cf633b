"""The phases of a trial: rest, start-up, steady, shut-down, decay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.signals import Samples
from olivevib.vibration.clock import measured
from olivevib.vibration.sway import sway_columns

NAMES = ("rest", "start-up", "steady", "shut-down", "decay")
WHOLE = "whole"


@dataclass(frozen=True)
class Phase:
    """A part of the trial: name (one of NAMES, or "whole"), start and end on the trial clock."""

    name: str
    start_s: float
    end_s: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.start_s) and np.isfinite(self.end_s)):
            raise ValueError(f"phase {self.name!r} needs finite limits")
        if self.end_s <= self.start_s:
            raise ValueError(f"phase {self.name!r} ends ({self.end_s}) before it starts")

    @property
    def duration_s(self) -> float:
        """Length, s."""
        return self.end_s - self.start_s


@dataclass(frozen=True)
class PhaseSettings:
    """How phases are told apart: rolling window, thresholds of the rolling RMS."""

    window_s: float = 0.3
    hop_s: float = 0.05
    on_share: float = 0.05  # of the 90th percentile
    on_mads: float = 6.0  # scaled median absolute deviations above rest
    steady_share: float = 0.5  # of the median while shaking
    shortest_s: float = 0.5


def find_phases(
    motion: Mapping[int, Samples], sway_hz: float, settings: PhaseSettings = PhaseSettings()
) -> tuple[Phase, ...]:
    """Phases from camera displacement alone; () without markers or samples.

    The rolling RMS of all markers (it survives aliasing) tells shaking from rest. A record that
    shakes from end to end is one steady phase; one that never shakes is one rest.
    """
    times, rms = rolling_rms(motion, sway_hz, settings)
    if times.size < 2:
        return ()
    start, end = _limits(motion)
    top, low = np.percentile(rms, [90, 5])
    if low > 0.3 * top:
        return (Phase("steady", start, end),)
    on = _longest(rms > _threshold(rms, settings))
    if on is None or (on.stop - on.start) * settings.hop_s < settings.shortest_s:
        return (Phase("rest", start, end),)
    shaking = rms[on]
    steady = _longest(shaking > settings.steady_share * np.median(shaking))
    first = on.start + (steady.start if steady else 0)
    last = on.start + (steady.stop - 1 if steady else shaking.size - 1)
    limits = (start, times[on.start], times[first], times[last], times[on.stop - 1], end)
    return _named(limits, ("rest", "start-up", "steady", "shut-down", "rest"))


def rolling_rms(
    motion: Mapping[int, Samples], sway_hz: float, settings: PhaseSettings
) -> tuple[Floats, Floats]:
    """Times (K,) and rolling RMS (K,) of the vector, the sway taken out, all markers together."""
    start, end = _limits(motion)
    half = settings.window_s / 2
    times = np.arange(start + half, end - half + 1e-9, settings.hop_s)
    total = np.zeros(times.size)
    for samples in motion.values():
        t_s, values = measured(samples)
        if t_s.size < 4:
            continue
        total += _rolling_power(t_s, _without_sway(t_s, values, sway_hz), times, half)
    return times, np.sqrt(total)


def _limits(motion: Mapping[int, Samples]) -> tuple[float, float]:
    ends = [(s.t_s[0], s.t_s[-1]) for s in motion.values() if s.t_s.size]
    if not ends:
        return 0.0, 0.0
    return float(min(a for a, _ in ends)), float(max(b for _, b in ends))


def _without_sway(t_s: Floats, values: Floats, sway_hz: float) -> Floats:
    columns = sway_columns(t_s, sway_hz)
    if columns is None:
        return np.asarray(values - values.mean(axis=0))
    return np.asarray(values - columns @ (columns.T @ values))


def _rolling_power(t_s: Floats, values: Floats, times: Floats, half: float) -> Floats:
    """Mean square of the vector within half a window of each time; 0 where nothing was seen."""
    sums = np.concatenate([[0.0], np.cumsum(np.sum(values**2, axis=1))])
    first, last = np.searchsorted(t_s, times - half), np.searchsorted(t_s, times + half)
    count = last - first
    return np.asarray((sums[last] - sums[first]) / np.maximum(count, 1))


def _threshold(rms: Floats, settings: PhaseSettings) -> float:
    top = float(np.percentile(rms, 90))
    quiet = rms[rms < 0.25 * top]
    if not quiet.size:
        return settings.on_share * top
    middle = float(np.median(quiet))
    mad = 1.4826 * float(np.median(np.abs(quiet - middle)))
    return max(middle + settings.on_mads * mad, settings.on_share * top)


def _longest(flags: Bools) -> slice | None:
    """The longest run of True, or None."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    starts, stops = edges[::2], edges[1::2]
    if not starts.size:
        return None
    at = int(np.argmax(stops - starts))
    return slice(int(starts[at]), int(stops[at]))


def _named(limits: tuple[float, ...], names: tuple[str, ...]) -> tuple[Phase, ...]:
    """Phases between successive limits; those that would be empty are left out."""
    pairs = zip(names, limits[:-1], limits[1:], strict=True)
    return tuple(Phase(n, float(a), float(b)) for n, a, b in pairs if b - a > 1e-9)
