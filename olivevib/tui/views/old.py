"""Numbers that an input or a setting has overtaken: since when they are old, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from olivevib.tui.harmless import harmless
from olivevib.tui.views.words import GLYPHS

OLD = GLYPHS["stale"]


def old_words(summary: Mapping[str, Any], *names: str) -> str:
    """Why the stored results of these stages are not of now, in the words of ``show``; else ""."""
    told = (summary["stages"][name]["old"] for name in names)
    return harmless(next((words for words in told if words), "").removeprefix("are "), 160)
