"""Spectral lines in words: never a frequency without its status, never more than is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from olivevib.report.words import measure, plain
from olivevib.vibration import Line, LineStatus

MEANING: dict[LineStatus, str] = {
    LineStatus.DIRECT: "sampled more than twice as fast as the declared band, so no alias exists",
    LineStatus.CONFIRMED: "decided by the times at which the rows were read, and checked",
    LineStatus.SUPPORTED: "probably so; another frequency is not excluded",
    LineStatus.AMBIGUOUS: "two or more frequencies explain the pictures equally well",
    LineStatus.BLIND: "looks like slow sway at this frame rate; no amplitude is given",
    LineStatus.CHIRP: "the speed changes too fast to resolve a line",
    LineStatus.ALIASED: "peaks of samples only: each could be any of the candidates",
    LineStatus.NONE: "no line stands out of the noise",
}
KNOWN = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)
OPEN = (LineStatus.AMBIGUOUS, LineStatus.ALIASED)
MOST = 4  # candidates that are named one by one


def candidates_text(candidates_hz: Sequence[float], chance: Sequence[float] = ()) -> str:
    """``5.00 or 25.00 or 35.00 Hz``; long lists are cut with their count and their end.

    chance: how probable each is, where that can be said: ``5.00 (12 %) or 25.00 (88 %) Hz``.
    """
    listed = [plain(f, 2) for f in candidates_hz[:MOST]]
    if len(chance) == len(candidates_hz):
        pairs = zip(listed, chance, strict=False)
        listed = [f"{text} ({100 * p:.2g}\u00a0%)" for text, p in pairs]
    more = len(candidates_hz) - len(listed)
    if more:
        listed.append(f"{more} more up to {plain(candidates_hz[-1], 2)}")
    return " or ".join(listed) + "\u00a0Hz"


def folded_hz(f_hz: float, half_rate_hz: float) -> float:
    """Where a line of frequency f_hz shows up below half the sampling rate, Hz; NaN: not known."""
    rate = 2 * half_rate_hz
    return float(abs(f_hz - rate * np.round(f_hz / rate)))


def describe(line: Line) -> str:
    """A line in a few words: ``12.003 ± 0.002 Hz (direct)``, or what stands against one.

    ±: of the fit and of the camera's own clock together.
    """
    if line.status is LineStatus.NONE:
        return MEANING[line.status]
    if line.status is LineStatus.BLIND:
        return "blind: looks like sway at this frame rate"
    if line.status is LineStatus.CHIRP:
        return "chirp: the speed changes too fast"
    if line.status in OPEN:
        return f"{line.status}: {candidates_text(line.candidates_hz or (line.f_hz,))}"
    if not np.isfinite(line.f_hz):
        return str(line.status)
    return f"{measure(line.f_hz, 'Hz', line.f_total_sigma_hz)} ({line.status})"
