"""How numbers and words are written in text formats: enough digits, blanks for NaN, no formulas."""

from __future__ import annotations

import math
import re

from olivevib.arrays import Floats

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def fixed(values: Floats, decimals: int, blank: str = "") -> list[str]:
    """The values (N,) with ``decimals`` places; NaN becomes ``blank`` and -0.000 becomes 0.000."""
    form = f"%.{decimals}f"
    minus_zero = form % -0.0
    zero = form % 0.0
    texts = (blank if math.isnan(v) else form % v for v in values.tolist())
    return [zero if text == minus_zero else text for text in texts]


def spreadsheet_cell(text: str) -> str:
    """A word as a CSV cell that no spreadsheet takes for a formula.

    Text that begins with = + - @ gets a leading apostrophe unless it is a number; quotes and
    separators are quoted as in RFC 4180.
    """
    if text.startswith(_FORMULA) and not _NUMBER.fullmatch(text):
        text = "'" + text
    if any(c in text for c in ',;"\r\n\t'):
        return '"' + text.replace('"', '""') + '"'
    return text


def ascii_line(text: str, width: int = 1000) -> str:
    """``text`` as one line of printable ASCII, cut at ``width``; other characters become ?."""
    return "".join(c if " " <= c <= "~" else "?" for c in text)[:width]
