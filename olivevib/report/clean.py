"""Text from files and people, made harmless for a page: no control, bidi or broken characters."""

from __future__ import annotations

import unicodedata

LONGEST = 300  # characters of one piece of metadata that a page shows
_KEPT_MARKS = 2  # combining marks in a row; more are a drawing, not a language
_DROPPED = {
    "Cc",
    "Cf",
    "Cs",
    "Co",
    "Cn",
}  # control, format (bidi, zero width), surrogate, unassigned


def clean(text: object, longest: int = LONGEST) -> str:
    """One line of printable text: control, escape and bidi characters gone, cut at ``longest``.

    Markup is left as it is: the template escapes it (autoescape), figures draw it as text.
    """
    raw = str(text)[: 20 * longest]
    out: list[str] = []
    marks = 0
    for char in raw:
        category = unicodedata.category(char)
        if char.isspace() or category in {"Zl", "Zp"}:
            out.append(" ")
        elif category not in _DROPPED:
            marks = marks + 1 if category in {"Mn", "Me"} else 0
            if marks <= _KEPT_MARKS:
                out.append(char)
    line = " ".join("".join(out).split())
    return line if len(line) <= longest else line[: longest - 1].rstrip() + "…"
