"""Values at the sensor's limit: 16-bit rails, full scales, piled-up extremes; stuck axes."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Bools, Floats

_RAILS = (32767.0, -32768.0)


def clipped(values: Floats) -> int:
    """How many values of one axis (N,), in the file's unit, stand at a limit.

    A 16-bit rail of whole numbers counts always; another extreme only where at least five values
    stand exactly on it, five times as many as on each of the next levels (a clean sine has up
    to 2.5 times as many on its top level).
    """
    good = values[np.isfinite(values)]
    if good.size < 3 or good.max() == good.min():
        return 0
    if (good[:1000] == np.rint(good[:1000])).all():
        rails = int(np.isin(good, _RAILS).sum())
        if rails:
            return rails
    return sum(_piled(side) for side in (good, -good))


def _piled(values: Floats) -> int:
    top = float(values.max())
    at_top = int((values == top).sum())
    if at_top < 5:
        return 0
    levels, counts = np.unique(values[values > np.median(values)], return_counts=True)
    if levels.size < 10:  # a quiet, coarse signal: its levels are few and say nothing
        return 0
    return at_top if at_top >= 5 * float(counts[-6:-1].mean()) else 0


def stuck(values: Floats) -> bool:
    """True where an axis (N,) never changes."""
    good = values[np.isfinite(values)]
    return bool(good.size > 10 and good.max() == good.min())


def repeats(values: Floats) -> Bools:
    """(N,) True where a row (N, C) equals the row before in every value."""
    same = (values[1:] == values[:-1]).all(axis=1)
    return np.asarray(np.concatenate([[False], same]))
