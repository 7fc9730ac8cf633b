"""Round numbers for axes and scale bars."""

from __future__ import annotations

import math

import numpy as np

from olivevib.arrays import Floats


def nice(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that does not exceed ``value`` (> 0)."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(m for m in (1.0, 2.0, 5.0) if m * power <= value * (1 + 1e-9))


def linear(low: float, high: float, most: int) -> Floats:
    """At most ``most`` round values from ``low`` to ``high``."""
    if not high > low or most < 1:
        return np.empty(0)
    power = 10.0 ** math.floor(math.log10((high - low) / most))
    step = next(m * power for m in (1, 2, 5, 10, 20) if (high - low) / (m * power) <= most)
    first = math.ceil(low / step - 1e-9)
    return np.asarray(np.arange(first, math.floor(high / step + 1e-9) + 1) * step)


def label(value: float) -> str:
    """A tick as short as it can be without an exponent."""
    return f"{value:.10g}"
