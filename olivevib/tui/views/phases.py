"""The phases of a trial as they are typed: ``rest 0-1.5, steady 3-9.5``."""

from __future__ import annotations

from collections.abc import Iterable

from olivevib.errors import UsageError
from olivevib.vibration import Phase

Row = tuple[str, float, float]
HINT = "rest 0-1.5, start-up 1.5-3, steady 3-9.5, shut-down 9.5-10, decay 10-12; empty: found again"


def typed_phases(phases: Iterable[Phase]) -> str:
    """The phases as they would be typed."""
    return ", ".join(f"{p.name} {p.start_s:.2f}-{p.end_s:.2f}" for p in phases)


def phases_of(text: str) -> list[Row]:
    """The phases that were typed; empty for nothing. UsageError for what cannot be read."""
    out: list[Row] = []
    for part in filter(None, (p.strip() for p in text.split(","))):
        name, _, limits = part.rpartition(" ")
        start, _, end = limits.partition("-")
        try:
            phase = Phase(name.strip(), float(start), float(end))
        except ValueError as error:
            raise UsageError(f"{part!r} is no phase: {error}.", "", f"Write {HINT}.") from error
        out.append((phase.name, phase.start_s, phase.end_s))
    return out


def with_steady(phases: Iterable[Phase], start_s: float, end_s: float) -> list[Row]:
    """The phases with the steady one where a person put it; the others give way."""
    out: list[Row] = [("steady", round(start_s, 3), round(end_s, 3))]
    for phase in phases:
        if phase.name in ("steady", "whole"):
            continue
        if phase.end_s <= start_s or phase.start_s >= end_s:
            out.append((phase.name, phase.start_s, phase.end_s))
        elif phase.start_s < start_s:
            out.append((phase.name, phase.start_s, round(start_s, 3)))
        elif phase.end_s > end_s:
            out.append((phase.name, round(end_s, 3), phase.end_s))
    return sorted(out, key=lambda row: row[1])
