"""From stamps as logged to the sensor's clock: rate with sigma, gaps, duplicates, true times."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.errors import InputError
from olivevib.files.accelerometer.record import Clock, Gap

_WRAPS_S = tuple(2.0**bits * unit for bits in (32, 16) for unit in (1e-3, 1e-6))
_RATE_HZ = (0.5, 2e6)


@dataclass(frozen=True)
class Timing:
    """keep (N,) the rows that stay; t_s the times of these, increasing; clock what was found."""

    keep: Bools
    t_s: Floats
    clock: Clock


def even_timing(n: int, rate_hz: float, t0_s: float = 0.0, start: datetime | None = None) -> Timing:
    """The times of ``n`` rows without stamps, at a rate that was declared or stands in the file."""
    _check_rate(rate_hz, "the file")
    t_s = t0_s + np.arange(n) / rate_hz
    return Timing(np.ones(n, np.bool_), t_s, Clock(rate_hz, float("nan"), "rate", start=start))


def stamp_timing(
    stamps_s: Floats, same: Callable[[], Bools], start: datetime | None, source: str
) -> Timing:
    """Times from stamps: turned-over counters mended, bad rows out, then the line or the stamps.

    same() (N,): the row repeats all values of the row before; asked only where stamps repeat. A
    repeated stamp with repeated values is a repeated row and goes; repeated stamps with new values
    come of coarse stamps and are spread up to the next stamp. Stamps that scatter about an even
    clock give the line's times; stamps that wander give themselves (knowledge of the field:
    vibration analysis 4.1). InputError where the clock starts anew within the file.
    """
    if (np.diff(stamps_s) > 0).all() and stamps_s.size > 1:  # as most files are (NaN fails, too)
        t_s, clock = _fit(stamps_s, start, source, _quantum(stamps_s))
        return Timing(np.ones(t_s.size, np.bool_), t_s, clock)
    stamps = _unwrapped(stamps_s)
    keep = np.isfinite(stamps)
    backward = _backward_rows(stamps, keep, source)
    keep &= ~backward
    repeated = np.zeros(keep.size, np.bool_)
    rows = np.flatnonzero(keep)
    tied = np.concatenate([[False], np.diff(stamps[rows]) == 0])
    if tied.any():
        repeated[rows[tied]] = same()[rows[tied]] & (np.diff(rows, prepend=-1)[tied] == 1)
    keep &= ~repeated
    t_s = _spread_ties(stamps[keep])
    if t_s.size < 2 or t_s[-1] <= t_s[0]:
        raise InputError(
            f"{source} holds {t_s.size} samples with times of their own.",
            "At least two are needed.",
            "Choose the whole recording, or give rate_hz.",
        )
    t_s, clock = _fit(t_s, start, source, _quantum(stamps[keep]))
    counts = {"duplicates": int(tied.sum()), "backward": int(backward.sum())}
    fields = {**clock.__dict__, **counts, "dropped_rows": int((~keep).sum())}
    return Timing(keep, t_s, Clock(**fields))


def _unwrapped(stamps: Floats) -> Floats:
    """Stamps with 16 and 32 bit counters of ms and µs, and midnights, carried on."""
    good = np.flatnonzero(np.isfinite(stamps))
    steps = np.diff(stamps[good])
    if not (steps < 0).any():
        return stamps
    out = stamps.copy()
    usual = float(np.median(np.abs(steps)))
    for at in np.flatnonzero(steps < 0):
        for wrap in (*_WRAPS_S, 86400.0):
            if 0 <= steps[at] + wrap < max(20 * usual, wrap / 1000) and wrap > 10 * usual:
                out[good[at + 1] :] += wrap
                break
    return out


def _backward_rows(stamps: Floats, good: Bools, source: str) -> Bools:
    """The fewest rows whose removal leaves stamps that never fall (longest rising sequence)."""
    rows = np.flatnonzero(good)
    values = stamps[rows]
    out = np.zeros(stamps.size, np.bool_)
    if values.size < 2 or (np.diff(values) >= 0).all():
        return out
    stays = _longest_rise(values)
    out[rows[~stays]] = True
    lost = int((~stays).sum())
    if lost > max(3, 0.02 * values.size):
        at = int(rows[int(np.flatnonzero(np.diff(values) < 0)[0]) + 1])
        raise InputError(
            f"{source}: the clock runs backward at row {at + 1} and {lost} rows do not fit.",
            "Two recordings in one file, or stamps that are no times.",
            "Split the file at that row, name the time column, or give rate_hz to go by rows.",
        )
    return out


def _longest_rise(values: Floats) -> Bools:
    """The longest non-falling subsequence (patience sorting, N log N)."""
    tops: list[float] = []
    at: list[int] = []
    before = np.full(values.size, -1, dtype=np.int64)
    for k, value in enumerate(values.tolist()):
        pile = bisect_right(tops, value)
        if pile == len(tops):
            tops.append(value)
            at.append(k)
        else:
            tops[pile], at[pile] = value, k
        before[k] = at[pile - 1] if pile else -1
    stays = np.zeros(values.size, np.bool_)
    k = at[-1]
    while k >= 0:
        stays[k] = True
        k = int(before[k])
    return stays


def _spread_ties(stamps: Floats) -> Floats:
    """Equal stamps spread evenly up to the next one; the last group as wide as the one before."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(stamps) > 0]))
    counts = np.diff(np.append(starts, stamps.size))
    if (counts == 1).all() or starts.size < 2:
        return stamps
    widths = np.diff(stamps[starts])
    per_row = float(widths.sum()) / float(counts[:-1].sum())
    widths = np.append(widths, per_row * counts[-1])
    place = np.arange(stamps.size) - np.repeat(starts, counts)
    # A tie before a gap is not spread into the gap.
    step = np.minimum(widths / counts, 1.5 * per_row)
    return np.asarray(stamps + place * np.repeat(step, counts))


def _fit(
    stamps: Floats, start: datetime | None, source: str, quantum_s: float
) -> tuple[Floats, Clock]:
    steps = np.diff(stamps)
    holes = _gap_steps(steps, quantum_s)
    sequence = _sequence(stamps, holes)
    intercept, period = _line(sequence, stamps)
    _check_rate(1 / period, source)
    line_s = np.asarray(intercept + period * sequence)
    residual = stamps - line_s
    scatter = math.sqrt(float(residual @ residual) / residual.size)
    roughness = _roughness(residual, scatter)
    slow = scatter > max(1e-3 * period, 0.6 * quantum_s) and roughness < 0.4
    wanders = slow and stamps.size > 10
    sigma = _period_sigma(sequence, scatter, roughness)
    if wanders:
        period, sigma = _middle_period(stamps)
    clock = Clock(
        rate_hz=1 / period,
        rate_sigma_hz=sigma / period**2,
        method="stamps" if wanders else "line",
        jitter_s=scatter,
        worst_s=float(np.abs(residual).max()),
        gaps=tuple(Gap(float(stamps[k]), float(steps[k])) for k in holes),
        start=start,
    )
    return (stamps if wanders else line_s), clock


def _gap_steps(steps: Floats, quantum_s: float) -> Ints:
    """The steps that are holes.

    Of a steady, finely stamped clock those of two periods and more; of a jittery one those far
    beyond its 99 %; of coarse stamps (whole ms at 1 kHz) those that rounding cannot explain.
    """
    if steps.max() < 1.5 * steps.min():
        return np.empty(0, np.int64)
    usual = float(steps[steps <= np.quantile(steps, 0.99)].mean())
    quantum = quantum_s / usual
    ratio = steps / usual
    if quantum < 0.2:
        ratio = steps / float(np.median(steps))
        off_grid = ratio - np.rint(ratio)
        if float(np.sqrt(np.mean(off_grid**2))) < 0.1:
            return np.flatnonzero(np.rint(ratio) > 1)
    jitter = float(np.quantile(ratio, 0.99)) - 1
    return np.flatnonzero(ratio > max(1.6, 1 + 1.5 * quantum, 1 + 3 * jitter))


def _quantum(stamps: Floats) -> float:
    """The decimal step in which stamps were written, s; 0 where they are finer than 1 ns."""
    some = stamps[: min(stamps.size, 2000)]
    for quantum in 10.0 ** -np.arange(0, 10):
        ticks = (some - some[0]) / quantum
        if float(np.abs(ticks - np.rint(ticks)).max()) < 1e-3:
            return float(quantum)
    return 0.0


def _sequence(stamps: Floats, holes: Ints) -> Ints:
    """The count of each sample with lost ones restored, where that makes the line fit better.

    What a hole has lost is the shift of the stamps across it, judged by up to 30 samples on each
    side, so that a logger that only came late and caught up has lost nothing.
    """
    plain = np.arange(stamps.size)
    if not holes.size:
        return plain
    steps = np.diff(stamps)
    period = (
        float(np.delete(steps, holes).mean()) if holes.size < steps.size else float(steps.min())
    )
    lost = np.zeros(stamps.size, dtype=np.int64)
    edges = np.concatenate([[0], holes + 1, [stamps.size]])
    level = stamps - period * plain
    for before, at, after in zip(edges[:-2], edges[1:-1], edges[2:], strict=True):
        low = level[max(before, at - 30) : at]
        high = level[at : min(after, at + 30)]
        shift = float(np.median(high) - np.median(low))
        lost[at] = max(0, round(shift / period))
    restored = plain + np.cumsum(lost)
    return min((plain, restored), key=lambda s: _scatter(s, stamps))


def _scatter(sequence: Ints, stamps: Floats) -> float:
    intercept, period = _line(sequence, stamps)
    return float(np.std(stamps - intercept - period * sequence))


def _line(sequence: Ints, stamps: Floats) -> tuple[float, float]:
    middle = float(sequence.mean())
    n = sequence - middle
    slope = float(n @ (stamps - stamps.mean())) / float(n @ n)
    return float(stamps.mean()) - slope * middle, slope


def _roughness(residual: Floats, scatter: float) -> float:
    """1 for white scatter, towards 0 for a slow wave: rms step over sqrt(2) rms."""
    if scatter == 0 or residual.size < 3:
        return 1.0
    steps = np.diff(residual)
    return math.sqrt(float(steps @ steps) / steps.size) / (math.sqrt(2.0) * scatter)


def _middle_period(stamps: Floats) -> tuple[float, float]:
    """Period of a clock that wanders: median over pairs a quarter of the record apart, and spread.

    A start-up of the logger, a few gaps and what it does to catch up move it little.
    """
    apart = max(1, stamps.size // 4)
    slopes = (stamps[apart:] - stamps[:-apart]) / apart
    middle = float(np.median(slopes))
    return middle, 1.4826 * float(np.median(np.abs(slopes - middle)))


def _period_sigma(sequence: Ints, scatter: float, roughness: float) -> float:
    """Sigma of the line's slope, with fewer independent samples where the residual is a wave."""
    correlation = min(max(1 - roughness**2, 0.0), 0.9999)
    independent: float = max(2.0, sequence.size * (1 - correlation) / (1 + correlation))
    spread = float(sequence[-1] - sequence[0] + 1) / math.sqrt(12.0)
    return float(scatter / (spread * math.sqrt(independent)))


def _check_rate(rate_hz: float, source: str) -> None:
    if _RATE_HZ[0] <= rate_hz <= _RATE_HZ[1]:
        return
    raise InputError(
        f"{source}: a sampling rate of {rate_hz:.4g} Hz is not possible for vibration.",
        "The stamps are in another unit, or they are no times.",
        "Give time_unit or time_column, or rate_hz.",
    )
