"""The test on frames that the fit never saw: rigid distances, epipolar and depth errors.

Frames where both cameras see the board with enough common points are counted through in time; the
fit gets the even ones (and frames of one camera only), the test the odd ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints, floats
from olivevib.calibration.assemble import Side
from olivevib.calibration.bundle import State
from olivevib.calibration.rigid import epipolar_px, triangulate
from olivevib.calibration.tracks import motion_at
from olivevib.calibration.uncertainty import rig_sensitivity
from olivevib.calibration.views import BoardView, common_ids, pair_views, times
from olivevib.geometry import StereoRig

LARGEST_TRACK_PX = 0.5  # where a track in time is less sure than this, a pair is no test


@dataclass(frozen=True)
class HoldOut:
    """Errors on unused frames.

    frames, pairs: frames tested and distances measured; usable: share of the common points that
    could be compared (the rest: the board jerked, or left the image); rms, median (of absolute
    errors) and bias of the distances in mm and %; epipolar_rms_px; z_rms_mm: rms of the points'
    depth about the rigid board; reprojection_rms_px per axis after the board was placed rigidly;
    rms_z: rms of the distances' errors against their predicted sd (1: honest; NaN: not known).
    errors_percent (P,), errors_mm (P,) and frame (P,) of every distance.
    """

    frames: int
    pairs: int
    usable: float
    rms_percent: float
    median_percent: float
    bias_percent: float
    rms_mm: float
    median_mm: float
    bias_mm: float
    epipolar_rms_px: float
    z_rms_mm: float
    reprojection_rms_px: float
    rms_z: float
    errors_percent: Floats = field(repr=False)
    errors_mm: Floats = field(repr=False)
    frame: Ints = field(repr=False)
    method: str = "odd common frames, the fit used the even ones"

    def __post_init__(self) -> None:
        for name in ("errors_percent", "errors_mm"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (self.pairs,)))


def common_pairs(
    left: Sequence[BoardView], right: Sequence[BoardView], least: int
) -> list[tuple[int, int]]:
    """Indices of views in which both cameras see at least ``least`` common points, in time."""
    pairs = pair_views(left, right)
    return [(k, m) for k, m in pairs if common_ids(left[k], right[m]).size >= least]


def without(views: Sequence[BoardView], drop: Sequence[int]) -> list[BoardView]:
    """The views whose index is not in ``drop``."""
    gone = set(drop)
    return [view for k, view in enumerate(views) if k not in gone]


@dataclass(frozen=True)
class FrameTest:
    """One test frame: points in both images at one instant, and where they are in space."""

    frame: int
    board_mm: Floats
    left_px: Floats
    right_px: Floats
    xyz_mm: Floats
    epipolar_px: Floats
    sigma_px: Floats  # (N, 2) left, right
    wanted: int


def test_frame(
    rig: StereoRig, state: State, sides: tuple[Side, Side], pair: tuple[int, int]
) -> FrameTest:
    """Triangulate the common points of one frame, both images taken to the same instant."""
    left, right = (side.views[k] for side, k in zip(sides, pair, strict=True))
    if sides[1].timed:
        gap = np.abs(times(sides[1].views) - left.t_s - state.lag_s)
        right = sides[1].views[int(gap.argmin())]
    ids = common_ids(left, right)
    place = left.board_mm[np.searchsorted(left.ids, ids)]
    a, sigma_a, ok_a = _at_instant(sides[0], left, ids, 0.0)
    b, sigma_b, ok_b = _at_instant(sides[1], right, ids, left.t_s + state.lag_s - right.t_s)
    ok = ok_a & ok_b
    xyz, _, _ = triangulate(rig, a[ok], b[ok])
    miss, sigma = epipolar_px(rig, a[ok], b[ok]), np.column_stack([sigma_a[ok], sigma_b[ok]])
    return FrameTest(left.frame, place[ok], a[ok], b[ok], xyz, miss, sigma, ids.size)


def _at_instant(
    side: Side, view: BoardView, ids: Ints, later_s: float
) -> tuple[Floats, Floats, Bools]:
    """Pixels (N, 2), sigmas (N,) of points of a view some time later, and which are sure."""
    at = np.searchsorted(view.ids, ids)
    px, sigma, ok = view.px[at], view.sigma_px[at], np.ones(ids.size, dtype=np.bool_)
    if not side.timed:
        return px, sigma, ok
    local = motion_at(side.samples(), ids, np.full(ids.size, view.t_s + later_s))
    still = ~local.ok & (later_s == 0.0)
    px = np.where((local.ok & ~still)[:, None], local.coefficients[:, 0], px)
    sigma = np.where(local.ok, local.sigma_px, sigma)
    return px, sigma, (local.ok & (local.sigma_px < LARGEST_TRACK_PX)) | still


def measure(
    rig: StereoRig, state: State, sides: tuple[Side, Side], test: Sequence[tuple[int, int]]
) -> HoldOut | None:
    """All numbers of the test; None where fewer than two points could be compared anywhere."""
    frames = [test_frame(rig, state, sides, pair) for pair in test]
    wanted = sum(f.wanted for f in frames)
    frames = [f for f in frames if f.board_mm.shape[0] >= 2 and np.isfinite(f.xyz_mm).all()]
    if not frames:
        return None
    errors = [distance_errors(f.board_mm, f.xyz_mm) for f in frames]
    share, mm = (np.concatenate(e) for e in zip(*errors, strict=True))
    epipolar = np.concatenate([f.epipolar_px for f in frames])
    predicted = np.concatenate([predicted_sd(rig, f) for f in frames])
    depth, again = zip(
        *(_rigid_errors(rig, f) for f in frames if len(f.board_mm) >= 3), strict=True
    )
    return HoldOut(
        frames=len(frames),
        pairs=mm.size,
        usable=epipolar.size / max(wanted, 1),
        rms_percent=100 * _rms(share),
        median_percent=100 * float(np.median(np.abs(share))),
        bias_percent=100 * float(share.mean()),
        rms_mm=_rms(mm),
        median_mm=float(np.median(np.abs(mm))),
        bias_mm=float(mm.mean()),
        epipolar_rms_px=_rms(epipolar),
        z_rms_mm=_rms(np.concatenate(depth)),
        reprojection_rms_px=_rms(np.concatenate(again)),
        rms_z=_rms(mm / predicted),
        errors_percent=100 * share,
        errors_mm=mm,
        frame=np.concatenate(
            [np.full(len(e[0]), f.frame) for e, f in zip(errors, frames, strict=True)]
        ),
    )


def distance_errors(board_mm: Floats, xyz_mm: Floats) -> tuple[Floats, Floats]:
    """Errors of all distances between N points: relative (P,) and in mm (P,)."""
    i, j = np.triu_indices(len(board_mm), 1)
    true = np.linalg.norm(board_mm[i] - board_mm[j], axis=1)
    measured = np.linalg.norm(xyz_mm[i] - xyz_mm[j], axis=1)
    return measured / true - 1, measured - true


def predicted_sd(rig: StereoRig, frame: FrameTest) -> Floats:
    """Predicted sd (P,) mm of all distances of a frame: pixels and rig; NaN without covariance."""
    if rig.covariance is None:
        return np.full(len(frame.xyz_mm) * (len(frame.xyz_mm) - 1) // 2, np.nan)
    by_rig, by_px = rig_sensitivity(rig, frame.xyz_mm)
    noise = np.square(frame.sigma_px)[:, [0, 0, 1, 1]]
    own = np.einsum("nij,nj,nkj->nik", by_px, noise, by_px)
    i, j = np.triu_indices(len(frame.xyz_mm), 1)
    between = frame.xyz_mm[i] - frame.xyz_mm[j]
    unit = between / np.linalg.norm(between, axis=1, keepdims=True)
    slope = np.einsum("ni,nij->nj", unit, by_rig[i] - by_rig[j])
    common = np.einsum("ni,ij,nj->n", slope, rig.covariance, slope)
    return np.asarray(np.sqrt(common + np.einsum("ni,nij,nj->n", unit, own[i] + own[j], unit)))


def _rigid_errors(rig: StereoRig, frame: FrameTest) -> tuple[Floats, Floats]:
    """Depth errors (N,) mm about the rigid board, and pixel errors (4 N,) of the rigid board."""
    R, t = place_rigidly(frame.board_mm, frame.xyz_mm)
    rigid = frame.board_mm @ R.T + t
    left = rig.left.project(rigid) - frame.left_px
    right = rig.right.project(rig.to_right(rigid)) - frame.right_px
    return frame.xyz_mm[:, 2] - rigid[:, 2], np.concatenate([left.ravel(), right.ravel()])


def place_rigidly(source: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and translation (3,) that bring points (N, 3) nearest to others (Kabsch)."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((source - a).T @ (target - b))
    R = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    return R, b - R @ a


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def with_tracks(
    sides: tuple[Side, Side], state: State, scales: tuple[float, float]
) -> tuple[Side, Side]:
    """The sides as the fitted state sees them: its row times, its sigmas."""
    a, b = (
        replace(side.with_scale(scale), row_time_s=float(row_time))
        for side, row_time, scale in zip(sides, state.row_time_s, scales, strict=True)
    )
    return a, b
