"""How well a recording of the calibration board covers both pictures, and whether it is enough."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.views import BoardView

CELLS = (4, 3)  # of a picture, across and down
LEAST_PAIRS, LEAST_SHARE, LEAST_TILTS = 20, 0.8, 3
TILTED = 0.08  # change of distance across the board from which it counts as tilted
TILTS = ("left", "right", "upper", "lower")  # the side that is nearer to the camera
MOVED_SHARE = 0.04  # of the picture's width (or of the distance), to a view that counts anew
PAIR_S = 0.06  # both cameras' views of one instant: two frames at 30 a second
LEAST_POINTS = 6

Size = tuple[int, int]


@dataclass(frozen=True)
class Coverage:
    """cells: share of each picture in which the board was seen; words: what to show next."""

    cells: dict[str, float]
    pairs: int
    tilts: int
    enough: bool
    words: str


class BoardCoverage:
    """Collects views of the board; a view that shows nothing new is not counted."""

    def __init__(self) -> None:
        self._seen = {side: np.zeros(CELLS[::-1], dtype=np.bool_) for side in ("left", "right")}
        self._last: dict[str, tuple[float, Floats]] = {}
        self._pairs: list[Floats] = []  # left middles of pairs that count
        self._tilts: set[str] = set()

    def add(self, side: str, view: BoardView, size_px: Size) -> None:
        """Take a view of one camera."""
        width, height = size_px
        column = np.clip(view.px[:, 0] * CELLS[0] / width, 0, CELLS[0] - 1).astype(np.int64)
        row = np.clip(view.px[:, 1] * CELLS[1] / height, 0, CELLS[1] - 1).astype(np.int64)
        self._seen[side][row, column] = True
        self._tilts |= tilts_of(view)
        spread = float(np.ptp(view.px, axis=0).max())
        place = np.array([*view.px.mean(axis=0) / width, spread / width, *tilt_of(view)])
        self._last[side] = (view.t_s, place)
        self._count_pair()

    def state(self) -> Coverage:
        """How far it is, and where to go next."""
        cells = {side: float(seen.mean()) for side, seen in self._seen.items()}
        todo = self._todo(cells)
        words = "enough now: end the recording" if not todo else f"show the board {todo}"
        return Coverage(cells, len(self._pairs), len(self._tilts), not todo, words)

    def _count_pair(self) -> None:
        if len(self._last) < 2:
            return
        (t_left, place), (t_right, _) = self._last["left"], self._last["right"]
        if abs(t_left - t_right) > PAIR_S:
            return
        if all(np.abs(place - known).max() > MOVED_SHARE for known in self._pairs):
            self._pairs.append(place)

    def _todo(self, cells: dict[str, float]) -> str:
        for side, share in cells.items():
            if share < LEAST_SHARE:
                return f"at the {self._gap(side)} of the {side} picture"
        if len(self._tilts) < LEAST_TILTS:
            side = next(t for t in TILTS if t not in self._tilts)
            return f"with its {side} side nearer to the cameras"
        if len(self._pairs) < LEAST_PAIRS:
            return f"at other distances ({len(self._pairs)} of {LEAST_PAIRS} views)"
        return ""

    def _gap(self, side: str) -> str:
        """Where in a picture the board is missing most, in words."""
        rows, columns = np.nonzero(~self._seen[side])
        across = (columns.mean() + 0.5) / CELLS[0]
        down = (rows.mean() + 0.5) / CELLS[1]
        vertical = "upper" if down < 0.4 else "lower" if down > 0.6 else ""
        horizontal = "left" if across < 0.4 else "right" if across > 0.6 else ""
        return " ".join(w for w in (vertical, horizontal) if w) or "rim"


def tilt_of(view: BoardView) -> tuple[float, float]:
    """How much farther, in shares of its distance, the board's right and lower sides are."""
    plane = view.board_mm[:, :2].astype(np.float64)
    if len(plane) < LEAST_POINTS:
        return 0.0, 0.0
    H, _ = cv2.findHomography(plane, view.px, cv2.RANSAC, 3.0)
    if H is None or not np.isfinite(H).all():
        return 0.0, 0.0
    depth = plane @ H[2, :2] + H[2, 2]
    place = np.column_stack([np.ones(len(plane)), view.px])
    (_, by_x, by_y), *_ = np.linalg.lstsq(place, depth / depth.mean(), rcond=None)
    across, down = np.ptp(view.px, axis=0) * np.array([by_x, by_y])
    return float(across), float(down)


def tilts_of(view: BoardView) -> set[str]:
    """Which sides of the board, as seen in the picture, are nearer to the camera."""
    across, down = tilt_of(view)
    out = set()
    if abs(across) > TILTED:
        out.add("left" if across > 0 else "right")
    if abs(down) > TILTED:
        out.add("upper" if down > 0 else "lower")
    return out
