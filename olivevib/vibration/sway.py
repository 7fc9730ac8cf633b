"""Slow motion of the tree under the vibration: cosines that are taken out, not filtered."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaincc

from olivevib.arrays import Floats

_LARGEST = 10_000_000  # numbers in the column matrix; beyond, a record is long enough without


def sway_columns(t_s: Floats, limit_hz: float) -> Floats | None:
    """Orthonormal columns (N, S) spanning motion slower than limit_hz on the times t_s (N,).

    Cosines cos(pi j u), u from 0 to 1 over the record, j = 0 ... 2 T limit: they need no period
    and no even grid. None where the limit is 0, the record is too short to spare the columns
    (more than a third of its samples) or too long to need them.
    """
    span = float(t_s[-1] - t_s[0])
    count = int(np.floor(2 * span * limit_hz)) + 1
    if limit_hz <= 0 or 3 * count > t_s.size or count * t_s.size > _LARGEST:
        return None
    u = (t_s - t_s[0]) / span
    return np.asarray(np.linalg.qr(np.cos(np.pi * np.outer(u, np.arange(count))))[0])


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
