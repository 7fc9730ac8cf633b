"""Sampled signals and their time axis: what a camera track and an accelerometer have in common."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from olivevib.arrays import Floats, Ints, floats, ints

GRAVITY_M_S2 = 9.80665


class State(IntEnum):
    """Why a sample of a track or trajectory is there, or is not."""

    SEEN = 0
    FLAGGED = 1  # seen, but occluded or doubtful
    HIDDEN = 2
    OUTSIDE = 3
    LOST = 4
    DAMAGED = 5  # the frame is there but cannot be decoded
    DROPPED = 6  # the camera delivered no frame

    @property
    def word(self) -> str:
        """The word used in files, exports and on screen."""
        return self.name.lower()


@dataclass(frozen=True)
class Samples:
    """A sampled signal with its own times; gaps are gaps, never filled in.

    t_s (N,) increasing seconds; values (N, C) in ``unit``; axes: C names. NaN means not measured.
    """

    t_s: Floats
    values: Floats
    quantity: str  # "displacement", "velocity", "acceleration"
    unit: str  # "mm", "mm/s", "m/s2"
    axes: tuple[str, ...]

    def __post_init__(self) -> None:
        t_s = floats("t_s", self.t_s, (None,))
        object.__setattr__(self, "t_s", t_s)
        shape = (t_s.size, len(self.axes))
        object.__setattr__(self, "values", floats("values", self.values, shape, nan=True))
        if t_s.size > 1 and (np.diff(t_s) <= 0).any():
            at = int(np.flatnonzero(np.diff(t_s) <= 0)[0]) + 1
            raise ValueError(f"t_s must increase; sample {at} is not later than the one before")

    @property
    def duration_s(self) -> float:
        """Time from the first sample to the last, s."""
        return float(self.t_s[-1] - self.t_s[0]) if self.t_s.size else 0.0


@dataclass(frozen=True)
class StampFit:
    """The clock behind a list of time stamps: which sample each stamp is, and when it really was.

    sequence (N,) sample count with drops restored; t_s (N,) fitted times; dropped (K,) the counts
    that are missing; jitter_s rms and worst_s largest distance of a stamp from the line.
    ``method`` is "line" (stamps scatter about an even clock) or "stamps" (the rate really varies,
    or there are too few stamps for a line, and the stamps themselves are the times).
    """

    sequence: Ints
    t_s: Floats
    dropped: Ints
    rate_hz: float
    rate_sigma_hz: float
    jitter_s: float
    worst_s: float
    method: str

    def __post_init__(self) -> None:
        n = np.asarray(self.t_s).size
        object.__setattr__(self, "sequence", ints("sequence", self.sequence, (n,)))
        object.__setattr__(self, "t_s", floats("t_s", self.t_s, (n,)))
        object.__setattr__(self, "dropped", ints("dropped", self.dropped, (None,)))


def fit_stamps(stamps_s: ArrayLike) -> StampFit:
    """Fit a line through (count, stamp) with drops restored; fall back to the stamps themselves.

    stamps_s: (N,) seconds, increasing, N >= 2. A stamp that comes late and is made up for is
    jitter; one after which all others stay late by 1, 2, … periods follows a drop of as many
    samples. Where stamps leave the line by a slow wave rather than by scatter (a variable frame
    rate) the stamps are kept as times; a wave no larger than the stamps' own rounding is none.
    A drop before the very last stamp cannot be told from a
    late last stamp and counts as one. Source: knowledge of the field, timing model of
    CONVENTIONS.md (sampling time). Raises ValueError for fewer than two or for repeated stamps.
    """
    stamps = floats("stamps_s", stamps_s, (None,))
    steps = np.diff(stamps)
    if stamps.size < 2 or (steps <= 0).any():
        raise ValueError(f"need at least two increasing stamps, got {stamps.size}")
    sequence = _sequence(stamps)
    intercept, period, period_sigma = _line(sequence, stamps)
    residual = stamps - (intercept + period * sequence)
    rounded = float(np.abs(residual).max()) < 0.75 * _resolution(stamps)
    method = "stamps" if _varies(residual, period) and not rounded else "line"
    line = np.asarray(intercept + period * sequence, dtype=np.float64)
    return StampFit(
        sequence=sequence,
        t_s=stamps if method == "stamps" else line,
        dropped=_missing(sequence),
        rate_hz=1.0 / period,
        rate_sigma_hz=period_sigma / period**2,
        jitter_s=float(np.sqrt(np.mean(residual**2))),
        worst_s=float(np.abs(residual).max()),
        method=method,
    )


_EVEN_STEP = 0.4  # of a period: no step differs by more, so every step is one count
_HEAD = 600  # stamps from which the period is chosen
_WHOLE_STEP = 0.2  # of a period: all steps that near to whole periods, so they are counted as such
_CHUNK, _MEMORY = 32, 96  # stamps counted at once; stamps behind that place the local clock
_AS_GOOD = 1.2  # scatter up to that much above the least: then fewer drops are believed
_NO_BEAT = 0.1  # least scatter, in periods, from which one drop cannot be told from jitter
_BLOCK, _BLOCKS = 24, 64  # stamps a block, and blocks, from which the period is read


def _missing(sequence: Ints) -> Ints:
    """The counts from the first to the last that no stamp has."""
    empty = np.ones(int(sequence[-1]) + 1, dtype=np.bool_)
    empty[sequence] = False
    return np.flatnonzero(empty).astype(np.int64)


def _sequence(stamps: Floats) -> Ints:
    """Counts with drops restored, by the period under which the stamps scatter least.

    Periods tried: the beat that most stamps share, and the mean step of the first stamps with up
    to 12 % of them dropped. A logger that pauses now and then and catches up has a beat faster
    than its clock; where plain counting scatters little more, nothing was dropped.
    """
    steps = np.diff(stamps)
    median = float(np.median(steps))
    if (np.abs(steps / median - 1) < _EVEN_STEP).all():
        return np.arange(stamps.size, dtype=np.int64)
    single = float(steps[steps < 1.5 * median].mean())
    whole = np.maximum(1, np.rint(steps / single)).astype(np.int64)
    if (np.abs(steps - whole * single) < _WHOLE_STEP * single).all():
        return np.concatenate([[0], np.cumsum(whole)])
    head = stamps[:_HEAD]
    mean = float(steps[:_HEAD].mean())
    trials = [_beat(head, median), *(mean * (1 - 0.003 * np.arange(40)))]
    found = [_refined(head, period) for period in trials]
    scatter = np.array([_scatter(sequence, head) for sequence in found])
    least, every = float(scatter.min()), np.arange(stamps.size, dtype=np.int64)
    if least > _NO_BEAT and _scatter(every[:_HEAD], head) < 2 * least:
        return every
    good = np.flatnonzero(scatter <= _AS_GOOD * least)
    best = found[min(good, key=lambda k: int(found[k][-1]))]
    counts = [_refined(stamps, _line(best, head)[1]), every]
    return min(counts, key=lambda sequence: _scatter(sequence, stamps))


def _refined(stamps: Floats, period: float) -> Ints:
    """Counts by a period, then by the period which those counts give."""
    return _counts(stamps, _line(_counts(stamps, period), stamps)[1])


def _scatter(sequence: Ints, stamps: Floats) -> float:
    """Distance of stamps from their line, median in periods: late ones must not decide."""
    intercept, period, _ = _line(sequence, stamps)
    return float(np.median(np.abs(stamps - intercept - period * sequence))) / period


def _beat(stamps: Floats, median: float) -> float:
    """The period that most stamps keep, s.

    Every trial period turns each block of stamps into unit vectors; their mean is long where the
    stamps keep that beat. Whole fractions of the period keep it too, so the longest is taken.
    """
    trials = median * np.arange(0.45, 1.25, 0.001)
    size = min(_BLOCK, stamps.size)
    starts = np.linspace(0, stamps.size - size, min(_BLOCKS, stamps.size // size)).astype(np.int64)
    since = stamps[starts[:, None] + np.arange(size)] - stamps[starts, None]
    kept = np.abs(np.exp(2j * np.pi * since[..., None] / trials).mean(axis=1)) ** 2
    worth = kept.mean(axis=0)
    good = np.flatnonzero(worth > 0.8 * worth.max())
    first = good[np.flatnonzero(np.diff(good, prepend=-9) > 1)[-1]]
    longest = good[good >= first]
    return float(trials[longest[int(np.argmax(worth[longest]))]])


def _counts(stamps: Floats, period: float) -> Ints:
    """The count of each stamp on its own clock, (N,), from 0, drops restored.

    Chunk by chunk against a clock placed by the stamps before, so that a rate which drifts is
    followed. Within a chunk the lateness in periods may only grow, by whole periods (a drop never
    comes back): the nearest such staircase is the rounded isotonic regression. A stamp counts
    with the earliest of itself and the next three: what comes late is soon made up for.
    """
    n = stamps.size
    counts = np.zeros(n, dtype=np.int64)
    start, beat = _first_clock(stamps[:_MEMORY], period)
    for low in range(0, n, _CHUNK):
        ahead = slice(low, min(n, low + 2 * _CHUNK))  # the next chunk tells late from dropped
        expected = np.arange(ahead.stop - low) + (counts[low - 1] + 1 if low else 0)
        late = (stamps[ahead] - start) / beat - expected
        dropped = np.rint(_rising(_earliest(late))).astype(np.int64)
        dropped = np.maximum(0, dropped) if low else dropped - dropped[0]
        high = min(n, low + _CHUNK)
        counts[low:high] = (expected + dropped)[: high - low]
        behind = slice(max(0, high - _MEMORY), high)
        start, beat = _local_clock(counts[behind], stamps[behind], period)
    return np.asarray(counts - counts[0])


def _earliest(late: Floats) -> Floats:
    """The least of each lateness and the next three."""
    ahead = np.concatenate([late, np.full(3, np.inf)])
    return np.asarray(np.lib.stride_tricks.sliding_window_view(ahead, 4).min(axis=1))


def _rising(values: Floats) -> Floats:
    from scipy.optimize import isotonic_regression

    return np.asarray(isotonic_regression(values).x)


def _first_clock(stamps: Floats, period: float) -> tuple[float, float]:
    """Time of count 0 and period, from the phase that most of the first stamps share."""
    late = _rising(_earliest((stamps - stamps[0]) / period - np.arange(stamps.size)))
    phase = float(np.angle(np.mean(np.exp(2j * np.pi * late)))) / (2 * np.pi)
    return float(stamps[0] + phase * period), period


def _local_clock(counts: Ints, stamps: Floats, period: float) -> tuple[float, float]:
    """Time of count 0 and period of the line through the last stamps, late ones counting less."""
    beat = period
    if counts.size >= _MEMORY // 2:
        beat = float(np.clip(_line(counts, stamps)[1], 0.995 * period, 1.005 * period))
    return float(np.median(_earliest(stamps - beat * counts))), beat


def _line(sequence: Ints, stamps: Floats) -> tuple[float, float, float]:
    """Least-squares intercept, slope and the slope's sigma of stamps over sequence."""
    n = sequence - sequence.mean()
    spread = float(np.sum(n**2))
    slope = float(np.sum(n * (stamps - stamps.mean())) / spread)
    intercept = float(stamps.mean() - slope * sequence.mean())
    residual = stamps - intercept - slope * sequence
    freedom = max(1, stamps.size - 2)
    return intercept, slope, float(np.sqrt(np.sum(residual**2) / freedom / spread))


def _resolution(stamps: Floats) -> float:
    """The decimal place to which stamps were rounded, s; 0 where none coarser than 1 us shows."""
    since = stamps - stamps[0]
    for place in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        if (np.abs(since / place - np.rint(since / place)) < 1e-2).all():
            return place
    return 0.0


def _varies(residual: Floats, period: float) -> bool:
    """True where stamps leave the line by more than a third of a period in a slow wave.

    Scatter changes sign from stamp to stamp (its successive differences are as large as itself);
    a varying rate moves slowly: the differences are much smaller than the residual.
    """
    rms = float(np.sqrt(np.mean(residual**2)))
    if residual.size < 5 or rms < period / 50:
        return False
    roughness = float(np.sqrt(np.mean(np.diff(residual) ** 2))) / (np.sqrt(2.0) * rms)
    return bool(roughness < 0.4)
