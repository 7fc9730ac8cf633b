"""Which board carries these markers: columns, rows and pattern from the ids and where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey, Ints
from olivevib.calibration.boards import Board, markers_on, predefined
from olivevib.calibration.warp import robust_homography
from olivevib.geometry import apply_homography

COUNTS = range(2, 16)  # columns and rows that are tried
FITS = 0.12  # of the markers' spacing: a marker this near to its place belongs there
LEAST_MARKERS = 6


@dataclass(frozen=True)
class Markers:
    """Markers of one image: ids (N,) and centres (N, 2) px."""

    id: Ints
    centre_px: Floats


def read_markers(dictionary: str, grey: Grey) -> Markers:
    """All markers of a dictionary in an image, each id once."""
    detector = cv2.aruco.ArucoDetector(predefined(dictionary), cv2.aruco.DetectorParameters())
    corners, ids, _ = detector.detectMarkers(grey)
    if ids is None or len(ids) == 0:
        return Markers(np.zeros(0, dtype=np.int64), np.zeros((0, 2)))
    flat, first = np.unique(ids.ravel(), return_index=True)
    centres = np.array([corners[k].reshape(4, 2).mean(axis=0) for k in first], dtype=np.float64)
    return Markers(flat.astype(np.int64), centres)


def marker_places(board: Board) -> Floats:
    """Where the middle of each marker lies, in cells (M, 2)."""
    row, column = np.divmod(np.arange(board.rows * board.columns), board.columns)
    cells = np.column_stack([column, row]).astype(np.float64)
    if board.kind != "charuco":
        return cells
    flipped = board.legacy and board.rows % 2 == 0
    return np.asarray(cells[(row + column) % 2 == (0 if flipped else 1)])


def agreement(board: Board, seen: Markers) -> int:
    """How many markers lie where this board carries them (0 where fewer than 6 do)."""
    places = marker_places(board)
    known = seen.id < len(places)
    if known.sum() < LEAST_MARKERS:
        return 0
    cells, px = places[seen.id[known]], seen.centre_px[known]
    if np.linalg.svd(cells - cells.mean(axis=0), compute_uv=False)[1] < 0.5:
        return 0
    try:
        H = robust_homography(cells, px)
        back = apply_homography(np.asarray(np.linalg.inv(H), dtype=np.float64), px)
    except np.linalg.LinAlgError:
        return 0
    fits = int((np.linalg.norm(back - cells, axis=1) < FITS).sum())
    return fits if fits >= LEAST_MARKERS else 0


def rebuild(board: Board, images: Sequence[Markers]) -> tuple[Board, int] | None:
    """The board of the same kind whose layout explains the markers best, and how many it explains.

    Rows beyond the last marker seen cannot be known: the fewest that hold it are taken. None where
    nothing fits.
    """
    ids = [image.id.max() for image in images if image.id.size >= LEAST_MARKERS]
    if not ids or board.kind not in ("charuco", "arucogrid"):
        return None
    best: tuple[Board, int] | None = None
    seen, counts = np.unique(np.concatenate([image.id for image in images]), return_counts=True)
    often = seen[counts >= 2]
    lasts = {int(np.median(ids)), int(often.max())} if often.size else {int(np.median(ids))}
    for columns, last in product(COUNTS, sorted(lasts)):
        for trial in _boards(board, columns, last):
            score = sum(agreement(trial, image) for image in images)
            if score > 0 and (best is None or score > best[1]):
                best = (trial, score)
    return best


def _boards(board: Board, columns: int, last: int) -> list[Board]:
    """Boards of so many columns that just hold marker ``last``, of both patterns."""
    rows = next((r for r in COUNTS if markers_on(board.kind, columns, r) > last), None)
    if rows is None:
        return []
    made = replace(board, columns=columns, rows=rows, legacy=False)
    if board.kind != "charuco":
        return [made]
    more = rows + 1 if rows % 2 else rows  # legacy differs for even row counts alone
    return [made, replace(made, rows=more, legacy=True)]
