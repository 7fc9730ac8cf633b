"""Calibration boards as prints, in the board's own frame (see ``calibration.boards``)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.boards import Board
from olivevib.errors import UsageError
from olivevib.marker import MarkerLibrary
from olivevib.simulation.planar import Planar, dictionary_modules, runs

RIM_MM = 12.0  # white paper around the outermost squares or quiet zones

_Boxes = tuple[list[Floats], Floats]  # dark rectangles (K, 4), and the printed area (4,)


def board_planar(board: Board, codes: MarkerLibrary | None = None) -> Planar:
    """The print of a board; its origin is that of ``board.points_mm``.

    ``codes`` is the library of a coded board; UsageError where it is needed and missing.
    """
    boxes, area = _DRAWINGS[board.kind](board, codes)
    card = area + np.array([-RIM_MM, -RIM_MM, RIM_MM, RIM_MM])
    return Planar(np.vstack(boxes), card, inverted=board.inverted)


def _at(boxes_modules: Floats, module_mm: float, x_mm: float, y_mm: float) -> Floats:
    out: Floats = boxes_modules * module_mm + np.array([x_mm, y_mm, x_mm, y_mm])
    return out


def _squares(columns: int, rows: int, side: float, start: float, dark_first: bool) -> Floats:
    y, x = np.indices((rows, columns))
    dark: Bools = (x + y) % 2 == (0 if dark_first else 1)
    return _at(runs(dark), side, start, start)


def _charuco(board: Board, _: MarkerLibrary | None) -> _Boxes:
    side, marker = board.lengths_mm["square"], board.lengths_mm["marker"]
    dark_first = not (board.legacy and board.rows % 2 == 0)
    boxes = [_squares(board.columns, board.rows, side, 0.0, dark_first)]
    gap, number = (side - marker) / 2, 0
    for row in range(board.rows):
        for column in range(board.columns):
            if ((row + column) % 2 == 0) != dark_first:
                modules = dictionary_modules(board.dictionary, number)
                corner = (column * side + gap, row * side + gap)
                boxes.append(_at(runs(modules), marker / len(modules), *corner))
                number += 1
    return boxes, np.array([0.0, 0.0, board.columns * side, board.rows * side])


def _chessboard(board: Board, _: MarkerLibrary | None) -> _Boxes:
    side = board.lengths_mm["square"]
    boxes = [_squares(board.columns + 1, board.rows + 1, side, -side, True)]
    return boxes, np.array([-side, -side, board.columns * side, board.rows * side])


def _arucogrid(board: Board, _: MarkerLibrary | None) -> _Boxes:
    size = board.lengths_mm["size"]
    boxes = []
    for number in range(board.columns * board.rows):
        row, column = divmod(number, board.columns)
        modules = dictionary_modules(board.dictionary, number)
        corner = (column * board.pitch_mm, row * board.pitch_mm)
        boxes.append(_at(runs(modules), size / len(modules), *corner))
    far = [(n - 1) * board.pitch_mm + size for n in (board.columns, board.rows)]
    return boxes, np.array([0.0, 0.0, *far])


def _coded(board: Board, codes: MarkerLibrary | None) -> _Boxes:
    if codes is None:
        raise UsageError(f"the codes of the board {board.spec} are needed to draw it")
    size, layout = board.lengths_mm["size"], codes.layout
    module = size / layout.modules
    boxes = []
    for place in range(board.columns * board.rows):
        row, column = divmod(place, board.columns)
        pattern = layout.pattern(codes.only((board.first + place,)).codes[0])
        corner = (column * board.pitch_mm - size / 2, row * board.pitch_mm - size / 2)
        boxes.append(_at(runs(pattern), module, *corner))
    edge = size / 2 + layout.quiet * module
    far = [(n - 1) * board.pitch_mm + edge for n in (board.columns, board.rows)]
    return boxes, np.array([-edge, -edge, *far])


_DRAWINGS: dict[str, Callable[[Board, MarkerLibrary | None], _Boxes]] = {
    "charuco": _charuco,
    "chessboard": _chessboard,
    "arucogrid": _arucogrid,
    "coded": _coded,
}
