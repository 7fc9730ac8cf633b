"""Calibration as the paper does it: closed form for each camera, tested as ours on unused frames.

Frames are taken as synchronous, lenses as free of distortion; nothing is refined and no sigma is
known. It exists to repeat the paper and to compare; ``calibrate`` is what a measurement needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.assemble import BoardShape, Side, Table, table_of
from olivevib.calibration.bundle import State
from olivevib.calibration.calibrate import LEAST_TEST_FRAMES, UNFIT, Size, make_pair_checked
from olivevib.calibration.closed_form import (
    ClosedForm,
    fixes_homography,
    solve_closed,
    stereo_pose,
)
from olivevib.calibration.coverage import Coverage, cover
from olivevib.calibration.gather import rms_px
from olivevib.calibration.holdout import HoldOut, common_pairs, measure, without
from olivevib.calibration.joint import Pair
from olivevib.calibration.quality import FEW_COMMON, SIDES
from olivevib.calibration.result import BoardPoses, Calibration, Residuals, ViewUse
from olivevib.calibration.rigid import epipolar_px
from olivevib.calibration.settings import CalibrationSettings
from olivevib.calibration.views import BoardView, common_ids, pair_views
from olivevib.errors import Caution
from olivevib.geometry import StereoRig
from olivevib.progress import Tick, silent

NAN = float("nan")


@dataclass(frozen=True)
class PaperFit:
    """The closed form of both cameras, the views it used, and the pair that comes of it."""

    left: ClosedForm
    right: ClosedForm
    left_views: tuple[BoardView, ...]
    right_views: tuple[BoardView, ...]
    rig: StereoRig

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Views of left and right that show the same instant."""
        return pair_views(self.left_views, self.right_views)


def calibrate_paper(
    left: Sequence[BoardView],
    right: Sequence[BoardView],
    size_left: Size,
    size_right: Size,
    settings: CalibrationSettings | None = None,
    tick: Tick = silent,
) -> Calibration:
    """Calibrate both cameras and their pose in closed form, and test it on unused frames.

    Arguments as for ``calibrate``; of ``settings`` only the numbers of views and points and the
    shutters count. NaN stands for what the closed form does not know: lag, row times, sigmas.
    Raises InputError where too few views are common or no camera matrix exists.
    """
    settings = settings or CalibrationSettings()
    pair = make_pair_checked(left, right, (size_left, size_right), settings)
    a, b = (replace(side, timed=False) for side in pair.sides)
    pair = replace(pair, left=a, right=b)
    tick(0, 2, "testing on unused frames")
    tested = prove(pair, settings)
    tick(1, 2, "solving with all frames")
    fit = fit_paper(pair.left, pair.right)
    return _gathered(pair, fit, tested)


def fit_paper(left: Side, right: Side) -> PaperFit:
    """Closed form of both cameras from their views that fix a homography."""
    a = tuple(view for view in left.views if fixes_homography(view))
    b = tuple(view for view in right.views if fixes_homography(view))
    one = solve_closed(a, left.camera.size_px, SIDES[0])
    other = solve_closed(b, right.camera.size_px, SIDES[1])
    pose = stereo_pose(one, other, a, b)
    cameras = [
        replace(side.camera, K=form.camera.K) for side, form in ((left, one), (right, other))
    ]
    return PaperFit(one, other, a, b, StereoRig(cameras[0], cameras[1], pose.R, pose.t_mm))


def prove(pair: Pair, settings: CalibrationSettings) -> HoldOut | None:
    """Closed form without the odd common frames, tested on them; None where there are too few."""
    common = common_pairs(pair.left.views, pair.right.views, settings.common_points)
    if len(common) < LEAST_TEST_FRAMES:
        return None
    test = common[1::2]
    left = replace(pair.left, views=tuple(without(pair.left.views, [k for k, _ in test])))
    right = replace(pair.right, views=tuple(without(pair.right.views, [m for _, m in test])))
    fit = fit_paper(left, right)
    return measure(fit.rig, state_of(fit, 0), pair.sides, test)


def state_of(fit: PaperFit, camera: int) -> State:
    """The fit as a state of the joint problem, with the board poses that one camera found."""
    form = (fit.left, fit.right)[camera]
    rig, zero = fit.rig, np.zeros(3)
    return State(
        left=rig.left,
        right=rig.right,
        R=rig.R_right_left,
        t_mm=rig.t_right_left_mm,
        lag_s=0.0,
        bow_mm=zero,
        R_pose=form.R,
        t_pose_mm=form.t_mm,
        jitter_s=np.zeros(len(form.R)),
        row_time_s=np.zeros(2),
    )


def _gathered(pair: Pair, fit: PaperFit, tested: HoldOut | None) -> Calibration:
    residuals, poses, covered = _residuals(fit), _poses(fit), _coverage(fit, pair.shape)
    unknown = np.full(2, NAN)
    return Calibration(
        rig=fit.rig,
        right_offset_s=0.0,
        right_offset_sigma_s=NAN,
        reference_row=pair.left.reference_row,
        jitter_s=NAN,
        row_time_s=unknown,
        row_time_sigma_s=unknown,
        bow_mm=np.zeros(3),
        bow_sigma_mm=np.full(3, NAN),
        rms_left_px=rms_px(residuals, 0),
        rms_right_px=rms_px(residuals, 1),
        epipolar_rms_px=tested.epipolar_rms_px if tested else _epipolar(fit),
        holdout=tested,
        halves=(),
        left_coverage=covered[0],
        right_coverage=covered[1],
        views=_views(pair, fit, residuals),
        residuals=residuals,
        poses=poses,
        point_sigma_px=(NAN, NAN),
        cautions=_cautions(poses, tested),
        verdict=_verdict(tested),
        method="paper",
    )


def _residuals(fit: PaperFit) -> Residuals:
    """Predicted minus observed; common views of the right camera through the left one's pose."""
    a, b = table_of(fit.left_views), table_of(fit.right_views)
    R, t = fit.right.R.copy(), fit.right.t_mm.copy()
    for k, m in fit.pairs:
        R[m] = fit.rig.R_right_left @ fit.left.R[k]
        t[m] = fit.rig.to_right(fit.left.t_mm[k])
    miss_left = fit.rig.left.project(_placed(a, fit.left.R, fit.left.t_mm)) - a.px
    miss_right = fit.rig.right.project(_placed(b, R, t)) - b.px
    frames = [[view.frame for view in views] for views in (fit.left_views, fit.right_views)]
    return Residuals(
        camera=np.repeat([0, 1], [a.id.size, b.id.size]),
        frame=np.concatenate([np.array(frames[0])[a.view], np.array(frames[1])[b.view]]),
        id=np.concatenate([a.id, b.id]),
        px=np.concatenate([a.px, b.px]),
        residual_px=np.concatenate([miss_left, miss_right]),
        sigma_px=np.concatenate([a.sigma_px, b.sigma_px]),
        weight=np.ones(a.id.size + b.id.size),
    )


def _placed(table: Table, R: Floats, t_mm: Floats) -> Floats:
    """All points of the table in the camera's frame (N, 3) mm."""
    out: Floats = np.einsum("nij,nj->ni", R[table.view], table.board_mm) + t_mm[table.view]
    return out


def _poses(fit: PaperFit) -> BoardPoses:
    frames = np.array([view.frame for view in fit.left_views], dtype=np.int64)
    shared = [k for k, _ in fit.pairs]
    both = np.isin(np.arange(frames.size), shared)
    return BoardPoses(frames, fit.left.R, fit.left.t_mm, both)


def _coverage(fit: PaperFit, shape: BoardShape) -> tuple[Coverage, Coverage]:
    a, b = (
        cover(views, form.camera.size_px, state_of(fit, camera), shape.centre_mm)
        for camera, (views, form) in enumerate(
            ((fit.left_views, fit.left), (fit.right_views, fit.right))
        )
    )
    return a, b


def _epipolar(fit: PaperFit) -> float:
    """Rms of the epipolar error on the views of the fit, px."""
    miss = []
    for k, m in fit.pairs:
        left, right = fit.left_views[k], fit.right_views[m]
        ids = common_ids(left, right)
        at = np.searchsorted(left.ids, ids), np.searchsorted(right.ids, ids)
        miss.append(epipolar_px(fit.rig, left.px[at[0]], right.px[at[1]]))
    return float(np.sqrt((np.concatenate(miss) ** 2).mean()))


def _views(pair: Pair, fit: PaperFit, residuals: Residuals) -> tuple[ViewUse, ...]:
    """Each view of both cameras: used or not, and why not."""
    out = []
    squares = (residuals.residual_px**2).sum(axis=1)
    for camera, (name, side) in enumerate(zip(SIDES, pair.sides, strict=True)):
        for view in side.views:
            mine = squares[(residuals.camera == camera) & (residuals.frame == view.frame)]
            rms, why = (float(np.sqrt(mine.mean())), "") if mine.size else (NAN, UNFIT)
            out.append(ViewUse(name, view.frame, view.t_s, view.ids.size, not why, why, rms))
    return tuple(out)


def _cautions(poses: BoardPoses, tested: HoldOut | None) -> tuple[Caution, ...]:
    """That this is the paper's method, and what its test shows."""
    out = [
        Caution(
            "paper-calibration",
            "Calibrated as the paper does: no lens distortion, no lag between the cameras, no "
            "sigmas.",
            "For the best result: --set calibration.paper=false; use this one to compare.",
        )
    ]
    if tested is None:
        out.append(
            Caution(
                "holdout-missing",
                "Too few common frames to keep some for a test: nothing proves this calibration.",
                "Show the board to both cameras at once in at least 10 places.",
            )
        )
    elif tested.rms_percent > 1.0:
        out.append(
            Caution(
                "holdout-large",
                f"On frames that the closed form did not use, distances on the board are wrong by "
                f"{tested.rms_percent:.1f} % rms.",
                "Calibrate with --set calibration.paper=false: it models lens distortion and lag.",
            )
        )
    count = int(poses.both.sum())
    if count < FEW_COMMON:
        out.append(
            Caution(
                "few-common-views",
                f"Both cameras see the board together in {count} views only.",
                f"Show it to both at once in at least {FEW_COMMON} places, tilted and at several "
                "distances.",
            )
        )
    return tuple(out)


def _verdict(tested: HoldOut | None) -> str:
    how = "The paper's closed form, without distortion, lag and sigmas"
    if tested is None:
        return f"{how}; not tested on unused frames (too few)."
    return (
        f"{how}; on {tested.frames} unused frames, distances on the board are right to "
        f"{tested.rms_mm:.2f} mm ({tested.rms_percent:.2f} %) rms."
    )
