"""Text from files and people, made harmless for a terminal: nothing of it can steer or widen it."""

from __future__ import annotations

import unicodedata

from rich.cells import cell_len, set_cell_size
from rich.text import Text

LONGEST = 200  # cells of one piece of metadata on screen
REPLACEMENT = "\ufffd"
_MARKS = 2  # combining marks in a row; more are a drawing, not a language
_STEERING = {"Cc", "Cf", "Cs", "Co", "Cn"}  # control, format (bidi), surrogate, private, unassigned


def harmless(text: object, longest: int = LONGEST) -> str:
    """One line of printable text, at most ``longest`` cells wide.

    Control, escape, bidi and broken characters become a visible replacement, so that a reader sees
    that something stood there; markup is left as it is and must be shown as plain text.
    """
    raw = str(text)[: 4 * longest]
    out: list[str] = []
    marks = 0
    for char in raw:
        category = unicodedata.category(char)
        marks = marks + 1 if category in {"Mn", "Me"} else 0
        if char.isspace():
            out.append(" ")
        elif category in _STEERING:
            out.append(REPLACEMENT)
        elif marks <= _MARKS:
            out.append(char)
    return cut("".join(out).strip(), longest)


def cut(text: str, cells: int) -> str:
    """The text in at most ``cells`` cells, with … where something was cut off."""
    if cell_len(text) <= cells:
        return text
    return set_cell_size(text, max(0, cells - 1)).rstrip() + "…" if cells > 0 else ""


def plain(text: object, longest: int = LONGEST, style: str = "") -> Text:
    """Harmless text for a table cell or a label: never read as markup."""
    return Text(harmless(text, longest), style=style, no_wrap=True)
