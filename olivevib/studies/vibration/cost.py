"""The time of all figures of an accelerometer record, in windowed FFTs of that record."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np
from scipy import fft

from olivevib.progress import Tick
from olivevib.studies.study import Effort, Goal, Table
from olivevib.studies.vibration.measures import Part
from olivevib.studies.vibration.records import acceleration
from olivevib.vibration import analyse_sensor

RATE_HZ, SECONDS = 2000.0, 60.0
_ASKED = 12.0


def cost(effort: Effort, tick: Tick) -> Part:
    """60 s of three axes at 2 kHz: phases, line, spectra, figures of all three quantities."""
    n = round(RATE_HZ * SECONDS * min(1.0, max(effort.share, 0.1)))
    rng = effort.draws(11)
    t = np.arange(n) / RATE_HZ
    a = 99 * np.cos(2 * np.pi * 25 * t[:, None] + np.arange(3)) + rng.normal(size=(n, 3))
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    samples = acceleration(t, a)
    units, whole = [], []
    for k in range(7):
        tick(k, 7, "time of all figures")
        units.append(_clock(lambda: fft.rfft(a * hann[:, None], axis=0)))
        whole.append(_clock(lambda: analyse_sensor(samples, (5.0, 100.0))))
    ratio = min(whole) / min(units)
    reached = bool(ratio <= _ASKED) if effort.share >= 1 else None
    row = (n, 1e3 * min(units), 1e3 * min(whole), ratio)
    columns = ("samples", "windowed FFT ms", "all figures ms", "ratio")
    goal = Goal(
        "all figures of 60 s, 3 axes, 2 kHz", "<= 12 windowed FFTs", f"{ratio:.1f}", reached
    )
    return Part(Table("Cost", columns, (row,)), (goal,))


def _clock(work: Callable[[], object]) -> float:
    start = process_time()
    work()
    return process_time() - start
