"""Calibration boards at exact size: coded markers, ChArUco, grids of ArUco markers, chessboards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.boards import Board
from olivevib.errors import UsageError
from olivevib.files.prints.marker import marker_modules
from olivevib.files.prints.page import (
    LANDSCAPE,
    PAPERS_MM,
    Area,
    Label,
    Page,
    cut_lines,
    fitted_height,
    outline,
    paper_size,
    ruler,
)
from olivevib.files.prints.sheet import GAP_MM, MARGIN_MM
from olivevib.files.prints.words import in_words
from olivevib.marker import MarkerLibrary, load_library

Loops = Iterator[Floats]


FOOT_MM = 31.0  # ruler, SPEC and margin below the board
EDGE_MM = 5.0  # what must stay between ink and the edge of the paper


@dataclass(frozen=True)
class _Drawing:
    """What is dark, as loops (K, 2) in mm from the board's upper left corner, and how large.

    quiet_mm of the size on each side is white; ids: first and last marker.
    """

    width_mm: float
    height_mm: float
    loops: tuple[Floats, ...]
    ids: tuple[int, int] | None
    quiet_mm: float = 0.0


def board_page(board: Board, library: MarkerLibrary | None = None, paper: str = "A3") -> Page:
    """The board on one sheet, centred, with its SPEC, its ids in words, a ruler and cut lines.

    ``library`` holds the codes of a coded board (olive49 if not given). The paper is turned on its
    side when only that fits. Where the quiet zone runs over the edge of the paper, the sheet says
    so and has no cut lines. Raises UsageError for a board that does not fit, or whose markers stand
    closer than their quiet zone.
    """
    drawing = _DRAWINGS[board.kind](board, library or load_library())
    if board.inverted:
        drawing = _inverted(drawing, board)
    page_mm, whole = _room(drawing, paper, board)
    x = (page_mm[0] - drawing.width_mm) / 2
    y = (page_mm[1] - FOOT_MM - drawing.height_mm) / 2
    area = Area(tuple(np.add(loop, (x, y)) for loop in drawing.loops))
    lines, labels = ruler((MARGIN_MM, page_mm[1] - MARGIN_MM - 4.0))
    if whole:
        across = (x - GAP_MM, x + drawing.width_mm + GAP_MM)
        lines += cut_lines(across, (y - GAP_MM, y + drawing.height_mm + GAP_MM))
    return Page(*page_mm, (area,), tuple(lines), (*labels, _says(board, drawing, page_mm, whole)))


def _says(board: Board, drawing: _Drawing, page_mm: tuple[float, float], whole: bool) -> Label:
    """SPEC and ids in words, above the ruler."""
    text = f"--board {board.spec}"
    if drawing.ids:
        first, last = drawing.ids
        text += f"   markers {first} ({in_words(first)}) to {last} ({in_words(last)}), row by row"
    if not whole:
        text += "   glue it on something white: the white border is wider than the paper"
    room = page_mm[0] - 2 * MARGIN_MM
    at = (MARGIN_MM, page_mm[1] - MARGIN_MM - 12.0)
    return Label(at, text, fitted_height(text, room, 3.0))


def _room(drawing: _Drawing, paper: str, board: Board) -> tuple[tuple[float, float], bool]:
    """The paper as it is or on its side, and whether the whole quiet zone lies on it."""
    upright = paper_size(paper)
    for whole in (True, False):
        for page_mm in (upright, upright[::-1]):
            if _fits(drawing, page_mm, whole):
                return page_mm, whole
    ways = [(name, way) for name in PAPERS_MM for way in ("", LANDSCAPE)]
    takes = [name for name, way in ways if _fits(drawing, paper_size(name + way), True)]
    smallest = min(takes, key=lambda name: PAPERS_MM[name][0] * PAPERS_MM[name][1], default="")
    raise UsageError(
        f"The board {board.spec} does not fit {paper}",
        f"It is {drawing.width_mm:g} x {drawing.height_mm:g} mm with its white border.",
        (f"Choose --paper {smallest}, or" if smallest else "Choose") + " a smaller board.",
    )


def _fits(drawing: _Drawing, page_mm: tuple[float, float], whole: bool) -> bool:
    spare = 2 * (GAP_MM if whole else EDGE_MM - drawing.quiet_mm)
    across = max(drawing.width_mm + spare, 150.0 + 2 * MARGIN_MM)
    return across <= page_mm[0] and drawing.height_mm + spare + FOOT_MM <= page_mm[1]


def _inverted(drawing: _Drawing, board: Board) -> _Drawing:
    """Dark and white exchanged; a grid of markers gets a dark border of one gap."""
    border = board.lengths_mm["gap"] if board.kind == "arucogrid" else 0.0
    width, height = drawing.width_mm + 2 * border, drawing.height_mm + 2 * border
    frame = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    loops = (frame, *(loop + border for loop in drawing.loops))
    return _Drawing(width, height, loops, drawing.ids)


def _squares(columns: int, rows: int, square: float, first_dark: bool) -> Loops:
    y, x = np.indices((rows, columns))
    dark: Bools = (x + y) % 2 == (0 if first_dark else 1)
    for row, column in np.argwhere(dark):
        yield from outline(np.ones((1, 1), np.bool_), (column * square, row * square), square).loops


def _foreign(board: Board) -> MarkerLibrary:
    return load_library(
        f"{'apriltag' if 'APRILTAG' in board.dictionary else 'aruco'}:"
        + (board.dictionary.removeprefix("DICT_APRILTAG_"))
    )


def _marker(library: MarkerLibrary, wanted: int, centre: tuple[float, float], size: float) -> Loops:
    corner = (centre[0] - size / 2, centre[1] - size / 2)
    yield from outline(marker_modules(library, wanted), corner, size / library.layout.modules).loops


def _charuco(board: Board, _: MarkerLibrary) -> _Drawing:
    square, marker = board.lengths_mm["square"], board.lengths_mm["marker"]
    dark_first = not (board.legacy and board.rows % 2 == 0)
    loops = list(_squares(board.columns, board.rows, square, dark_first))
    library = _foreign(board)
    wanted = 0
    for row in range(board.rows):
        for column in range(board.columns):
            if ((row + column) % 2 == 0) != dark_first:
                centre = ((column + 0.5) * square, (row + 0.5) * square)
                loops += _marker(library, wanted, centre, marker)
                wanted += 1
    return _Drawing(board.columns * square, board.rows * square, tuple(loops), (0, wanted - 1))


def _chessboard(board: Board, _: MarkerLibrary) -> _Drawing:
    square = board.lengths_mm["square"]
    columns, rows = board.columns + 1, board.rows + 1  # the SPEC counts inner corners
    loops = tuple(_squares(columns, rows, square, first_dark=True))
    return _Drawing(columns * square, rows * square, loops, None)


def _arucogrid(board: Board, _: MarkerLibrary) -> _Drawing:
    return _grid(board, _foreign(board), 0, board.lengths_mm["size"])


def _coded(board: Board, library: MarkerLibrary) -> _Drawing:
    return _grid(board, library, board.first, board.lengths_mm["size"])


def _grid(board: Board, library: MarkerLibrary, first: int, size: float) -> _Drawing:
    """Markers in rows, their quiet zone round the whole; UsageError if they stand too close."""
    quiet = library.layout.quiet * size / library.layout.modules
    if board.pitch_mm - size < quiet - 1e-9:
        raise UsageError(
            f"The markers of {board.spec} stand too close",
            f"Between two of them {board.pitch_mm - size:g} mm are white; the quiet zone of "
            f"{library.layout.quiet} modules wants {quiet:.1f} mm.",
            f"Choose a spacing of {size + quiet:.1f} mm or more.",
        )
    loops: list[Floats] = []
    for place in range(board.columns * board.rows):
        row, column = divmod(place, board.columns)
        centre = (
            quiet + size / 2 + column * board.pitch_mm,
            quiet + size / 2 + row * board.pitch_mm,
        )
        loops += _marker(library, first + place, centre, size)
    width, height = (
        (n - 1) * board.pitch_mm + size + 2 * quiet for n in (board.columns, board.rows)
    )
    return _Drawing(
        width, height, tuple(loops), (first, first + board.columns * board.rows - 1), quiet
    )


_DRAWINGS: dict[str, Callable[[Board, MarkerLibrary], _Drawing]] = {
    "charuco": _charuco,
    "chessboard": _chessboard,
    "arucogrid": _arucogrid,
    "coded": _coded,
}
