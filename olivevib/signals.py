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

    stamps_s: (N,) seconds, increasing, N >= 2. A step that fits 2, 3, … periods is a drop of
    1, 2, … samples. Where stamps leave the line by a slow wave rather than by scatter (a variable
    frame rate) the stamps are kept as times. Source: knowledge of the field, timing model of
    CONVENTIONS.md (sampling time). Raises ValueError for fewer than two or for repeated stamps.
    """
    stamps = floats("stamps_s", stamps_s, (None,))
    steps = np.diff(stamps)
    if stamps.size < 2 or (steps <= 0).any():
        raise ValueError(f"need at least two increasing stamps, got {stamps.size}")
    period = _period(steps)
    counts = np.maximum(1, np.rint(steps / period)).astype(np.int64)
    sequence = np.concatenate([[0], np.cumsum(counts)])
    intercept, period, period_sigma = _line(sequence, stamps)
    residual = stamps - (intercept + period * sequence)
    method = "stamps" if _varies(residual, period) else "line"
    t_s = stamps if method == "stamps" else intercept + period * sequence
    dropped = np.setdiff1d(np.arange(sequence[-1] + 1), sequence)
    return StampFit(
        sequence=sequence,
        t_s=t_s,
        dropped=dropped if method == "line" else np.empty(0, np.int64),
        rate_hz=1.0 / period,
        rate_sigma_hz=period_sigma / period**2,
        jitter_s=float(np.sqrt(np.mean(residual**2))),
        worst_s=float(np.abs(residual).max()),
        method=method,
    )


def _period(steps: Floats) -> float:
    """The sampling period: mean of the steps that lie near the median (drops left out), s."""
    median = float(np.median(steps))
    near = steps[(steps > 0.5 * median) & (steps < 1.5 * median)]
    return float(near.mean())


def _line(sequence: Ints, stamps: Floats) -> tuple[float, float, float]:
    """Least-squares intercept, slope and the slope's sigma of stamps over sequence."""
    n = sequence - sequence.mean()
    spread = float(np.sum(n**2))
    slope = float(np.sum(n * (stamps - stamps.mean())) / spread)
    intercept = float(stamps.mean() - slope * sequence.mean())
    residual = stamps - intercept - slope * sequence
    freedom = max(1, stamps.size - 2)
    return intercept, slope, float(np.sqrt(np.sum(residual**2) / freedom / spread))


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
