"""What a setup is good for over its whole band: the words of the outlooks, as ranges."""

from __future__ import annotations

import math

from olivevib.planning.outlook import least_amplitude_mm, outlook, why_alike
from olivevib.planning.setup import Setup
from olivevib.planning.zones import BAND_HZ

STEP_HZ = 0.1
GOOD = ("direct", "confirmable")
POOR = ("ambiguous", "blind")

Ranges = dict[str, list[tuple[float, float]]]


def reach(setup: Setup, amplitude_mm: float = 3.0) -> Ranges:
    """The ranges (low, high), Hz, of the band in which ``outlook`` gives each status.

    The band is looked at in steps of 0.1 Hz; where none is declared it is that of ``outlook``.
    """
    low, high = setup.band_hz or BAND_HZ
    steps = round((high - low) / STEP_HZ)
    found: Ranges = {}
    before = ""
    for k in range(steps + 1):
        f_hz = round(low + k * STEP_HZ, 6)
        status = outlook(setup, f_hz, amplitude_mm).status
        ranges = found.setdefault(status, [])
        if status == before:
            ranges[-1] = (ranges[-1][0], f_hz)
        else:
            ranges.append((f_hz, f_hz))
        before = status
    return found


def reach_words(setup: Setup, amplitude_mm: float = 3.0) -> str:
    """One sentence: what the setup is good for, where it is not, why, and what would help."""
    found = reach(setup, amplitude_mm)
    low, high = setup.band_hz or BAND_HZ
    good = [
        f"{_ranges(found[status])} ({_how(setup, status)})" for status in GOOD if status in found
    ]
    poor = [f"{status} {_ranges(found[status])}" for status in POOR if status in found]
    words = f"good for {' and '.join(good) or f'no frequency of {low:g}–{high:g} Hz for sure'}"
    if poor:
        words += f"; {', '.join(poor)}"
    if not good:
        words += _remedy(setup, amplitude_mm)
    return words


def step_words(setup: Setup) -> str:
    """Whether the cameras look at the same moments, in words; "" where nobody knows."""
    share = setup.period_share
    if share is None:
        return ""
    apart = f"{1e3 * share / setup.fps:.1f} ms apart"
    return f"cameras in step ({apart})" if setup.in_step else f"cameras {apart}"


def _ranges(found: list[tuple[float, float]]) -> str:
    words = [f"{low:g}–{high:g}" if high > low else f"{low:g}" for low, high in found]
    return f"{', '.join(words)} Hz"


def _how(setup: Setup, status: str) -> str:
    least = least_amplitude_mm(setup)
    if status == "direct" or math.isinf(least):
        return status
    return (
        f"{status} from {least:.2f} mm peak with markers of {setup.marker_mm:g} mm at "
        f"{setup.distance_mm:g} mm"
    )


def _remedy(setup: Setup, amplitude_mm: float) -> str:
    least = least_amplitude_mm(setup)
    why = why_alike(setup) if math.isinf(least) else f"{amplitude_mm:g} mm are too little"
    low, half = (setup.band_hz or BAND_HZ)[0], setup.fps / 2
    below = f"; a band declared below {half:.4g} Hz would be direct" if half > low + 1 else ""
    return f" ({why}{below})"
