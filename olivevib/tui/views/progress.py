"""The line that long work shows: what, how far, how fast, how long still, how to stop it."""

from __future__ import annotations

from dataclasses import dataclass

from rich.cells import cell_len

from olivevib.tui.harmless import cut, harmless
from olivevib.tui.views.words import seconds_left

BAR, WIDE = 20, 100
ESCAPE = "Esc cancels, work is kept"


@dataclass(frozen=True)
class Progress:
    """How far work has come. rate: steps a second; left_s: None where they cannot be told yet."""

    title: str
    note: str
    done: int
    total: int | None
    rate: float | None = None
    left_s: float | None = None


def progress_line(progress: Progress, columns: int, cancelling: bool = False) -> str:
    """One line of at most ``columns`` cells; the way to stop it is never cut off."""
    tail = "stopping at the next safe place" if cancelling else ESCAPE
    room = columns - cell_len(tail) - 3
    bar = _bar(progress, BAR if columns >= WIDE else BAR // 2)
    parts = (bar, _speed(progress), harmless(progress.note, 40), harmless(progress.title, 60))
    return f"{cut('  '.join(part for part in parts if part), room)} · {tail}"


def _bar(progress: Progress, length: int) -> str:
    if not progress.total:
        return f"{progress.done}" if progress.done else ""
    full = min(length, length * progress.done // progress.total)
    return f"{'█' * full}{'░' * (length - full)} {progress.done}/{progress.total}"


def _speed(progress: Progress) -> str:
    if progress.rate is None:
        return ""
    left = "" if progress.left_s is None else f", {seconds_left(progress.left_s)}"
    return f"{progress.rate:.0f}/s{left}"
