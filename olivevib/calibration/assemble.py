"""Board views to the arrays of the joint problem: poses, chains, corner tracks in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.calibration.bundle import LEFT, RIGHT, RIGHT_ALONE, Observations
from olivevib.calibration.tracks import ORDERS, Samples, at_rest, motion_at, shifted, tabulate
from olivevib.calibration.views import BoardView, pair_views, times
from olivevib.geometry import CameraModel

LEAST_POINTS = 4  # points of a view that fix its pose


@dataclass(frozen=True)
class BoardShape:
    """What the bow needs to know of a board: its middle (2,) and half-width, mm."""

    centre_mm: Floats
    half_mm: float


def shape_of(views: Sequence[BoardView]) -> BoardShape:
    """Middle and half-width of the board from all points that were seen."""
    points = np.concatenate([view.board_mm[:, :2] for view in views])
    low, high = points.min(axis=0), points.max(axis=0)
    return BoardShape((low + high) / 2, float((high - low).max()) / 2)


@dataclass(frozen=True)
class Side:
    """One camera's views: its model (size, row time), whether stamps make tracks in time.

    views are those that count; track_views all that were found, for the tracks; reference_row is
    the row at which stamps hold; row_time_s the row time used in the tracks.
    """

    views: tuple[BoardView, ...]
    track_views: tuple[BoardView, ...]
    camera: CameraModel
    timed: bool
    reference_row: float
    row_time_s: float

    def samples(self) -> Samples:
        """The corner tracks of this camera."""
        return tabulate(self.track_views, self.row_time_s, self.reference_row)

    def with_scale(self, scale: float) -> Side:
        """The same views, every sigma times ``scale``."""
        a, b = (
            tuple(replace(view, sigma_px=view.sigma_px * scale) for view in views)
            for views in (self.views, self.track_views)
        )
        return replace(self, views=a, track_views=b)

    def only(self, keep: Sequence[int]) -> Side:
        """The views ``keep`` alone count; the tracks stay."""
        return replace(self, views=tuple(self.views[k] for k in keep))


@dataclass(frozen=True)
class Table:
    """The points of some views in one table: index of the view, id, place, pixel, sigma."""

    view: Ints
    id: Ints
    board_mm: Floats
    px: Floats
    sigma_px: Floats


def table_of(views: Sequence[BoardView]) -> Table:
    """All points of the views, row by row."""
    counts = [view.ids.size for view in views]
    if not views:
        return Table(np.zeros(0, np.int64), np.zeros(0, np.int64), *_empty())
    return Table(
        np.repeat(np.arange(len(views)), counts),
        np.concatenate([view.ids for view in views]),
        np.concatenate([view.board_mm for view in views]),
        np.concatenate([view.px for view in views]),
        np.concatenate([view.sigma_px for view in views]),
    )


def _empty() -> tuple[Floats, Floats, Floats]:
    return np.zeros((0, 3)), np.zeros((0, 2)), np.zeros(0)


def flatten(side: Side, pick: Ints, chain: int, poses: Ints, shape: BoardShape) -> Observations:
    """Observations of the views ``pick`` of one camera, each in its own board pose, own instant."""
    views = [side.views[k] for k in pick]
    table = table_of(views)
    track = np.zeros((table.id.size, ORDERS[-1], 2))
    track[:, 0] = table.px
    if side.timed and views:
        local = motion_at(side.samples(), table.id, times(views)[table.view])
        local.coefficients[at_rest(local, table.view), 1:] = 0.0
        track[local.ok] = local.coefficients[local.ok]
    return _observations(side, shape, chain, poses[table.view], table, track)


def _observations(
    side: Side, shape: BoardShape, chain: int, pose: Ints, table: Table, track: Floats
) -> Observations:
    row_time = np.zeros(2)
    row_time[0 if chain == LEFT else 1] = side.row_time_s
    return Observations(
        chain=np.full(table.id.size, chain, dtype=np.int64),
        pose=pose,
        ids=table.id,
        board_mm=table.board_mm,
        track=track,
        row=table.px[:, 1] - side.reference_row,
        row_time_s=row_time,
        sigma_px=table.sigma_px,
        centre_mm=shape.centre_mm,
        half_mm=shape.half_mm,
        poses=int(pose.max(initial=-1)) + 1,
    )


def join(parts: Sequence[Observations]) -> Observations:
    """One set of observations, sorted by chain."""
    order = np.argsort(np.concatenate([part.chain for part in parts]), kind="stable")
    return replace(
        parts[0],
        chain=np.concatenate([part.chain for part in parts])[order],
        pose=np.concatenate([part.pose for part in parts])[order],
        ids=np.concatenate([part.ids for part in parts])[order],
        board_mm=np.concatenate([part.board_mm for part in parts])[order],
        track=np.concatenate([part.track for part in parts])[order],
        row=np.concatenate([part.row for part in parts])[order],
        sigma_px=np.concatenate([part.sigma_px for part in parts])[order],
        row_time_s=np.sum([part.row_time_s for part in parts[:2]], axis=0),
        poses=max(part.poses for part in parts),
    )


@dataclass(frozen=True)
class Assembly:
    """Observations of the joint problem and which board pose each view shows (-1: none)."""

    observations: Observations
    left_pose: Ints
    right_pose: Ints


def assemble(left: Side, right: Side, shape: BoardShape, lag_s: Floats) -> Assembly:
    """All observations, the right camera's tracks evaluated about ``lag_s`` (left views,).

    Board pose k is that of left view k; right views that no left view meets keep poses of their
    own and inform their lens alone.
    """
    n = len(left.views)
    own_left = flatten(left, np.arange(n), LEFT, np.arange(n), shape)
    meet = _tracked if left.timed and right.timed else _by_frame
    matched, right_pose = meet(left, right, shape, lag_s)
    alone = np.flatnonzero([
        pose < 0 and view.ids.size >= LEAST_POINTS
        for pose, view in zip(right_pose, right.views, strict=True)
    ])  # fmt: skip
    right_pose[alone] = n + np.arange(alone.size)
    own_right = flatten(right, alone, RIGHT_ALONE, right_pose[alone], shape)
    return Assembly(join([own_left, matched, own_right]), np.arange(n), right_pose)


def _by_frame(
    left: Side, right: Side, shape: BoardShape, lag_s: Floats
) -> tuple[Observations, Ints]:
    pairs = np.array(pair_views(left.views, right.views), dtype=np.int64).reshape(-1, 2)
    met = np.full(len(right.views), -1, dtype=np.int64)
    met[pairs[:, 1]] = pairs[:, 0]
    return flatten(right, pairs[:, 1], RIGHT, pairs[:, 0], shape), met


def _tracked(
    left: Side, right: Side, shape: BoardShape, lag_s: Floats
) -> tuple[Observations, Ints]:
    """Where the right camera saw each point at each left view's stamp plus the lag."""
    samples, stamps, n = right.samples(), times(left.views), len(left.views)
    points = table_of(right.views)
    ids, first = np.unique(points.id, return_index=True)
    pose = np.repeat(np.arange(n), ids.size)
    local = motion_at(samples, np.tile(ids, n), (stamps + lag_s)[pose])
    local.coefficients[at_rest(local, pose), 1:] = 0.0
    enough = np.bincount(pose, local.ok, n) >= LEAST_POINTS
    keep = local.ok & enough[pose]
    px = local.coefficients[keep, 0]
    board = np.tile(points.board_mm[first], (n, 1))[keep]
    table = Table(pose[keep], np.tile(ids, n)[keep], board, px, local.sigma_px[keep])
    track = shifted(local.coefficients[keep], lag_s[pose[keep]])
    matched = _observations(right, shape, RIGHT, pose[keep], table, track)
    return matched, _met(right, np.flatnonzero(enough), stamps + lag_s, samples.period_s)


def _met(right: Side, used: Ints, query_s: Floats, period_s: float) -> Ints:
    """For each right view the left view (-1: none) whose query falls within half a period of it."""
    t = times(right.views)
    met = np.full(t.size, -1, dtype=np.int64)
    if used.size:
        gap = np.abs(t[:, None] - query_s[used][None, :])
        near = gap.argmin(axis=1)
        close = gap[np.arange(t.size), near] <= 0.5 * period_s
        met[close] = used[near[close]]
    return met
