"""Boards of another kind than declared: squares without markers, markers within the squares.

Every board that is proposed was found with the finder that will be used for it; where it is there
but cannot be measured, the remedy is about the recording, never the description that failed.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from olivevib.arrays import Grey
from olivevib.calibration.boards import Board
from olivevib.calibration.layouts import LEAST_MARKERS, Markers, read_markers, rebuild
from olivevib.calibration.looks import (
    ENOUGH,
    OTHER_DICTIONARIES,
    Attempt,
    Diagnosis,
    as_is,
    enough,
    inverted,
    views_of,
)

STEADY = (
    "Show the whole board with the white rim around it, still for a second in each place, large, "
    "in focus and evenly lit, and record again."
)


def carried_markers(
    board: Board, frames: Sequence[Grey], attempts: list[Attempt]
) -> Diagnosis | None:
    """A chessboard that carries markers in its squares: it is a ChArUco board."""
    if board.kind != "chessboard":
        return None
    best: tuple[str, bool, list[Markers]] | None = None
    for name in OTHER_DICTIONARIES:
        for look in (as_is, inverted):
            seen = [read_markers(name, look(grey)) for grey in frames]
            if best is None or _rich(seen) > _rich(best[2]):
                best = (name, look is inverted, seen)
    count = _rich(best[2]) if best else 0
    attempts.append(Attempt("markers in the squares", count, len(frames)))
    if best is None or not enough(count, frames):
        return None
    name, negative, seen = best
    square = board.lengths_mm["square"]
    lengths = {"square": square, "marker": 0.75 * square}
    guess = Board("charuco", 4, 5, lengths, dictionary=name, inverted=negative)
    found = rebuild(guess, seen)
    size = f"{found[0].columns}x{found[0].rows}" if found else "COLUMNSxROWS"
    spec = f"charuco:{size},square={square:g},marker=MM,dict={name}{',inverted' * negative}"
    return Diagnosis(
        "wrong-kind",
        f"Its squares carry markers of {name} (in {count} of {len(frames)} frames): it is a "
        "ChArUco board, not a chessboard.",
        f"Use --board {spec}, with the side of a marker as measured for MM; columns and rows count "
        "squares, not corners (more rows, if the last were never seen)",
        None,
        tuple(attempts),
    )


def _rich(seen: Sequence[Markers]) -> int:
    """In how many images there are enough markers to tell a board."""
    return sum(image.id.size >= LEAST_MARKERS for image in seen)


def plain_squares(
    board: Board, frames: Sequence[Grey], attempts: list[Attempt]
) -> Diagnosis | None:
    """A plain chessboard of any size, whatever was declared."""
    if board.kind not in ("chessboard", "charuco"):
        return None
    sizes = [size for grey in frames if (size := _chessboard_size(grey)) is not None]
    most = max(set(sizes), key=sizes.count) if sizes else (0, 0)
    count = sizes.count(most)
    what = "other columns and rows" if board.kind == "chessboard" else "a plain chessboard"
    attempts.append(Attempt(what, count, len(frames)))
    if count < max(2, ENOUGH * len(frames)):  # blots may look like corners once
        return None
    columns, rows = most if board.columns >= board.rows else most[::-1]
    works = Board("chessboard", columns, rows, {"square": board.lengths_mm["square"]})
    declared = {board.columns, board.rows} == set(most) and board.kind == "chessboard"
    measured = enough(len(views_of(works, frames, as_is, None)), frames)
    if not declared and not measured:  # texture may look like a few corners
        return None
    if declared:
        return Diagnosis(
            "unsteady",
            f"A chessboard of {columns}x{rows} inner corners, as declared, shows in {count} of "
            f"{len(frames)} frames, but never whole and sharp enough to be measured.",
            STEADY,
            board,
            tuple(attempts),
        )
    if board.kind == "charuco":
        return Diagnosis(
            "wrong-kind",
            f"It is a plain chessboard of {columns}x{rows} inner corners, without markers: found "
            f"so in {count} of {len(frames)} frames.",
            f"Use --board {works.spec}",
            works,
            tuple(attempts),
        )
    return Diagnosis(
        "wrong-counts",
        f"The board has {columns}x{rows} inner corners, not {board.columns}x{board.rows}: found "
        f"so in {count} of {len(frames)} frames.",
        f"Use --board {works.spec}",
        works,
        tuple(attempts),
    )


def _chessboard_size(grey: Grey) -> tuple[int, int] | None:
    """Inner corners of the largest chessboard in an image, the larger count first."""
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, _, cells = cv2.findChessboardCornersSBWithMeta(grey, (3, 3), flags)
    if not found:
        return None
    rows, columns = np.asarray(cells).shape[:2]
    return max(rows, columns), min(rows, columns)
