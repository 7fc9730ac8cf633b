"""Numbers and states as a technician reads them: a frequency never without its status."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from olivevib.values import combined, with_sigma

GLYPHS = {
    "done": "●",
    "stale": "◐",
    "missing": "○",
    "failed": "✗",
    "blocked": "□",
    "skipped": "–",
    "running": "▶",
}
DECIDED = ("direct", "confirmed", "supported")
CANDIDATES_SHOWN = 5


def number(value: float | None, digits: int, unit: str = "") -> str:
    """The number with its unit, or "not known"."""
    if value is None or not math.isfinite(value):
        return "not known"
    return f"{value:.{digits}f}{' ' * bool(unit)}{unit}"


def with_spread(
    value: float | None, sigma: float | None, digits: int, scale: float = 1.0, unit: str = ""
) -> str:
    """The value ± sigma, no more digits than that allows; ``digits`` decimals without a sigma.

    Both are multiplied by ``scale`` first, into ``unit``; – for a value that is not known.
    """
    if value is None or not math.isfinite(value):
        return "–"
    spread = None if sigma is None else scale * sigma
    return f"{with_sigma(scale * value, spread, digits)}{' ' * bool(unit)}{unit}"


def alone(value: float, sigma: float | None, digits: int) -> str:
    """The value with no more digits than its sigma allows, where there is no room for ±."""
    return with_sigma(value, sigma, digits).split(" ± ")[0]


def frequency(
    f_hz: float | None, sigma_hz: float | None, status: str | None, candidates_hz: Sequence[float]
) -> str:
    """The frequency with its status; the candidates where it is not decided."""
    if status is None:
        return "not analysed"
    if status in DECIDED and f_hz is not None and math.isfinite(f_hz):
        return f"{with_sigma(f_hz, sigma_hz, 4)} Hz, {status}"
    if not candidates_hz:
        return status
    shown = ", ".join(f"{f:.2f}" for f in candidates_hz[:CANDIDATES_SHOWN])
    more = ", …" if len(candidates_hz) > CANDIDATES_SHOWN else ""
    return f"{status}: {shown}{more} Hz"


def marker_frequency(marker: Mapping[str, Any]) -> str:
    """The frequency of a marker of the summary, ± of the fit and of the camera's own clock."""
    return frequency(
        marker["frequency_hz"],
        combined(marker["frequency_sigma_hz"], marker["frequency_clock_sigma_hz"]),
        marker["frequency_status"],
        marker["frequency_candidates_hz"],
    )


def seconds_left(left_s: float) -> str:
    """Time left as a person says it."""
    if left_s < 90:
        return f"{left_s:.0f} s left"
    return f"{left_s / 60:.0f} min left" if left_s < 5400 else f"{left_s / 3600:.1f} h left"
