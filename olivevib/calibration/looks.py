"""Ways of looking at pictures of a board, what each found, and the diagnosis that comes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Grey
from olivevib.calibration.boards import Board
from olivevib.calibration.finding import BoardFinder
from olivevib.calibration.views import BoardView
from olivevib.detection.detection import Reader

ENOUGH = 0.25  # share of the sample in which a board must be found to count as recognised
OTHER_DICTIONARIES = (
    *("DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000"),
    *("DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36H11", "DICT_ARUCO_MIP_36H12"),
)

Look = Callable[[Grey], Grey]


@dataclass(frozen=True)
class Attempt:
    """One way of looking: what was done, and in how many of the frames the board was found."""

    what: str
    found: int
    of: int


@dataclass(frozen=True)
class Diagnosis:
    """What is the matter with a recording of the board.

    cause: "sound", "inverted", "mirrored", "turned-180", "wrong-counts", "wrong-dictionary",
    "wrong-ids", "wrong-kind" (another kind of board), "unsteady" (there, but never whole and
    sharp enough to be measured) or "unknown"; text and remedy for people; board: the description
    that works (None where none was found); attempts: all that was tried.
    """

    cause: str
    text: str
    remedy: str
    board: Board | None
    attempts: tuple[Attempt, ...]

    @property
    def tried(self) -> str:
        """All that was tried, for people: ``inverted, mirrored, turned, ...``."""
        return ", ".join(attempt.what for attempt in self.attempts[1:])


def as_is(grey: Grey) -> Grey:
    """The image itself."""
    return grey


def flipped(grey: Grey) -> Grey:
    """The image with left and right exchanged."""
    return np.ascontiguousarray(grey[:, ::-1])


def turned(grey: Grey) -> Grey:
    """The image turned by 90 degrees."""
    return np.ascontiguousarray(np.rot90(grey))


def upside_down(grey: Grey) -> Grey:
    """The image turned by 180 degrees."""
    return np.ascontiguousarray(grey[::-1, ::-1])


def inverted(grey: Grey) -> Grey:
    """The image with black and white exchanged."""
    return np.asarray(255 - grey, dtype=np.uint8)


def enough(count: int, frames: Sequence[Grey]) -> bool:
    """Whether a board found in ``count`` of the frames counts as recognised."""
    return count >= max(1, ENOUGH * len(frames))


def views_of(
    board: Board, frames: Sequence[Grey], look: Look, reader: Reader | None
) -> list[BoardView]:
    """The board in each frame that shows it, after ``look``."""
    finder = BoardFinder(board, reader)
    seen = (finder.find(look(grey), k) for k, grey in enumerate(frames))
    return [view for view in seen if view is not None]
