"""What is printed on a board, as an image: the template to which its points are refined."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Ints
from olivevib.calibration.boards import Board, markers_on, own_codes, predefined

Image = NDArray[np.float32]
CELL_PX = 160  # template pixels a square, or a marker with its gap; fewer on large boards
MOST_PX = 1_000_000  # template pixels of a whole board
BLURS = 1.35 ** np.arange(12)  # Gaussian blurs at which the print is drawn, template px


class Artwork:
    """A printed board as dark squares, drawn with as much blur as the camera adds.

    px_per_mm; corner_mm (2,): board point of the outer corner of template pixel (0, 0); reach_mm
    (N,): half the side of the square patch that belongs to each point. The patches of a board do
    not overlap, so the errors of its points are independent. Drawings are kept once made.
    """

    def __init__(self, board: Board) -> None:
        dark_mm, corner, size_mm = dark_squares(board)
        cells = (board.columns + 1) * (board.rows + 1)
        self.px_per_mm = min(CELL_PX, np.sqrt(MOST_PX / cells)) / board.pitch_mm
        self.corner_mm = corner
        self.reach_mm = _reach(board)
        self._squares = (dark_mm - np.tile(corner, 2)) * self.px_per_mm
        self._size = np.ceil(size_mm * self.px_per_mm - 1e-9).astype(np.int64)
        self._sign = -1.0 if board.inverted else 1.0
        self._drawn: dict[int, Image] = {}

    def pixels(self, board_mm: Image) -> Image:
        """Template pixels (2, N) of board points (2, N)."""
        first = (self.corner_mm * self.px_per_mm + 0.5).astype(np.float32)
        return np.asarray(board_mm * np.float32(self.px_per_mm) - first[:, None], dtype=np.float32)

    def clip(self, level: int) -> int:
        """The nearest level of blur that exists."""
        return min(max(level, 0), len(BLURS) - 1)

    def level(self, blur_px: float) -> int:
        """The level whose blur is nearest to ``blur_px`` template pixels."""
        return int(np.abs(np.log(BLURS / blur_px)).argmin())

    def layer(self, level: int) -> Image:
        """Grey 0...1 and its slopes by x and y (H, W, 3) at a level of blur."""
        if level not in self._drawn:
            drawn = blurred_squares(self._squares, self._size, float(BLURS[level]))
            ink = np.float32(-self._sign) * drawn
            ink[:, :, 0] += np.float32(self._sign > 0)
            self._drawn[level] = ink
        return self._drawn[level]


def blurred_squares(squares: Floats, size_px: Ints, sigma_px: float) -> Image:
    """Squares x0 y0 x1 y1 (S, 4) px of darkness 1 under a Gaussian blur, exact at pixel centres.

    Returns darkness and its derivatives by x and y (H, W, 3); size (W, H). Nothing is drawn on
    whole pixels first, so edges stand where they are to any fraction of a pixel.
    """
    from scipy.special import ndtr

    sides, which = [], []
    for k, n in enumerate(size_px):
        spans, of = np.unique(np.round(squares[:, k::2], 6), axis=0, return_inverse=True)
        centre = np.arange(n) + 0.5
        low, high = ((centre - spans[:, j, None]) / sigma_px for j in (0, 1))
        bell = np.exp(-0.5 * low**2) - np.exp(-0.5 * high**2)
        shade, slope = ndtr(low) - ndtr(high), bell / (np.sqrt(2 * np.pi) * sigma_px)
        sides.append((shade.astype(np.float32), slope.astype(np.float32)))
        which.append(of.ravel())
    (across, slope_x), (down, slope_y) = sides
    printed = np.zeros((len(down), len(across)), np.float32)  # squares share few columns and rows
    np.add.at(printed, (which[1], which[0]), 1)
    rows = printed @ across
    layers = [down.T @ rows, down.T @ (printed @ slope_x), slope_y.T @ rows]
    return np.asarray(cv2.merge(layers), dtype=np.float32)


def _reach(board: Board) -> Floats:
    share = board.lengths_mm["size"] / 4 if board.kind == "arucogrid" else board.pitch_mm / 2
    return np.full(len(board.points_mm), share)


def charuco_board(board: Board) -> cv2.aruco.CharucoBoard:
    """OpenCV's board of the same description."""
    lengths, shape = board.lengths_mm, (board.columns, board.rows)
    made = cv2.aruco.CharucoBoard(shape, lengths["square"], lengths["marker"], own_codes(board))
    made.setLegacyPattern(board.legacy)
    return made


def dark_squares(board: Board) -> tuple[Floats, Floats, Floats]:
    """Dark squares x0 y0 x1 y1 (S, 4), first corner (2,) and size (2,) of the print, mm."""
    return {"charuco": _charuco, "arucogrid": _arucogrid, "chessboard": _chessboard}[board.kind](
        board
    )


def _charuco(board: Board) -> tuple[Floats, Floats, Floats]:
    square, marker = board.lengths_mm["square"], board.lengths_mm["marker"]
    theirs = charuco_board(board)
    row, column = np.divmod(np.arange(board.rows * board.columns), board.columns)
    corners = np.array([np.asarray(quad)[0, :2] for quad in theirs.getObjPoints()])
    white = np.floor(corners / square).astype(np.int64)
    dark = ~np.isin(row * board.columns + column, white[:, 1] * board.columns + white[:, 0])
    at = np.column_stack([column, row])[dark] * square
    squares = [np.column_stack([at, at + square])]
    squares += [
        _marker(board.dictionary, int(k), marker) + np.tile(corner, 2)
        for k, corner in zip(np.ravel(theirs.getIds()), corners, strict=True)
    ]
    size = np.array([board.columns, board.rows]) * square
    return np.concatenate(squares), np.zeros(2), size


def _arucogrid(board: Board) -> tuple[Floats, Floats, Floats]:
    size, gap, pitch = board.lengths_mm["size"], board.lengths_mm["gap"], board.pitch_mm
    count = markers_on(board.kind, board.columns, board.rows)
    squares = [
        _marker(board.dictionary, k, size)
        + np.tile(np.array([k % board.columns, k // board.columns]) * pitch, 2)
        for k in range(count)
    ]
    whole = np.array([board.columns, board.rows]) * pitch + gap
    return np.concatenate(squares), np.full(2, -gap), whole


def _marker(dictionary: str, number: int, size_mm: float) -> Floats:
    """Dark modules x0 y0 x1 y1 (S, 4) of one marker, mm from its upper left corner."""
    book = predefined(dictionary)
    modules = book.markerSize + 2
    image = cv2.aruco.generateImageMarker(book, number, modules)
    at = np.argwhere(np.asarray(image) < 128)[:, ::-1] * (size_mm / modules)
    return np.asarray(np.column_stack([at, at + size_mm / modules]), dtype=np.float64)


def _chessboard(board: Board) -> tuple[Floats, Floats, Floats]:
    square = board.lengths_mm["square"]
    row, column = np.indices((board.rows + 1, board.columns + 1)).reshape(2, -1)
    dark = (row + column) % 2 == 0
    at = np.column_stack([column, row])[dark] * square - square
    size = np.array([board.columns + 1, board.rows + 1]) * square
    return np.column_stack([at, at + square]), np.full(2, -square), size
