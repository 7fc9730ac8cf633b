"""Sheets of markers at exact size, to print, cut out and glue to a tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from olivevib.errors import UsageError
from olivevib.files.prints.marker import marker_modules
from olivevib.files.prints.page import (
    Area,
    Label,
    Line,
    Page,
    cut_lines,
    fitted_height,
    outline,
    paper_size,
    ruler,
)
from olivevib.files.prints.words import in_words
from olivevib.marker import MarkerLibrary

MARGIN_MM = 10.0  # what printers leave white
FOOT_MM = 16.0  # ruler and its words
GAP_MM = 1.0  # from the quiet zone to the cut line
LABEL_MM = 6.5  # strip with the id below the quiet zone


@dataclass(frozen=True)
class _Cell:
    """Place of one marker: card = quiet zone and all, mm."""

    card_mm: float
    columns: int
    rows: int

    @property
    def width_mm(self) -> float:
        return self.card_mm + 2 * GAP_MM

    @property
    def height_mm(self) -> float:
        return self.card_mm + 2 * GAP_MM + LABEL_MM


def sheet_pages(
    library: MarkerLibrary, ids: Sequence[int], size_mm: float, paper: str = "A4"
) -> list[Page]:
    """Markers ``ids`` with an outer dark side of ``size_mm``, as many a page as fit.

    Below each marker, outside its quiet zone, its id in figures and words; dashed cut lines; a
    150 mm ruler on every page. Raises UsageError for a marker that does not fit the paper.
    """
    page_mm = paper_size(paper)
    cell = _cell(library, size_mm, page_mm, paper)
    per_page = cell.columns * cell.rows
    pages = []
    for first in range(0, len(ids), per_page):
        areas: list[Area] = []
        lines, labels = ruler((MARGIN_MM, page_mm[1] - MARGIN_MM - 4.0))
        for place, wanted in enumerate(ids[first : first + per_page]):
            row, column = divmod(place, cell.columns)
            x = MARGIN_MM + column * cell.width_mm
            y = MARGIN_MM + row * cell.height_mm
            drawn = _one(library, wanted, size_mm, (x, y), cell)
            areas.append(drawn[0])
            lines += drawn[1]
            labels += drawn[2]
        pages.append(Page(*page_mm, tuple(areas), tuple(dict.fromkeys(lines)), tuple(labels)))
    return pages


def _cell(
    library: MarkerLibrary, size_mm: float, page_mm: tuple[float, float], paper: str
) -> _Cell:
    layout = library.layout
    modules = layout.modules + 2 * layout.quiet
    if page_mm[0] < 150 + 2 * MARGIN_MM:
        raise UsageError(
            f"The paper {paper} is too narrow for the 150 mm ruler",
            f"It is {page_mm[0]:g} mm wide.",
            "Take it on its side (A5-landscape) or a larger paper.",
        )
    if not size_mm >= 1:
        raise UsageError(
            f"A marker of {size_mm:g} mm cannot be printed",
            "The size is the outer side of the dark square, in mm.",
            "Choose --size 1 or more; 40 to 90 suits webcams at 1 to 2 m.",
        )
    free = (page_mm[0] - 2 * MARGIN_MM, page_mm[1] - 2 * MARGIN_MM - FOOT_MM)
    card = size_mm * modules / layout.modules
    cell = _Cell(card, 1, 1)
    columns, rows = int(free[0] // cell.width_mm), int(free[1] // cell.height_mm)
    if columns < 1 or rows < 1:
        room = min(free[0] - 2 * GAP_MM, free[1] - 2 * GAP_MM - LABEL_MM)
        largest = int(room * layout.modules / modules)
        raise UsageError(
            f"A marker of {size_mm:g} mm does not fit {paper}",
            f"With its quiet zone it is {card:.1f} mm wide; {paper} takes {largest} mm at most.",
            f"Choose --size {largest} or less, or a larger --paper.",
        )
    return _Cell(card, columns, rows)


def _one(
    library: MarkerLibrary, wanted: int, size_mm: float, at: tuple[float, float], cell: _Cell
) -> tuple[Area, list[Line], list[Label]]:
    """Dark modules, cut lines and labels of the marker whose cell starts at ``at``."""
    x, y = at
    module = size_mm / library.layout.modules
    white = GAP_MM + library.layout.quiet * module
    area = outline(marker_modules(library, wanted), (x + white, y + white), module)
    cut = cut_lines((x, x + cell.width_mm), (y, y + cell.height_mm))
    below = y + 2 * GAP_MM + cell.card_mm
    words = f"Marker {wanted} ({in_words(wanted)})"
    origin = f"{library.name}, {size_mm:g} mm"
    room = cell.width_mm - 2 * GAP_MM
    labels = [
        Label((x + GAP_MM, below + 2.4), words, fitted_height(words, room, 3.0)),
        Label((x + GAP_MM, below + 5.4), origin, fitted_height(origin, room, 2.4)),
    ]
    return area, cut, labels
