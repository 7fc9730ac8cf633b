"""The phases of a trial: rest, start-up, steady, shut-down, decay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.signals import Samples, fit_stamps
from olivevib.vibration.blocks import block_means
from olivevib.vibration.clock import clock_of, measured
from olivevib.vibration.ridge import Ridge, camera_ridge, camera_rms, sensor_ridge, sensor_rms

NAMES = ("rest", "start-up", "steady", "shut-down", "decay")
WHOLE = "whole"


@dataclass(frozen=True)
class Phase:
    """A part of the trial: name (one of NAMES, or "whole"), start and end on the trial clock."""

    name: str
    start_s: float
    end_s: float

    def __post_init__(self) -> None:
        if self.name not in (*NAMES, WHOLE):
            raise ValueError(f"there is no phase {self.name!r}; use {', '.join(NAMES)}")
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
    """How phases are told apart: thresholds of the rolling RMS and of the dominant frequency.

    on_share of the 90th percentile, on_mads scaled median absolute deviations above rest: shaking.
    steady_percent: the dominant frequency stays within that of its median. shortest_s: no
    shaking, and no steady phase, is shorter.
    """

    on_share: float = 0.05
    on_mads: float = 6.0
    steady_percent: float = 2.0
    shortest_s: float = 0.5


DEFAULTS = PhaseSettings()

_CAMERA_WINDOW_S, _CAMERA_HOP_S = 1.0, 0.1
_ONSET_WINDOW_S = 0.3
_PLATEAU = 0.95  # of the median RMS while steady: the motion has reached its size
_RAMP_S = 0.5  # a start-up or shut-down reaches at most so far into the steady frequency
_SENSOR_WINDOW_S, _SENSOR_HOP_S = 0.3, 0.02
_SENSOR_ONSET_S = 0.1
_SENSOR_BAND_HZ = (3.0, 100.0)
_SENSOR_BLOCK_HZ = 400.0


@dataclass(frozen=True)
class _Track:
    """How a ridge is read: least tolerance of its frequency; how far the first and last steady
    window's middle lies inside the steady phase; whether the limits are then drawn in to where
    the amplitude is steady too (a camera's windows are long).
    """

    tolerance_hz: float
    reach_s: float
    plateau: bool


_CAMERA_TRACK = _Track(0.15, 0.2, plateau=True)
_SENSOR_TRACK = _Track(0.1, 0.0, plateau=False)
_RUNNING = 0.35  # of the usual RMS: less is a ramp at the machine's frequency; beats stay above
_QUIET = 0.25  # of the 90th percentile: below, a window may be rest


def find_phases(
    motion: Mapping[int, Samples], sway_hz: float, settings: PhaseSettings = DEFAULTS
) -> tuple[Phase, ...]:
    """Phases from camera displacement alone; () without markers or samples.

    The rolling RMS of all markers (it survives aliasing) tells shaking from rest; the dominant
    frequency as the camera sees it tells steady from start-up and shut-down, aliased or not. A
    record that shakes from end to end has no rest; one that never shakes is one rest. The end of
    a shaking that dies at a frequency of its own is the decay.
    """
    parts = [motion[m] for m in sorted(motion) if motion[m].t_s.size > 1]
    if not parts:
        return ()
    limits = min(float(s.t_s[0]) for s in parts), max(float(s.t_s[-1]) for s in parts)
    ridge = camera_ridge(parts, sway_hz, _CAMERA_WINDOW_S, _CAMERA_HOP_S)
    short = camera_rms(parts, sway_hz, _ONSET_WINDOW_S, _CAMERA_HOP_S / 2)
    if ridge.t_s.size < 3:
        return (Phase("steady", *limits),) if limits[1] > limits[0] else ()
    return _phases(short, ridge, limits, _CAMERA_TRACK, settings)


def find_sensor_phases(sensor: Samples, settings: PhaseSettings = DEFAULTS) -> tuple[Phase, ...]:
    """Phases from an accelerometer (any unit), on its own clock.

    Limits of the steady phase are good to some 30 ms; the onset of shaking is found late and its
    end early by 0.1-0.2 s, because a machine that turns slowly hardly accelerates.
    """
    t_s, values = measured(sensor)
    if t_s.size < 64:
        return ()
    even_t, even = _even_blocks(t_s, values)
    ridge = sensor_ridge(even_t, even, _SENSOR_BAND_HZ, _SENSOR_WINDOW_S, _SENSOR_HOP_S)
    short = sensor_rms(even_t, even, _SENSOR_ONSET_S, _SENSOR_HOP_S / 2)
    if ridge.t_s.size < 3:
        return ()
    return _phases(short, ridge, (float(t_s[0]), float(t_s[-1])), _SENSOR_TRACK, settings)


def _even_blocks(t_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """An even record of at most some 800 Hz, by means of blocks; gaps hold the last value.

    Only for finding phases, where a held value in a gap moves nothing by more than the gap.
    """
    clock = clock_of(t_s)
    if clock.even:
        block = max(1, int(clock.rate_hz / _SENSOR_BLOCK_HZ))
        return block_means(t_s, values, block)
    fit = fit_stamps(t_s)
    count = int(fit.sequence[-1]) + 1
    held = np.maximum.accumulate(np.bincount(fit.sequence, np.arange(t_s.size), count))
    even = values[held.astype(np.int64)]
    block = max(1, int(fit.rate_hz / _SENSOR_BLOCK_HZ))
    n = count // block * block
    times = t_s[0] + (np.arange(n // block) * block + (block - 1) / 2) / fit.rate_hz
    return times, even[:n].reshape(-1, block, values.shape[1]).mean(axis=1)


def _phases(
    short: Ridge,
    ridge: Ridge,
    limits: tuple[float, float],
    track: _Track,
    settings: PhaseSettings,
) -> tuple[Phase, ...]:
    start, end = limits
    shaking = _shaking(short, limits, settings)
    if shaking is None:
        return (Phase("rest", start, end),)
    on, off, fade = shaking
    inside = (ridge.t_s >= on) & (ridge.t_s <= off) & np.isfinite(ridge.f_hz)
    steady = _steady(ridge, inside, track.tolerance_hz, settings)
    if steady is None:
        return _named((start, on, off, end), ("rest", "start-up", "rest"))
    first = float(np.clip(ridge.t_s[steady.start] - track.reach_s, on, off))
    last = float(np.clip(ridge.t_s[steady.stop - 1] + track.reach_s, on, off))
    at_ends = ridge.t_s[steady.start] - start < ridge.window_s, end - last < ridge.window_s
    first = start if at_ends[0] and on == start else first
    last = end if at_ends[1] and off == end else last
    if track.plateau:
        first, last = _plateau(short, first, last, (first > start, last < end))
    decay, stop = _decay(ridge, last, off, fade, track.tolerance_hz)
    cuts = (start, on, first, last, decay, stop, end)
    return _named(cuts, ("rest", "start-up", "steady", "shut-down", "decay", "rest"))


def _shaking(
    short: Ridge, limits: tuple[float, float], settings: PhaseSettings
) -> tuple[float, float, float] | None:
    """Start and end of the longest shaking and when all has faded; None: there is none.

    A record without rest shakes throughout.
    """
    known = np.isfinite(short.rms)
    rms = short.rms[known]
    if not rms.size:
        return None
    top, low = np.percentile(rms, [90, 5])
    if low > _QUIET * top:
        return limits[0], limits[1], limits[1]
    noise = _rest_level(rms, settings)
    level = min(max(noise, settings.on_share * top), _QUIET * top)
    filled = np.interp(short.t_s, short.t_s[known], rms)
    run = _longest(filled > level)
    if run is None or (run.stop - run.start) * short.hop_s < settings.shortest_s:
        return None
    quiet = np.flatnonzero(filled[run.stop :] <= noise)
    fade = run.stop + int(quiet[0]) if quiet.size else short.t_s.size
    on = limits[0] if run.start == 0 else float(short.t_s[run.start])
    off = limits[1] if run.stop == short.t_s.size else float(short.t_s[run.stop - 1])
    return on, off, max(off, limits[1] if fade == short.t_s.size else float(short.t_s[fade]))


def _rest_level(rms: Floats, settings: PhaseSettings) -> float:
    """Above this nothing is rest any more: from the quietest fifth of the record."""
    quiet = rms[rms <= np.percentile(rms, 20)]
    middle = float(np.median(quiet))
    mad = 1.4826 * float(np.median(np.abs(quiet - middle)))
    return middle + settings.on_mads * max(mad, 0.05 * middle)


def _steady(ridge: Ridge, on: Bools, tolerance_hz: float, settings: PhaseSettings) -> slice | None:
    """The longest run of windows whose dominant frequency stays at its median while strong."""
    if not on.any():
        return None
    strong = on & (ridge.rms > 0.5 * np.median(ridge.rms[on]))
    if not strong.any():
        return None
    middle = float(np.median(ridge.f_hz[strong]))
    allowed = max(tolerance_hz, settings.steady_percent / 100 * middle)
    full = ridge.rms > _RUNNING * np.median(ridge.rms[strong])
    run = _longest(on & full & (np.abs(ridge.f_hz - middle) <= allowed))
    if run is None or (run.stop - run.start) * ridge.hop_s < settings.shortest_s:
        return None
    return run


def _plateau(
    short: Ridge, first: float, last: float, movable: tuple[bool, bool]
) -> tuple[float, float]:
    """The steady limits drawn in to where the motion has reached its size, by at most _RAMP_S.

    The frequency is steady before the amplitude is: a ramp left in the steady phase lowers the
    amplitude of the line and shifts its frequency. Inside, a machine may beat as it likes.
    """
    inside = (short.t_s >= first) & (short.t_s <= last) & np.isfinite(short.rms)
    if inside.sum() < 4 or last - first < 2 * _RAMP_S:
        return first, last
    full = np.flatnonzero(inside & (short.rms >= _PLATEAU * np.median(short.rms[inside])))
    begin = float(short.t_s[full[0]]) + short.window_s / 4
    finish = float(short.t_s[full[-1]]) - short.window_s / 4
    if movable[0]:
        first = min(max(first, begin), first + _RAMP_S)
    if movable[1]:
        last = max(min(last, finish), last - _RAMP_S)
    return first, last


def _decay(
    ridge: Ridge, from_s: float, off_s: float, fade_s: float, tolerance_hz: float
) -> tuple[float, float]:
    """Start and end of the free decay: the last windows that die at one frequency.

    Without one, both are where shaking ended: an accelerometer hears a slow decay below the
    level of shaking, so the search goes on until all has faded.
    """
    after = np.flatnonzero((ridge.t_s > from_s) & (ridge.t_s <= fade_s) & (ridge.rms > 0))
    if after.size < 4:
        return off_s, off_s
    f, rms = ridge.f_hz[after], ridge.rms[after]
    middle = float(np.median(f[after.size // 2 :]))
    alike = np.abs(f - middle) <= max(tolerance_hz, 0.15 * middle)
    dying = np.concatenate([rms[1:] < 1.05 * rms[:-1], [True]])
    other = np.flatnonzero(~(alike & dying))
    first = int(other[-1]) + 1 if other.size else 0
    lasts = (after.size - first) * ridge.hop_s
    if after.size - first < 3 or lasts < 1.0 / middle:
        return off_s, off_s
    return float(ridge.t_s[after[first]]), fade_s


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
