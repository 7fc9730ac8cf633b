"""Live guidance: what the board has shown so far, what to show next, and when it is enough.

The same code serves a running capture, the app and ``calibrate --preview``. Views are taken one by
one; a view that shows nothing new is not counted.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.coverage import CELLS
from olivevib.calibration.forecast import Forecast, forecast
from olivevib.calibration.views import BoardView

LEAST_PAIRS, LEAST_SHARE, LEAST_TILTS, LEAST_DEPTH = 20, 0.6, 3, 1.4
SURE = 5e-4  # sigma of the depth over the distance below which empty cells do not matter
TILTED = 0.08  # change of distance across the board from which it counts as tilted
TILTS = ("left", "right", "upper", "lower")  # the side that is nearer to the camera
MOVED_SHARE = 0.04  # of the picture's width (or of the distance), to a view that counts anew
PAIR_S = 0.06  # both cameras' views of one instant: two frames at 30 a second
LEAST_POINTS = 6
FORECAST_FROM, FORECAST_EVERY, FORECAST_MOST = 8, 4, 40  # common views

Size = tuple[int, int]


@dataclass(frozen=True)
class Guidance:
    """How far a recording of the board is.

    cells: share of each picture in which the board was seen; seen: the same by cell (rows,
    columns); pairs: common views that show something new; tilts: how many sides of the board were
    nearer to the cameras, still: which were not yet; far_to_near: largest over smallest distance;
    forecast: sigma to expect, None before enough views; words: what to show next, or that it is
    enough now.
    """

    cells: dict[str, float]
    seen: dict[str, Bools] = field(repr=False)
    pairs: int
    tilts: int
    still: tuple[str, ...]
    far_to_near: float
    forecast: Forecast | None
    enough: bool
    words: str

    @property
    def measures(self) -> str:
        """How many views, tilts and distances there are, of how many, in words."""
        sides = [f"{side} {'yes' if side not in self.still else '--'}" for side in TILTS]
        return (
            f"{self.pairs} of {LEAST_PAIRS} views · nearer side: {', '.join(sides)} "
            f"({self.tilts} of {LEAST_TILTS}) · farthest {self.far_to_near:.1f} times nearest "
            f"(of {LEAST_DEPTH:g})"
        )

    @property
    def advice(self) -> str:
        """What to show next, and what the calibration would know now."""
        return self.words if self.forecast is None else f"{self.words}; {self.forecast.words}"


class Guide:
    """Collects views of the board of both cameras."""

    def __init__(self) -> None:
        self._seen = {side: np.zeros(CELLS[::-1], dtype=np.bool_) for side in ("left", "right")}
        self._sizes: dict[str, Size] = {}
        self._last: dict[str, tuple[BoardView, Floats]] = {}
        self._places: list[Floats] = []  # of the left views of pairs that count
        self._pairs: list[tuple[BoardView, BoardView]] = []
        self._tilts: set[str] = set()
        self._widths: list[float] = []
        self._forecast: Forecast | None = None

    def add(self, side: str, view: BoardView, size_px: Size) -> None:
        """Take a view of one camera."""
        width = size_px[0]
        self._sizes[side] = size_px
        self._seen[side] |= covered(view, size_px)
        self._tilts |= tilts_of(view)
        spread = float(np.ptp(view.px, axis=0).max())
        place = np.array([*view.px.mean(axis=0) / width, spread / width, *tilt_of(view)])
        self._last[side] = (view, place)
        self._widths.append(px_per_mm(view))
        self._count_pair()

    def state(self) -> Guidance:
        """How far it is, and where to go next."""
        cells = {side: float(seen.mean()) for side, seen in self._seen.items()}
        todo = self._todo(cells)
        words = "enough now: end the recording" if not todo else f"show the board {todo}"
        return Guidance(
            cells=cells,
            seen={side: seen.copy() for side, seen in self._seen.items()},
            pairs=len(self._pairs),
            tilts=len(self._tilts),
            still=tuple(t for t in TILTS if t not in self._tilts),
            far_to_near=self._far_to_near(),
            forecast=self._forecast,
            enough=not todo,
            words=words,
        )

    def _count_pair(self) -> None:
        if len(self._last) < 2:
            return
        (left, place), (right, _) = self._last["left"], self._last["right"]
        if abs(left.t_s - right.t_s) > PAIR_S:
            return
        if all(np.abs(place - known).max() > MOVED_SHARE for known in self._places):
            number = len(self._pairs)
            nan = float("nan")
            self._places.append(place)
            self._pairs.append(
                (replace(left, frame=number, t_s=nan), replace(right, frame=number, t_s=nan))
            )
            if number + 1 >= FORECAST_FROM and (number + 1) % FORECAST_EVERY == 0:
                self._look_ahead()

    def _look_ahead(self) -> None:
        step = -(-len(self._pairs) // FORECAST_MOST)
        left, right = (list(views) for views in zip(*self._pairs[::step], strict=True))
        found = forecast(left, right, self._sizes["left"], self._sizes["right"])
        self._forecast = found or self._forecast

    def _far_to_near(self) -> float:
        if len(self._widths) < 2:
            return 1.0
        low, high = np.quantile(self._widths, [0.05, 0.95])
        return float(high / low)

    def _sure(self) -> bool:
        """Whether what is known already is enough, whatever the pictures' corners show."""
        told = self._forecast
        return told is not None and told.depth_sigma_mm < SURE * told.distance_mm

    def _todo(self, cells: dict[str, float]) -> str:
        for side, share in cells.items():
            if share < LEAST_SHARE and not self._sure():
                return f"at the {gap(self._seen[side])} of the {side} picture"
        if len(self._tilts) < LEAST_TILTS:
            side = next(t for t in TILTS if t not in self._tilts)
            return f"with its {side} side nearer to the cameras"
        if self._far_to_near() < LEAST_DEPTH and not self._sure():
            return "nearer and farther away"
        if len(self._pairs) < LEAST_PAIRS:
            return f"in other places ({len(self._pairs)} of {LEAST_PAIRS} views)"
        return ""


def covered(view: BoardView, size_px: Size) -> Bools:
    """The cells of a picture (rows, columns) over which the board's points spread."""
    out = np.zeros(CELLS[::-1], dtype=np.uint8)
    scale = np.array(CELLS) / np.array(size_px)
    hull = cv2.convexHull(np.asarray(view.px * scale - 0.5, dtype=np.float32))
    cv2.fillConvexPoly(out, np.rint(hull).astype(np.int32), 1)
    inside = np.clip((view.px * scale).astype(np.int64), 0, np.array(CELLS) - 1)
    out[inside[:, 1], inside[:, 0]] = 1
    return np.asarray(out > 0)


def gap(seen: Bools) -> str:
    """Where in a picture the board is missing most, in words."""
    rows, columns = np.nonzero(~seen)
    across, down = (columns.mean() + 0.5) / CELLS[0], (rows.mean() + 0.5) / CELLS[1]
    vertical = "upper" if down < 0.4 else "lower" if down > 0.6 else ""
    horizontal = "left" if across < 0.4 else "right" if across > 0.6 else ""
    return " ".join(w for w in (vertical, horizontal) if w) or "rim"


def px_per_mm(view: BoardView) -> float:
    """How large the board is seen: the larger stretch of its local scale."""
    plane = view.board_mm[:, :2]
    slope = np.linalg.lstsq(plane - plane.mean(axis=0), view.px - view.px.mean(axis=0), rcond=None)
    return float(np.linalg.svd(slope[0], compute_uv=False)[0])


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
