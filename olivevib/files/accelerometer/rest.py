"""Gravity as a witness: the vector at rest, whether it fits the unit, what unit it proposes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.signals import GRAVITY_M_S2

# Length of the rest vector in each unit; counts are the usual sensitivities a g.
_UNITS = (("m/s2", 9.80665), ("g", 1.0), ("mg", 1000.0), ("cm/s2", 980.665), ("mm/s2", 9806.65))
_MORE = (("ft/s2", 32.174), *_UNITS)
_COUNTS = (256.0, 512.0, 1024.0, 2048.0, 4096.0, 8192.0, 13107.0, 16384.0)


@dataclass(frozen=True)
class Rest:
    """vector (C,) in the file's unit; found: of stretches at rest, else the record's mean."""

    vector: Floats
    found: bool

    @property
    def magnitude(self) -> float:
        """Length of the rest vector, in the file's unit."""
        return float(np.linalg.norm(self.vector))


def find_rest(values: Floats, rate_hz: float) -> Rest:
    """The mean vector over the quietest quarter seconds; over all where nothing is quiet.

    values (N, C), NaN allowed. Quiet: spread below 5 % of the mean vector's length and near the
    smallest spread of the record.
    """
    size = max(8, round(0.25 * rate_hz))
    count = len(values) // size
    if count < 2:
        return Rest(_mean(values), False)
    blocks = [np.ascontiguousarray(c[: count * size]).reshape(count, size) for c in values.T]
    means = np.stack([block.sum(axis=1) for block in blocks], axis=1) / size
    squares = np.sum([np.einsum("bs,bs->b", block, block) for block in blocks], axis=0) / size
    good = np.isfinite(squares)  # a NaN cell spoils its block alone
    means, squares = means[good], squares[good]
    lengths = np.linalg.norm(means, axis=1)
    spreads = np.sqrt(np.maximum(squares - lengths**2, 0))
    if not spreads.size:
        return Rest(_mean(values), False)
    quiet = (spreads < 0.05 * lengths) & (spreads <= 2 * np.quantile(spreads, 0.05) + 1e-12)
    if not quiet.any():
        return Rest(_mean(values), False)
    return Rest(np.median(means[quiet], axis=0), True)


def _mean(values: Floats) -> Floats:
    sums = np.array([column.sum() for column in values.T])
    if np.isfinite(sums).all() and len(values):
        return np.asarray(sums / len(values))
    counts = np.isfinite(values).sum(axis=0)
    sums = np.nansum(values, axis=0)
    return np.asarray(np.where(counts > 0, sums / np.maximum(counts, 1), np.nan))


def proposals(magnitude: float) -> tuple[str, ...]:
    """The units in which a sensor at rest would read ``magnitude`` within 10 %."""
    return tuple(name for name, rest in _MORE if abs(magnitude / rest - 1) < 0.1)


def looks_like_counts(values: Floats, magnitude: float) -> bool:
    """Whole numbers within 16 bits whose rest vector is a usual sensitivity and no unit's 1 g."""
    good = values[np.isfinite(values)]
    whole = bool((good == np.rint(good)).all()) and float(np.abs(good).max(initial=0)) <= 32768
    usual = any(abs(magnitude / c - 1) < 0.1 for c in _COUNTS)
    return whole and usual and not proposals(magnitude)


def fits_gravity(magnitude_m_s2: float) -> bool:
    """True where a length in m/s2 is that of gravity within 15 %."""
    return abs(magnitude_m_s2 / GRAVITY_M_S2 - 1) < 0.15
