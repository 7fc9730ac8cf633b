"""What is printed before a trial: sheets of markers and calibration boards, at exact size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from olivevib.calibration.boards import parse_board
from olivevib.files.prints import Page, board_page, sheet_pages, write_pages
from olivevib.marker import MarkerLibrary
from olivevib.pipeline.libraries import only_known

ADVICE = "Print at 100 % (no fit to page) and check the 150 mm ruler on the sheet."


@dataclass(frozen=True)
class Prints:
    """Pages as they will be printed; title: in the file; ids: of the markers that are on them."""

    pages: tuple[Page, ...]
    title: str
    ids: tuple[int, ...] = ()


def marker_sheets(library: MarkerLibrary, ids: Sequence[int], size_mm: float, paper: str) -> Prints:
    """Markers (none named: all) with an outer dark side of ``size_mm``, as many a page as fit.

    UsageError for ids that the library does not have, and for a marker that does not fit the paper.
    """
    wanted = tuple(ids) or tuple(int(i) for i in library.ids)
    only_known(library, wanted)
    pages = sheet_pages(library, wanted, size_mm, paper)
    return Prints(tuple(pages), f"{library.name} markers", wanted)


def board_sheet(spec: str, library: MarkerLibrary, paper: str) -> Prints:
    """One calibration board; ``library`` holds the codes of a coded one. Raises UsageError."""
    return Prints((board_page(parse_board(spec), library, paper),), spec)


def write_prints(prints: Prints, target: Path) -> list[Path]:
    """Write PDF or SVG, as the name ends; returns the files. Raises as ``write_pages`` does."""
    return write_pages(target, prints.pages, prints.title)
