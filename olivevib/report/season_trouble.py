"""Which trials of a season are not measured to the end, and which are out of date."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from olivevib.report.clean import clean
from olivevib.report.words import count
from olivevib.values import listed

_WORDS = {"failed": "failed", "missing": "not run", "blocked": "blocked", "stale": "out of date"}


@dataclass(frozen=True)
class Trouble:
    """One trial to see to: its name, what of it, and why."""

    trial: str
    what: str
    why: str


def trouble(name: str, stages: Mapping[str, Any]) -> Trouble | None:
    """The first thing that is wrong with a trial, by its stages; None: all that can be is done.

    stages: of its summary, {state, reason} by name. What is blocked only says what failed before
    it, so a failure comes first, then what has not run, then what is out of date.
    """
    for state, words in _WORDS.items():
        names = [n for n, told in stages.items() if (told or {}).get("state") == state]
        if names:
            why = clean((stages[names[0]] or {}).get("reason") or "", 300)
            return Trouble(clean(name, 60), f"{listed(names)} {words}", why)
    return None


def problems(found: Trouble | None, warnings: int) -> str:
    """A cell of the season's table: what failed is never hidden behind a count of warnings."""
    told = count(warnings, "warning")
    return f"{found.what}; {told}" if found else told


def trouble_words(found: Iterable[Trouble], total: int) -> str:
    """The sentence over the table; empty where every trial is measured and up to date."""
    troubled = list(found)
    if not troubled:
        return ""
    names = "; ".join(f"{t.trial}: {t.what}" for t in troubled)
    return f"Mind this first: {len(troubled)} of {count(total, 'trial')} not up to date ({names})."
