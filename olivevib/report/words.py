"""Numbers and keys as a person reads them: value, sigma, unit; "not known" rather than a blank."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from olivevib.report.clean import clean

NOT_KNOWN = "not known"
_GAP = "\u00a0"  # between a number and its unit, so that no line breaks there
_MINUS = "\u2212"
_UNITS = {
    "mm": "mm",
    "hz": "Hz",
    "s": "s",
    "kg": "kg",
    "deg": "°",
    "px": "px",
    "ppm": "ppm",
    "percent": "%",
    "us": "µs",
    "ms": "ms",
    "m_s2": "m/s²",
    "rad": "rad",
    "fps": "frames/s",
}


def known(value: Any) -> bool:
    """True for a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def decimals_of(sigma: float, digits: int = 2) -> int:
    """Decimals that show ``digits`` significant digits of ``sigma`` (may be negative)."""
    return digits - 1 - math.floor(math.log10(abs(sigma)))


def plain(value: float, decimals: int) -> str:
    """A number with a fixed count of decimals and a true minus sign."""
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", _MINUS)


def number(value: float, digits: int = 4) -> str:
    """A number with ``digits`` significant digits, never in exponent form above 1e-9."""
    if value == 0:
        return "0"
    return plain(value, max(0, decimals_of(value, digits)))


def unit_text(unit: str) -> str:
    """A unit as it is printed: m/s2 becomes m/s²."""
    return unit.replace("s2", "s²").replace("mm2", "mm²")


def measure(value: Any, unit: str = "", sigma: Any = None, digits: int = 4) -> str:
    """A value with sigma and unit: ``12.003 ± 0.002 Hz``; "not known" for null and NaN.

    Two significant digits of sigma decide the decimals; without a sigma ``digits`` are shown.
    """
    if not known(value):
        return NOT_KNOWN
    tail = (_GAP if unit and unit != "°" else "") + unit_text(unit)
    if not known(sigma) or sigma <= 0:
        return number(value, digits) + tail
    decimals = decimals_of(sigma)
    if sigma < 1e-9 * abs(value):  # far below what a file keeps: an exact value
        return f"{value:.6g}".replace("-", _MINUS) + tail
    both = f"{plain(value, decimals)} ± {plain(sigma, decimals)}".replace(" ", _GAP)
    return (f"({both})" if unit == "°" else both) + tail


def seconds(value: Any, sigma: Any = None) -> str:
    """A time in s, ms or µs, whichever reads best."""
    if not known(value):
        return NOT_KNOWN
    size = max(abs(value), sigma if known(sigma) else 0.0)
    unit, factor = ("s", 1.0) if size >= 1 else ("ms", 1e3) if size >= 1e-3 else ("µs", 1e6)
    if size == 0:
        unit, factor = "s", 1.0
    return measure(value * factor, unit, sigma * factor if known(sigma) else None)


def percent(fraction: Any, digits: int = 3) -> str:
    """A fraction in per cent."""
    if not known(fraction):
        return NOT_KNOWN
    if fraction == 1:
        return f"100{_GAP}%"
    return measure(100.0 * fraction, "%", digits=digits)


def triple(values: Iterable[Any], unit: str, digits: int = 2) -> str:
    """Three values of one unit on one scale: ``0.05 / 0.05 / 0.31 mm`` (x / y / z)."""
    listed = list(values)
    if not all(known(v) for v in listed):
        return NOT_KNOWN
    return " / ".join(number(v, digits) for v in listed) + _GAP + unit_text(unit)


def label(key: str) -> tuple[str, str]:
    """Words and unit of a settings key: ``trunk_diameter_mm`` → ("trunk diameter", "mm")."""
    for tail in sorted(_UNITS, key=len, reverse=True):
        if key.lower().endswith("_" + tail):
            return clean(key[: -len(tail) - 1].replace("_", " "), 60), _UNITS[tail]
    return clean(key.replace("_", " "), 60), ""


def fact(key: str, value: Any, digits: int = 6) -> tuple[str, str]:
    """A settings key and value as label and text with unit; tables inside as ``key value, …``."""
    words, unit = label(key)
    tail = _GAP + unit if unit else ""
    if value is None or value in ("", [], {}, ()):
        return words, NOT_KNOWN
    if isinstance(value, bool):
        return words, "yes" if value else "no"
    if known(value):
        return words, f"{value:.{digits}g}".replace("-", _MINUS) + tail
    if isinstance(value, Mapping):
        inner = (fact(str(k), v, digits) for k, v in value.items())
        return words, clean(", ".join(f"{name} {text}" for name, text in inner))
    if isinstance(value, list | tuple):
        nested = any(isinstance(v, Mapping) for v in value)
        parts = [fact("", v, digits)[1] for v in value]
        return words, clean(("; " if nested else ", ").join(parts)) + tail
    return words, clean(value)


def count(n: int, word: str) -> str:
    """``1 marker``, ``2 markers``."""
    return f"{n}{_GAP}{word}" + ("" if n == 1 else "s")
