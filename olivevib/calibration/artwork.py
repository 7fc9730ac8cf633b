"""What is printed on a board, as an image: the template to which its points are refined."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats
from olivevib.calibration.boards import Board, markers_on, predefined

Image = NDArray[np.float32]
CELL_PX = 96  # template pixels a square, or a marker with its gap; fewer on large boards
MOST_PX = 400_000  # template pixels of a whole board
BLURS = 0.6 * 1.35 ** np.arange(12)  # Gaussian blurs at which the print is kept, template px


@dataclass(frozen=True)
class Artwork:
    """A printed board, blurred more and more, with its slopes.

    layers (one a blur): float32 (H, W, 3) of grey 0...1 and its derivatives by template x and y;
    px_per_mm; corner_mm (2,): board point of the outer corner of pixel (0, 0); reach_mm (N,): half
    the side of the square patch that belongs to each point. The patches of a board do not overlap,
    so the errors of its points are independent.
    """

    layers: tuple[Image, ...]
    px_per_mm: float
    corner_mm: Floats
    reach_mm: Floats

    def pixels(self, board_mm: Floats) -> Image:
        """Template pixels (N, 2) of board points (N, 2)."""
        px = (board_mm - self.corner_mm) * self.px_per_mm - 0.5
        return px.astype(np.float32)

    def layer(self, blur_px: float) -> Image:
        """The layer whose blur is nearest to ``blur_px`` template pixels."""
        return self.layers[int(np.abs(np.log(BLURS / blur_px)).argmin())]


def draw_artwork(board: Board) -> Artwork:
    """The artwork of a ChArUco board, ArUco grid or chessboard."""
    draw = {"charuco": _charuco, "arucogrid": _arucogrid, "chessboard": _chessboard}[board.kind]
    cells = (board.columns + 1) * (board.rows + 1)
    cell = int(min(CELL_PX, max(16, np.sqrt(MOST_PX / cells))))
    grey, corner = draw(board, cell)
    ink = np.asarray(255 - grey if board.inverted else grey, dtype=np.float32) / np.float32(255)
    layers = tuple(_layer(ink, float(blur)) for blur in BLURS)
    return Artwork(layers, cell / board.pitch_mm, corner, _reach(board))


def _layer(grey: Image, blur_px: float) -> Image:
    soft = cv2.GaussianBlur(grey, (0, 0), blur_px, borderType=cv2.BORDER_REPLICATE)
    x = cv2.Sobel(soft, cv2.CV_32F, 1, 0, ksize=1) * 0.5
    y = cv2.Sobel(soft, cv2.CV_32F, 0, 1, ksize=1) * 0.5
    return np.dstack([soft, x, y])


def _reach(board: Board) -> Floats:
    share = board.lengths_mm["size"] / 4 if board.kind == "arucogrid" else board.pitch_mm / 2
    return np.full(len(board.points_mm), share)


def _charuco(board: Board, cell: int) -> tuple[NDArray[np.uint8], Floats]:
    size = (board.columns * cell, board.rows * cell)
    return np.asarray(charuco_board(board).generateImage(size)), np.zeros(2)


def charuco_board(board: Board) -> cv2.aruco.CharucoBoard:
    """OpenCV's board of the same description."""
    lengths = board.lengths_mm
    made = cv2.aruco.CharucoBoard(
        (board.columns, board.rows),
        lengths["square"],
        lengths["marker"],
        predefined(board.dictionary),
    )
    made.setLegacyPattern(board.legacy)
    return made


def _arucogrid(board: Board, cell: int) -> tuple[NDArray[np.uint8], Floats]:
    side = round(cell * board.lengths_mm["size"] / board.pitch_mm)
    margin = cell - side
    grey = np.full((board.rows * cell + margin, board.columns * cell + margin), 255, np.uint8)
    dictionary = predefined(board.dictionary)
    for k in range(markers_on(board.kind, board.columns, board.rows)):
        row, column = divmod(k, board.columns)
        y, x = margin + row * cell, margin + column * cell
        marker = cv2.aruco.generateImageMarker(dictionary, k, side)
        grey[y : y + side, x : x + side] = marker
    return grey, np.full(2, -margin * board.pitch_mm / cell)


def _chessboard(board: Board, cell: int) -> tuple[NDArray[np.uint8], Floats]:
    dark = np.indices((board.rows + 1, board.columns + 1)).sum(axis=0) % 2 == 0
    grey = np.where(dark, 0, 255).astype(np.uint8)
    grey = np.kron(grey, np.ones((cell, cell), np.uint8))
    return grey, np.full(2, -board.pitch_mm)
