"""Why was no board found: the board and the image tried in other ways, and told in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from olivevib.arrays import Grey
from olivevib.calibration.boards import Board
from olivevib.calibration.layouts import Markers, agreement, read_markers, rebuild
from olivevib.calibration.looks import (
    ENOUGH,
    OTHER_DICTIONARIES,
    Attempt,
    Diagnosis,
    Look,
    as_is,
    enough,
    flipped,
    inverted,
    turned,
    upside_down,
    views_of,
)
from olivevib.calibration.other_kinds import carried_markers, plain_squares
from olivevib.calibration.views import BoardView
from olivevib.detection.detection import Reader
from olivevib.progress import Tick, silent


def diagnose(
    board: Board, frames: Sequence[Grey], reader: Reader | None = None, tick: Tick = silent
) -> Diagnosis:
    """Try the sample ``frames`` as declared, inverted, mirrored, turned, and with other boards.

    Other boards: other columns and rows, other dictionaries, other ids. A dozen frames spread over
    the recording are enough; the board is recognised where it is found in a quarter of them.
    """
    attempts: list[Attempt] = []
    steps = len(_LOOKS) + 2
    looks = _LOOKS[:1] if board.kind == "chessboard" else _LOOKS  # it looks the same in all
    for k, (cause, what, look) in enumerate(looks):
        tick(k, steps, what)
        views = views_of(board, frames, look, reader)
        attempts.append(Attempt(what, len(views), len(frames)))
        if enough(len(views), frames) and _carries(board, frames, look):
            return _found(cause, board, views, attempts)
    few = frames[:: max(1, len(frames) // 5)]
    if board.dictionary:
        for search in (_other_counts, _other_dictionary):
            tick(steps - 2, steps, "looking for other boards")
            told = search(board, frames if search is _other_counts else few, attempts)
            if told is not None:
                return told
    elif reader is not None:
        told = _other_ids(board, frames, reader, attempts)
        if told is not None:
            return told
    for kind in (carried_markers, plain_squares):
        told = kind(board, few, attempts)
        if told is not None:
            return told
    return _nothing(board, frames, attempts)


_LOOKS: tuple[tuple[str, str, Look], ...] = (
    ("sound", "as declared", as_is),
    ("inverted", "inverted", inverted),
    ("mirrored", "mirrored", flipped),
    ("mirrored", "mirrored and inverted", lambda grey: inverted(flipped(grey))),
    ("turned-90", "turned by 90 degrees", turned),
    ("turned-180", "turned by 180 degrees", upside_down),
)


def _carries(board: Board, frames: Sequence[Grey], look: Look) -> bool:
    """Whether the markers lie where a grid carries them; other boards are told by their corners."""
    if board.kind != "arucogrid":
        return True
    readings = _readings(board, board.dictionary, frames, look)
    seen = sum(image.id.size for image in readings)
    return sum(agreement(board, image) for image in readings) >= 0.5 * seen


def roll_deg(views: Sequence[BoardView]) -> float:
    """By how much the board stands turned in the image, degrees: the middle of all views."""
    ends = []
    for view in views:
        design = np.column_stack([view.board_mm[:, :2], np.ones(view.ids.size)])
        slope = np.linalg.lstsq(design, view.px, rcond=None)[0][0]
        ends.append(slope / np.linalg.norm(slope))
    middle = np.median(np.array(ends), axis=0)
    return float(np.degrees(np.arctan2(middle[1], middle[0])))


def _lying(views: Sequence[BoardView]) -> str:
    """Words where the board lies on its side in most views: the camera may be mounted so."""
    roll = abs(roll_deg(views))
    return (
        " The board lies on its side: unless it was held so, the camera is turned by 90 degrees."
        if 60 < roll < 120
        else ""
    )


def _found(
    cause: str, board: Board, views: Sequence[BoardView], attempts: Sequence[Attempt]
) -> Diagnosis:
    last = attempts[-1]
    share = f"in {last.found} of {last.of} frames"
    side = _lying(views)
    turned_board = replace(board, inverted=not board.inverted)
    word = "not inverted" if board.inverted else "inverted (white on black)"
    also = f" The print is {word} as well." if "inverted" in last.what else ""
    told: dict[str, tuple[str, str, Board | None]] = {
        "sound": (f"The board was found {share} as declared.{side}", "", board),
        "inverted": (
            f"The print is {'not ' if board.inverted else ''}inverted (white on black): the board "
            f"was found {share} so.{side}",
            f"Use --board {turned_board.spec}",
            turned_board if board.kind != "coded" else None,
        ),
        "mirrored": (
            f"The video is mirrored: no board as it is, but {share} after exchanging left and "
            f"right.{also}{side}",
            "Switch the mirror of the webcam's software off and record again, or flip the file; "
            "the trial of this camera is mirrored too.",
            turned_board if "inverted" in last.what else board,
        ),
        "turned-90": (
            f"The video is turned by 90 degrees: the board was found {share} after turning it.",
            "Turn the recording the right way up.",
            board,
        ),
        "turned-180": (
            f"The video is upside down: the board was found {share} after turning it.",
            "Turn the recording the right way up.",
            board,
        ),
    }
    text, remedy, works = told[cause]
    return Diagnosis(cause, text, remedy, works, tuple(attempts))


def _readings(board: Board, dictionary: str, frames: Sequence[Grey], look: Look) -> list[Markers]:
    polarity = inverted if board.inverted else as_is
    return [read_markers(dictionary, polarity(look(grey))) for grey in frames]


def _other_counts(
    board: Board, frames: Sequence[Grey], attempts: list[Attempt]
) -> Diagnosis | None:
    """Columns and rows rebuilt from the ids, for every look that gives markers."""
    best: tuple[Board, int] | None = None
    for flip in (as_is, flipped):
        for negative in (False, True):
            trial = replace(board, inverted=negative)
            rebuilt = rebuild(trial, _readings(trial, board.dictionary, frames, flip))
            if rebuilt is not None and (best is None or rebuilt[1] > best[1]):
                best = rebuilt
                mirror = flip is flipped
    count = 0
    if best is not None:
        look = flipped if mirror else as_is
        count = len(views_of(best[0], frames, look, None))
    attempts.append(Attempt("other columns and rows", count, len(frames)))
    if best is None or not enough(count, frames):
        return None
    also = " The video is mirrored as well." if mirror else ""
    return Diagnosis(
        "wrong-counts",
        f"The markers belong to a board of {best[0].columns} columns and {best[0].rows} rows"
        f"{', in the legacy pattern' if best[0].legacy else ''}, not {board.columns}x{board.rows}: "
        f"found so in {count} of {len(frames)} frames.{also}",
        f"Use --board {best[0].spec} (more rows, if the last were never seen)",
        best[0],
        tuple(attempts),
    )


def _other_dictionary(
    board: Board, frames: Sequence[Grey], attempts: list[Attempt]
) -> Diagnosis | None:
    """The same layout with markers of another dictionary."""
    best: tuple[Board, int] | None = None
    for name in OTHER_DICTIONARIES:
        for negative in (False, True):
            trial = replace(board, dictionary=name, inverted=negative)
            readings = _readings(trial, name, frames, as_is)
            score = sum(agreement(trial, image) > 0 for image in readings)
            if score and name != board.dictionary and (best is None or score > best[1]):
                best = (trial, score)
    count = len(views_of(best[0], frames, as_is, None)) if best is not None else 0
    attempts.append(Attempt("other dictionaries", count, len(frames)))
    if best is None or not enough(count, frames):
        return None
    return Diagnosis(
        "wrong-dictionary",
        f"The markers are of {best[0].dictionary}, not {board.dictionary}: found so in {count} of "
        f"{len(frames)} frames.",
        f"Use --board {best[0].spec} (or the smaller dictionary of that family)",
        best[0],
        tuple(attempts),
    )


def _other_ids(
    board: Board, frames: Sequence[Grey], reader: Reader, attempts: list[Attempt]
) -> Diagnosis | None:
    """Markers of the library that this board does not carry."""
    seen = np.concatenate([[d.id for d in reader.detect(grey)] for grey in frames]).astype(np.int64)
    ids, counts = np.unique(seen, return_counts=True)
    often = ids[counts >= max(2, ENOUGH * len(frames))]
    attempts.append(Attempt("other ids", int(often.size > 0) * len(frames), len(frames)))
    if often.size < 4:
        return None
    return Diagnosis(
        "wrong-ids",
        f"Markers are seen, but not those of the board: ids {often.min()} to {often.max()}.",
        f"State the id of the first marker, such as first={often.min()}, and columns and rows.",
        replace(board, first=int(often.min())),
        tuple(attempts),
    )


def _nothing(board: Board, frames: Sequence[Grey], attempts: list[Attempt]) -> Diagnosis:
    tried = ", ".join(attempt.what for attempt in attempts[1:])
    if board.kind == "chessboard":
        tried += " (inverted, mirrored or turned it would be found as well)"
    bright = float(np.median([np.quantile(grey, 0.95) for grey in frames])) if frames else 0.0
    hint = " The pictures are very dark." if bright < 60 else ""
    return Diagnosis(
        "unknown",
        f"No board found in {len(frames)} frames; tried {tried}.{hint}",
        f"Check that the recording shows the {board.name}, whole, in focus and lit evenly, its "
        "smallest marker at least 20 px wide, and that --board describes it (columns x rows).",
        None,
        tuple(attempts),
    )
