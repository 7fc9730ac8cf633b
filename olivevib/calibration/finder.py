"""The board in one picture: points of every kind of board, with the sigma of their localiser."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey, Ints
from olivevib.calibration.boards import CORNERS_PER_MARKER, Board, predefined
from olivevib.calibration.views import BoardView
from olivevib.detection import Detection, Reader
from olivevib.detection.foreign import ForeignReader
from olivevib.marker import load_library

LEAST_POINTS = 4  # fewer do not fix the pose of a view
CORNER_SIGMA_PX = 0.1  # cv2's saddle points and chessboard corners on rendered boards
LARGE_PX = 1_000_000  # above this many pixels the sector-based chessboard search is the better one
SUBPIX_SHARE = 0.4  # half-width of the corner window in squares, so that no neighbour pulls
Points = tuple[Ints, Floats, Floats]  # ids (N,), px (N, 2), sigma_px (N,)


class BoardFinder:
    """Finds one board in grey pictures; belongs to one thread.

    reader: what reads the markers of a coded board (a Detector of its library); other boards
    bring their own. Inverted boards are looked for in the negative.
    """

    def __init__(self, board: Board, reader: Reader | None = None) -> None:
        self.board = board
        self._find = _FINDERS[board.kind](board, reader)

    def find(self, grey: Grey, frame: int = 0, t_s: float = float("nan")) -> BoardView | None:
        """The board in ``grey`` (H, W) uint8, or None where fewer than four points were found."""
        ids, px, sigma = self._find(grey)
        if ids.size < LEAST_POINTS or _in_line(px):
            return None
        order = np.argsort(ids)
        ids = ids[order]
        return BoardView(frame, t_s, ids, px[order], self.board.points_mm[ids], sigma[order])


def _in_line(px: Floats) -> bool:
    """Whether all points lie on one line, as seen: they would not fix a pose."""
    spread = np.linalg.svd(px - px.mean(axis=0), compute_uv=False)
    return bool(spread[1] < 1e-3 * max(float(spread[0]), 1e-9))


def _none() -> Points:
    return np.empty(0, np.int64), np.empty((0, 2)), np.empty(0)


def _uniform(ids: Any, px: Any) -> Points:
    ids = np.ravel(ids).astype(np.int64)
    return ids, np.asarray(px, np.float64).reshape(-1, 2), np.full(ids.size, CORNER_SIGMA_PX)


def _charuco(board: Board, reader: Reader | None) -> Callable[[Grey], Points]:
    lengths = board.lengths_mm
    pattern = cv2.aruco.CharucoBoard(
        (board.columns, board.rows),
        lengths["square"],
        lengths["marker"],
        predefined(board.dictionary),
    )
    pattern.setLegacyPattern(board.legacy)
    detector: Any = cv2.aruco.CharucoDetector(pattern)

    def find(grey: Grey) -> Points:
        corners, ids, _, _ = detector.detectBoard(255 - grey if board.inverted else grey)
        return _none() if ids is None else _uniform(ids, corners)

    return find


def _arucogrid(board: Board, reader: Reader | None) -> Callable[[Grey], Points]:
    wanted = tuple(range(board.columns * board.rows))
    markers = ForeignReader(load_library(f"aruco:{board.dictionary}").only(wanted))

    def find(grey: Grey) -> Points:
        parts = [_marker_points(d) for d in markers.detect(grey) if not d.flags]
        return _joined(parts)

    return find


def _marker_points(d: Detection) -> Points:
    """Centre and corners of one marker of a grid."""
    ids = CORNERS_PER_MARKER * d.id + np.arange(CORNERS_PER_MARKER)
    px = np.vstack([d.centre_px, d.corners_px])
    variances = np.concatenate([np.diag(d.centre_cov_px2), np.diag(d.corners_cov_px2)])
    return ids, px, np.sqrt(variances.reshape(-1, 2).mean(axis=1))


def _joined(parts: Sequence[Points]) -> Points:
    if not parts:
        return _none()
    ids, px, sigma = (np.concatenate(column) for column in zip(*parts, strict=True))
    return ids, px, sigma


def _coded(board: Board, reader: Reader | None) -> Callable[[Grey], Points]:
    if reader is None:
        raise ValueError("a board of coded markers needs the reader of its library")

    def find(grey: Grey) -> Points:
        on_board = [
            d
            for d in reader.detect(grey)
            if not d.flags and 0 <= d.id - board.first < board.columns * board.rows
        ]
        if not on_board:
            return _none()
        sigma = np.sqrt([np.trace(d.centre_cov_px2) / 2 for d in on_board])
        ids = np.array([d.id - board.first for d in on_board], dtype=np.int64)
        return ids, np.array([d.centre_px for d in on_board]), sigma

    return find


def _chessboard(board: Board, reader: Reader | None) -> Callable[[Grey], Points]:
    size = (board.columns, board.rows)

    def sectors(grey: Grey) -> Floats | None:
        flags = cv2.CALIB_CB_ACCURACY + cv2.CALIB_CB_EXHAUSTIVE
        found, corners = cv2.findChessboardCornersSB(grey, size, flags=flags)
        return np.asarray(corners, np.float64).reshape(-1, 2) if found else None

    def classic(grey: Grey) -> Floats | None:
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE
        found, corners = cv2.findChessboardCorners(grey, size, flags=flags)
        return _saddles(grey, np.asarray(corners), size) if found else None

    def find(grey: Grey) -> Points:
        ways = (sectors, classic) if grey.size > LARGE_PX else (classic, sectors)
        for way in ways:
            corners = way(grey)
            if corners is not None:
                return _uniform(np.arange(len(corners)), corners)
        return _none()

    return find


def _saddles(grey: Grey, corners: np.ndarray[Any, Any], size: tuple[int, int]) -> Floats:
    """Chessboard corners to sub-pixel, in a window that stays within a square."""
    grid = corners.reshape(size[1], size[0], 2)
    step = min(
        float(np.linalg.norm(np.diff(grid, axis=0), axis=2).min()),
        float(np.linalg.norm(np.diff(grid, axis=1), axis=2).min()),
    )
    half = int(np.clip(SUBPIX_SHARE * step, 2, 11))
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 1e-3)
    fine = cv2.cornerSubPix(grey, corners.astype(np.float32), (half, half), (-1, -1), criteria)
    return np.asarray(fine, np.float64).reshape(-1, 2)


_FINDERS: dict[str, Callable[[Board, Reader | None], Callable[[Grey], Points]]] = {
    "charuco": _charuco,
    "arucogrid": _arucogrid,
    "coded": _coded,
    "chessboard": _chessboard,
}
