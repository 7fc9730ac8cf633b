"""Values at the sensor's limit: 16-bit rails, full scales, piled-up extremes; stuck axes."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Bools, Floats

_RAILS = (32767.0, -32768.0)


def clipped(values: Floats) -> int:
    """How many values of one axis (N,), in the file's unit, stand at a limit.

    A 16-bit rail of whole numbers counts always; another extreme only where at least five values
    stand exactly on it, five times as many as in each of the next 2 % of the range (a sine has
    fewer on its very top than just below).
    """
    low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))  # NaN left out
    if values.size < 3 or not low < high:
        return 0
    head = values[:1000][np.isfinite(values[:1000])]
    if (head == np.rint(head)).all():
        rails = sum(int((values == rail).sum()) for rail in _RAILS if rail in (low, high))
        if rails:
            return rails
    return _piled(values, high) + _piled(-values, -low)


def _piled(values: Floats, top: float) -> int:
    at_top = int(np.count_nonzero(values == top))
    if at_top < 5:
        return 0
    good = values[np.isfinite(values)]
    middle = float(np.median(good))
    upper = good[good > middle]
    if np.unique(upper).size < 10:  # a quiet, coarse signal: its levels are few and say nothing
        return 0
    near = int(((upper < top) & (upper > top - 0.1 * (top - middle))).sum())
    return at_top if at_top >= near else 0  # near / 5 bins of 2 %, times five


def stuck(values: Floats) -> bool:
    """True where an axis (N,) never changes."""
    good = values[np.isfinite(values)] if (values[:100] == values[:1]).all() else values[:2]
    return bool(good.size > 10 and good.max() == good.min())


def repeats(values: Floats) -> Bools:
    """(N,) True where a row (N, C) equals the row before in every value."""
    same = np.ones(len(values), np.bool_)
    same[:1] = False
    for column in values.T:
        same[1:] &= column[1:] == column[:-1]
    return same
