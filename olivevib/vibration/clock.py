"""What the sample times of a record allow: its rate, whether it is even, how many places it has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from olivevib.arrays import Floats
from olivevib.signals import Samples, fit_stamps

EVEN = 1e-6  # of a period: nearer to an even clock than this, a record counts as even

_AS_IT_STANDS = 1e-7  # periods off an even clock: rounding of the stamps
_REMEMBERED, _LONGEST = 64, 50_000  # clocks of records no longer than that many samples


@dataclass(frozen=True)
class Clock:
    """The even clock nearest to a record's times: rate, places (drops included), how even it is.

    worst_periods: the largest distance of a sample from that clock, in periods.
    """

    rate_hz: float
    places: int
    samples: int
    worst_periods: float

    @property
    def complete(self) -> bool:
        """No place on the clock is empty."""
        return self.places == self.samples

    @property
    def even(self) -> bool:
        """Complete and exactly even: the FFT applies as it stands."""
        return self.complete and self.worst_periods < EVEN

    @property
    def span_s(self) -> float:
        """Length of the record as a spectrum counts it: places times the period, s."""
        return self.places / self.rate_hz


def clock_of(t_s: Floats) -> Clock:
    """The clock of sample times t_s (N,), N >= 2."""
    period = float(t_s[-1] - t_s[0]) / max(1, t_s.size - 1)
    if period > 0:  # most records of a logger are even as they stand
        worst = float(np.abs(t_s - (t_s[0] + period * np.arange(t_s.size))).max())
        if worst < _AS_IT_STANDS * period:
            return Clock(1 / period, t_s.size, t_s.size, worst / period)
    if t_s.size > _LONGEST:
        return _fitted(t_s)
    return _remembered(np.ascontiguousarray(t_s, dtype=np.float64).tobytes())


@lru_cache(maxsize=_REMEMBERED)
def _remembered(times: bytes) -> Clock:
    """The fitted clock of the same times once: an analysis asks for it again and again."""
    return _fitted(np.frombuffer(times, dtype=np.float64))


def _fitted(t_s: Floats) -> Clock:
    fit = fit_stamps(t_s)
    return Clock(fit.rate_hz, int(fit.sequence[-1]) + 1, t_s.size, fit.worst_s * fit.rate_hz)


def measured(samples: Samples) -> tuple[Floats, Floats]:
    """Times (N,) and values (N, C) of the samples that were measured on every axis.

    The values lie axis by axis in memory: sums and transforms along the record are then fast.
    """
    values = np.asfortranarray(samples.values)
    good = np.isfinite(values)
    if good.all():
        return samples.t_s, values
    kept = good.all(axis=1)
    return samples.t_s[kept], np.asfortranarray(samples.values[kept])


def between(samples: Samples, start_s: float, end_s: float) -> Samples:
    """The samples with start_s <= t <= end_s."""
    first, last = (
        np.searchsorted(samples.t_s, start_s),
        np.searchsorted(samples.t_s, end_s, "right"),
    )
    inside = slice(int(first), int(last))
    return Samples(
        samples.t_s[inside], samples.values[inside], samples.quantity, samples.unit, samples.axes
    )
