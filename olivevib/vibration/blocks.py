"""Dense records in blocks: the mean of a few samples, with the gain that costs given back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.vibration.sinefit import SineFit


def block_size(rate_hz: float, top_hz: float, samples: int) -> int:
    """How many samples may be averaged so that five block means fall into a cycle of top_hz.

    1 (no averaging) for records of fewer than some thousand samples, where it would gain nothing.
    """
    return max(1, int(rate_hz / (5 * top_hz))) if samples > _MANY else 1


_MANY = 4000


def block_means(t_s: Floats, values: Floats, block: int) -> tuple[Floats, Floats]:
    """Means of successive blocks of an even record: times (N // block,), values (N // block, C)."""
    n = t_s.size // block * block
    times = (t_s[0:n:block] + t_s[block - 1 : n : block]) / 2
    total = values[0:n:block].copy()
    for k in range(1, block):
        total += values[k:n:block]
    return times, total / block


def undone(fit: SineFit, block: int, rate_hz: float) -> SineFit:
    """The fit as it would be without the averaging: waves by the gain of a mean, noise by its root.

    Gain of the mean of m samples at f: sin(pi f m/rate) / (m sin(pi f/rate)), exact.
    """
    turn = np.pi * fit.wave_f_hz() / rate_hz
    gain = (np.sin(turn * block) / (block * np.sin(turn)))[:, None]
    return replace(
        fit,
        cosine=fit.cosine / gain,
        sine=fit.sine / gain,
        amplitude_sigma=fit.amplitude_sigma / np.abs(gain),
        noise=fit.noise * np.sqrt(block),
    )
