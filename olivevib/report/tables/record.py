"""The tables of what was typed and of where the results come from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.words import NOT_KNOWN, fact, percent

_MACHINERY = ("markers", "cameras", "accelerometers")
Pair = tuple[str, str]  # label, value with unit


def record_sections(content: ReportContent) -> list[tuple[str, list[Pair]]]:
    """The session record as it was typed: one card a section, keys as words, values with units."""
    out = []
    for name in ("session", "tree", "machine", "markers", "cameras", "accelerometers"):
        section = content.record.get(name)
        entries = section if isinstance(section, list | tuple) else [section]
        for number_of, entry in enumerate(entries):
            if isinstance(entry, Mapping):
                pairs = [fact(str(k), v) for k, v in _flat(entry)]
                if name in _MACHINERY:  # what nobody changed is no part of the record
                    pairs = [p for p in pairs if p[1] != NOT_KNOWN]
                title = name if len(entries) == 1 else f"{name} {number_of + 1}"
                if pairs:
                    out.append((title, pairs))
    return out


def outcome_pairs(content: ReportContent) -> list[Pair]:
    """What the harvest gave, as it was entered by hand; () where nothing was."""
    typed = content.record.get("outcome") or {}
    removed, left = typed.get("removed_kg"), typed.get("left_kg")
    if removed is None and left is None and not typed.get("damage"):
        return []
    share: float | None = None
    if removed is not None and left is not None and removed + left > 0:
        share = removed / (removed + left)
    return [
        ("fruit removed", fact("removed_kg", removed)[1]),
        ("fruit left", fact("left_kg", left)[1]),
        ("share removed", percent(share)),
        ("damage", clean(typed.get("damage") or "") or NOT_KNOWN),
    ]


def _flat(section: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Keys and values, nested tables as ``outer inner``; per-marker tables are left to theirs."""
    out: list[tuple[str, Any]] = []
    for name, value in section.items():
        if isinstance(value, Mapping):
            if not any(str(k).isdigit() for k in value):
                out += [(f"{name} {k}", v) for k, v in value.items() if not isinstance(v, Mapping)]
        elif not (isinstance(value, list | tuple) and value and isinstance(value[0], Mapping)):
            out.append((str(name), value))
    return out


def provenance_pairs(content: ReportContent) -> list[Pair]:
    """Versions, settings and hashes; the command stands first and is left out here."""
    return [
        (clean(k.replace("_", " "), 80), clean(v, 160) if v not in (None, "") else NOT_KNOWN)
        for k, v in content.provenance.items()
        if k != "command"
    ]


def stage_rows(content: ReportContent) -> list[tuple[str, str, str]]:
    """Each stage with its state and, where there is one, the reason."""
    stages = content.summary.get("stages") or {}
    return [
        (clean(name, 40), clean(s.get("state") or NOT_KNOWN, 40), clean(s.get("reason") or ""))
        for name, s in stages.items()
    ]  # fmt: skip
