"""Slow motion of the tree under the vibration: fitted along and taken out, not filtered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.special import gammaincc

from olivevib.arrays import Floats

_LARGEST = 10_000_000  # numbers in the column matrix; beyond, a record is long enough without
_MOST = 1 / 3  # of the samples
_POWERS = 4  # of time, beside the cosines: they take the slopes at both ends


@dataclass(frozen=True)
class SwayBasis:
    """Functions of time that span motion slower than a limit over a record.

    Cosines cos(pi j u), u from 0 to 1 over the record, j = 0 ... 2 T limit, need no period and no
    even grid; powers of time up to the fourth spare them the slopes at the ends, which cosines
    do not have (a sway of 1 Hz in 10 s is left to 1e-4 instead of 13 % at its ends).
    """

    start_s: float
    span_s: float
    cosines: int

    @property
    def count(self) -> int:
        """Number of functions."""
        return self.cosines + _POWERS

    def at(self, t_s: Floats, derivative: int = 0) -> Floats:
        """The functions (N, S), or their derivative, at times t_s (N,)."""
        rates = np.pi * np.arange(self.cosines) / self.span_s
        turn = np.outer(t_s - self.start_s, rates) + derivative * np.pi / 2
        waves = np.cos(turn) * rates**derivative
        v = 2 * (t_s - self.start_s) / self.span_s - 1
        powers = []
        for k in range(1, _POWERS + 1):
            one = np.zeros(k + 1)
            one[k] = 1.0
            slope = legendre.legder(one, derivative) if derivative else one
            powers.append(legendre.legval(v, slope) * (2 / self.span_s) ** derivative)
        return np.asarray(np.hstack([waves, np.stack(powers, axis=1)]))


def sway_basis(t_s: Floats, limit_hz: float, most: float = _MOST) -> SwayBasis | None:
    """The basis of motion slower than limit_hz on the times t_s (N,).

    None where the limit is 0, the record is too short to spare the columns (more than the share
    ``most`` of its samples) or too long to need them.
    """
    span = float(t_s[-1] - t_s[0])
    basis = SwayBasis(float(t_s[0]), span, int(np.floor(2 * span * limit_hz)) + 1)
    if limit_hz <= 0 or basis.count > most * t_s.size or basis.count * t_s.size > _LARGEST:
        return None
    return basis


def sway_columns(t_s: Floats, limit_hz: float, most: float = _MOST) -> Floats | None:
    """Orthonormal columns (N, S) of that basis, the constant among them; None as there."""
    basis = sway_basis(t_s, limit_hz, most)
    return None if basis is None else np.asarray(np.linalg.qr(basis.at(t_s))[0])


def sways(columns: Floats, rest: Floats, noise: Floats, chance: float) -> bool:
    """True where what is left of a motion (N, C) holds more slow motion than noise (C,) explains.

    chance: probability of saying so of white noise.
    """
    slow = columns[:, 1:].T @ (rest - rest.mean(axis=0))
    if not slow.size:
        return False
    safe = np.where(noise > 0, noise, np.inf)
    chi2 = np.sum((slow / safe) ** 2, axis=0)
    least = float(gammaincc(slow.shape[0] / 2, chi2 / 2).min())
    return least * noise.size < chance
