"""Lines of a batch: each trial, what it is now, what the batch made of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from olivevib.tui.harmless import plain
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.tables import quality_cell

if TYPE_CHECKING:
    from olivevib.batch import TrialResult


@dataclass(frozen=True)
class BatchLine:
    """One trial; marked: the batch is about it; result: None until it has been measured."""

    name: str
    word: str
    marked: bool
    result: TrialResult | None = None


def batch_cells(line: BatchLine, palette: Palette) -> tuple[Text, ...]:
    """Mark, name, quality word, result, hash."""
    result = line.result
    if result is None:
        told = Text("–", palette.muted)
    elif result.failed:
        told = Text("failed", palette.bad)
    elif result.cautions:
        told = Text("done, with warnings", palette.warn)
    else:
        told = Text("done" if result.ran else "was up to date", palette.good)
    mark = Text("●" if line.marked else "○", palette.accent if line.marked else palette.muted)
    made = result.hash[:12] if result and not result.failed else ""
    return mark, plain(line.name, 34), quality_cell(line.word, palette), told, Text(made)


def failure_words(line: BatchLine) -> str:
    """Why a trial failed, what its warnings are, or that nothing is to be said."""
    result = line.result
    if result is None:
        return "r measures every marked trial; Space marks or takes out"
    if result.failed:
        return f"{result.what} {result.why} {result.remedy}"
    codes = ", ".join(dict.fromkeys(c.code for c in result.cautions))
    return f"warnings: {codes}" if codes else f"measured in {result.seconds:.1f} s, no warnings"
