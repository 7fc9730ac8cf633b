"""Find the calibration board in a grey image: which points, where, and how well."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey, Ints
from olivevib.calibration.artwork import Artwork, charuco_board
from olivevib.calibration.boards import CORNERS_PER_MARKER, Board, markers_on, own_codes
from olivevib.calibration.corners import refine
from olivevib.calibration.views import BoardView
from olivevib.calibration.warp import bent_warp, robust_homography
from olivevib.detection.detection import Reader
from olivevib.geometry import apply_homography

LEAST_POINTS = 4
ASTRAY = 0.15  # of the pitch: no lens bends a board by as much
PREDICT_FROM = 6  # points that predict where the missing ones are
UNREFINED_PX = 0.15  # what OpenCV's corners are worth where the print does not fit
LARGE_PX = 1.1e6  # above this many pixels the sector-based chessboard finder is better

Raw = tuple[Ints, Floats]  # point ids (N,), rising, and pixels (N, 2)


class BoardFinder:
    """Finds one board, frame after frame. One thread calls it; each camera owns one.

    ``reader`` finds the markers of a coded board (any object with ``detect(grey)``); boards of
    other kinds are read by OpenCV and their points refined by the print itself.
    """

    def __init__(self, board: Board, reader: Reader | None = None) -> None:
        if (board.kind == "coded") != (reader is not None):
            raise ValueError("a coded board, and only a coded board, needs a reader")
        self.board = board
        self._reader = reader
        self._artwork: Artwork | None = None if reader else Artwork(board)
        self._search: Callable[[Grey], Raw | None] = lambda grey: None
        if reader is None:
            self._search = _SEARCHES[board.kind](board)

    def find(self, grey: Grey, frame: int = 0, t_s: float = float("nan")) -> BoardView | None:
        """The board in ``grey`` (H, W) uint8, or None where fewer than 4 points are sure."""
        if self._reader is not None:
            return _coded_view(self.board, self._reader, grey, frame, t_s)
        raw = self._search(255 - grey if self.board.inverted else grey)
        if raw is None or not _spread(self.board, raw[0]) or not _flat(self.board, *raw):
            return None
        assert self._artwork is not None
        ids, px, sigma = refined(self.board, self._artwork, grey, raw)
        if not _spread(self.board, ids):
            return None
        return BoardView(frame, t_s, ids, px, self.board.points_mm[ids], sigma)


def find_board(
    board: Board,
    grey: Grey,
    reader: Reader | None = None,
    frame: int = 0,
    t_s: float = float("nan"),
) -> BoardView | None:
    """The board in one image; for many images keep a BoardFinder."""
    return BoardFinder(board, reader).find(grey, frame, t_s)


def refined(board: Board, artwork: Artwork, grey: Grey, raw: Raw) -> tuple[Ints, Floats, Floats]:
    """Ids, pixels and sigmas of the points after the print was fitted around each.

    Points that OpenCV missed are looked for where the others predict them. Where the print fits
    less than half of the points (another print than the SPEC says), OpenCV's points are kept.
    """
    ids, px = raw
    plane = board.points_mm[:, :2]
    if ids.size >= PREDICT_FROM:
        px_all = bent_warp(plane[ids], px).forward(plane)
        px_all[ids] = px
        found, ids_all = np.isin(np.arange(len(plane)), ids), np.arange(len(plane))
    else:
        px_all, ids_all, found = px, ids, np.ones(ids.size, dtype=np.bool_)
    order = np.argsort(~found, kind="stable")
    fit = refine(
        grey, artwork, plane[ids_all[order]], px_all[order], artwork.reach_mm[ids_all[order]]
    )
    back = np.argsort(order)
    ok, at = fit.ok[back], fit.px[back]
    if ok[found].sum() < 0.5 * found.sum():
        return ids, px, np.full(ids.size, UNREFINED_PX)
    return ids_all[ok], at[ok], fit.sigma_px[back][ok]


def _spread(board: Board, ids: Ints) -> bool:
    """Whether at least four points, not all in one line, were found."""
    if ids.size < LEAST_POINTS:
        return False
    points = board.points_mm[ids, :2]
    s = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(s[1] > 0.2 * board.pitch_mm)


def _flat(board: Board, ids: Ints, px: Floats) -> bool:
    """Whether the points lie as on this board: wrong columns or a mirror put them elsewhere."""
    plane = board.points_mm[ids, :2]
    try:
        back = np.asarray(np.linalg.inv(robust_homography(plane, px)), dtype=np.float64)
    except np.linalg.LinAlgError:
        return False
    miss = np.linalg.norm(apply_homography(back, px) - plane, axis=1)
    return bool(np.mean(miss < ASTRAY * board.pitch_mm) >= 0.8)


def _charuco_search(board: Board) -> Callable[[Grey], Raw | None]:
    detector = cv2.aruco.CharucoDetector(charuco_board(board))

    def search(grey: Grey) -> Raw | None:
        corners, ids, _, _ = detector.detectBoard(grey)
        if ids is None or len(ids) < LEAST_POINTS:
            return None
        return _sorted(ids.ravel(), corners.reshape(-1, 2))

    return search


def aruco_detector(board: Board) -> cv2.aruco.ArucoDetector:
    """OpenCV's detector of a board's markers with corners from fitted contours."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    return cv2.aruco.ArucoDetector(own_codes(board), parameters)


def _arucogrid_search(board: Board) -> Callable[[Grey], Raw | None]:
    detector = aruco_detector(board)
    count = markers_on(board.kind, board.columns, board.rows)

    def search(grey: Grey) -> Raw | None:
        corners, ids, _ = detector.detectMarkers(grey)
        if ids is None or len(ids) == 0:
            return None
        once = {
            int(k): np.asarray(quad.reshape(4, 2), dtype=np.float64)
            for k, quad in zip(ids.ravel(), corners, strict=True)
        }
        known = sorted(k for k in once if k < count)
        if not known:
            return None
        px = [np.vstack([crossing(once[k]), once[k]]) for k in known]
        points = np.asarray(known)[:, None] * CORNERS_PER_MARKER + np.arange(CORNERS_PER_MARKER)
        return points.ravel().astype(np.int64), np.concatenate(px).astype(np.float64)

    return search


def crossing(quad: Floats) -> Floats:
    """Where the diagonals of a quadrilateral (4, 2) meet: the image of a square's centre."""
    a, b, c, d = np.asarray(quad, dtype=np.float64)
    s = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    return np.asarray(a + s[0] * (c - a), dtype=np.float64)


def _chessboard_search(board: Board) -> Callable[[Grey], Raw | None]:
    size = (board.columns, board.rows)

    def search(grey: Grey) -> Raw | None:
        find = _sectors if grey.size > LARGE_PX else _classic
        px = find(grey, size)
        if px is None:
            return None
        return np.arange(len(px), dtype=np.int64), px.reshape(-1, 2).astype(np.float64)

    return search


def _classic(grey: Grey, size: tuple[int, int]) -> Floats | None:
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    found, px = cv2.findChessboardCorners(grey, size, flags=flags)
    if not found:
        return None
    apart = np.linalg.norm(np.diff(px.reshape(-1, 2), axis=0), axis=1).min()
    half = int(np.clip(0.4 * apart, 2, 11))
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 1e-3)
    return np.asarray(cv2.cornerSubPix(grey, px, (half, half), (-1, -1), criteria))


def _sectors(grey: Grey, size: tuple[int, int]) -> Floats | None:
    flags = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, px = cv2.findChessboardCornersSB(grey, size, flags=flags)
    return np.asarray(px) if found else None


_SEARCHES: dict[str, Callable[[Board], Callable[[Grey], Raw | None]]] = {
    "charuco": _charuco_search,
    "arucogrid": _arucogrid_search,
    "chessboard": _chessboard_search,
}


def _sorted(ids: NDArray[Any], px: NDArray[Any]) -> Raw:
    order = np.argsort(ids)
    return ids[order].astype(np.int64), px[order].astype(np.float64)


def _coded_view(
    board: Board, reader: Reader, grey: Grey, frame: int, t_s: float
) -> BoardView | None:
    """Markers of a coded board: the image of each centre, with the localiser's own sigma."""
    count = markers_on(board.kind, board.columns, board.rows)
    seen = {d.id - board.first: d for d in reader.detect(grey) if not d.flags}
    ids = np.array(sorted(k for k in seen if 0 <= k < count), dtype=np.int64)
    px = np.array([seen[int(k)].centre_px for k in ids]).reshape(-1, 2)
    if not _spread(board, ids) or not _flat(board, ids, px):
        return None
    sigma = [np.sqrt(max(np.trace(seen[int(k)].centre_cov_px2) / 2, 1e-6)) for k in ids]
    return BoardView(frame, t_s, ids, px, board.points_mm[ids], np.array(sigma))
