"""What the cameras saw of the board: one BoardView a frame, and which frames belong together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints, floats, ints


@dataclass(frozen=True)
class BoardView:
    """The board in one frame of one camera.

    frame: number of the frame (or still); t_s: its stamp in s, NaN for stills; ids (N,) point ids
    of the board, rising; px (N, 2) their images; board_mm (N, 3) their places on the board;
    sigma_px (N,) what the localiser claims for each coordinate (a single number is spread; only
    the ratios within a camera matter, the common scale is estimated).
    """

    frame: int
    t_s: float
    ids: Ints
    px: Floats
    board_mm: Floats
    sigma_px: Floats

    def __post_init__(self) -> None:
        ids = ints("ids", self.ids, (None,))
        n = ids.size
        if (np.diff(ids) <= 0).any():
            raise ValueError("the point ids of a view must rise")
        object.__setattr__(self, "ids", ids)
        object.__setattr__(self, "px", floats("px", self.px, (n, 2)))
        object.__setattr__(self, "board_mm", floats("board_mm", self.board_mm, (n, 3)))
        sigma = np.broadcast_to(np.asarray(self.sigma_px, dtype=np.float64), (n,))
        object.__setattr__(self, "sigma_px", floats("sigma_px", sigma, (n,)))
        if (sigma <= 0).any():
            raise ValueError("sigma_px must be positive")

    def only(self, keep: Bools) -> BoardView:
        """The same view with the points ``keep`` (N,) alone."""
        return replace(
            self,
            ids=self.ids[keep],
            px=self.px[keep],
            board_mm=self.board_mm[keep],
            sigma_px=self.sigma_px[keep],
        )


def pair_views(left: Sequence[BoardView], right: Sequence[BoardView]) -> list[tuple[int, int]]:
    """Which views show the same instant: pairs (index in left, index in right), by rising time.

    By nearest stamp, within half a frame period, where every view carries a stamp; else by equal
    frame number.
    """
    if not left or not right:
        return []
    if stamped(left) and stamped(right):
        return _by_stamp(times(left), times(right))
    at = {view.frame: k for k, view in enumerate(right)}
    pairs = [(k, at[view.frame]) for k, view in enumerate(left) if view.frame in at]
    return sorted(pairs, key=lambda pair: left[pair[0]].frame)


def _by_stamp(t_left: Floats, t_right: Floats) -> list[tuple[int, int]]:
    """Mutual nearest neighbours in time, within half of the shorter frame period."""
    gap = np.abs(t_left[:, None] - t_right[None, :])
    to_right, to_left = gap.argmin(axis=1), gap.argmin(axis=0)
    limit = 0.5 * min(frame_period_s(t_left), frame_period_s(t_right))
    pairs = [(k, int(m)) for k, m in enumerate(to_right) if to_left[m] == k and gap[k, m] <= limit]
    return sorted(pairs, key=lambda pair: t_left[pair[0]])


def times(views: Sequence[BoardView]) -> Floats:
    """The stamps (V,) of the views, s."""
    return np.array([view.t_s for view in views], dtype=np.float64)


def stamped(views: Sequence[BoardView]) -> bool:
    """Whether every view carries a stamp and the stamps differ: a video, not stills."""
    t = times(views)
    return bool(t.size > 1 and np.isfinite(t).all() and np.ptp(t) > 0)


def frame_period_s(t_s: Floats) -> float:
    """The time between neighbouring frames, s: the lower quartile of the gaps (inf: one frame)."""
    gaps = np.diff(np.sort(t_s))
    gaps = gaps[gaps > 1e-6]
    return float(np.quantile(gaps, 0.25)) if gaps.size else float("inf")


def common_ids(a: BoardView, b: BoardView) -> Ints:
    """The point ids (N,) that both views show."""
    return np.intersect1d(a.ids, b.ids, assume_unique=True).astype(np.int64)
