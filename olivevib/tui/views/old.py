"""Numbers that an input or a setting has overtaken: since when they are old, in words."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from olivevib.tui.faults import BY_ANOTHER
from olivevib.tui.harmless import harmless
from olivevib.tui.views.words import GLYPHS

OLD = GLYPHS["stale"]
_CHANGED = re.compile(r"(?:the setting )?(.+) changed")


def old_words(summary: Mapping[str, Any], *names: str) -> str:
    """What has happened since the results of these stages were made; "" where they are of now.

    Only for stages of which there is a result to show.
    """
    stages = summary["stages"]
    name = next((n for n in names if stages[n]["state"] != "done"), "")
    if not name:
        return ""
    while (before := BY_ANOTHER.fullmatch(stages[name]["reason"])) and before[1] in stages:
        name = before[1]
    state, reason = stages[name]["state"], harmless(stages[name]["reason"], 120)
    changed = _CHANGED.fullmatch(reason)
    if state == "stale":
        return f"from before the change of {changed[1]}" if changed else f"out of date: {reason}"
    return f"from before: {name} is {state} now, {reason}"
