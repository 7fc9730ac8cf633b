"""Paper mode: the closed form for both cameras, handed on in the same shape as the joint result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.assemble import shape_of
from olivevib.calibration.bundle import State
from olivevib.calibration.closed_form import ClosedForm, closed_form
from olivevib.calibration.coverage import Coverage, cover
from olivevib.calibration.holdout import HoldOut, common_pairs, measure, without
from olivevib.calibration.joint import Pair
from olivevib.calibration.lag import medoid_pose
from olivevib.calibration.quality import SIDES
from olivevib.calibration.result import BoardPoses, Calibration, Residuals, ViewUse
from olivevib.calibration.rigid import epipolar_px
from olivevib.calibration.views import BoardView, common_ids, pair_views
from olivevib.errors import Caution
from olivevib.geometry import CameraModel, StereoRig

LEAST_TEST_FRAMES = 12  # the closed form needs three views to begin with


@dataclass(frozen=True)
class PaperRig:
    """The pair in closed form, and the boards that each camera found."""

    rig: StereoRig
    left: ClosedForm
    right: ClosedForm


def paper_rig(
    left: Sequence[BoardView], right: Sequence[BoardView], cameras: tuple[CameraModel, CameraModel]
) -> PaperRig:
    """Both cameras in closed form; stereo pose as the medoid over the common views."""
    a, b = (
        closed_form(views, camera.size_px, f"{side} camera")
        for views, camera, side in zip((left, right), cameras, SIDES, strict=True)
    )
    k, m = np.array(pair_views(left, right), dtype=np.int64).reshape(-1, 2).T
    pose = medoid_pose(a.R[k], a.t_mm[k], b.R[m], b.t_mm[m])
    models = [
        CameraModel(c.size_px, f.K, np.zeros(5), c.row_time_s, row_time_source=c.row_time_source)
        for c, f in zip(cameras, (a, b), strict=True)
    ]
    return PaperRig(StereoRig(models[0], models[1], pose.R, pose.t_mm), a, b)


def paper_result(pair: Pair, common_points: int) -> Calibration:
    """The closed form of all views, tested on frames that another closed form did not use."""
    left, right = pair.left.views, pair.right.views
    cameras = (pair.left.camera, pair.right.camera)
    found = paper_rig(left, right, cameras)
    tested = _tested(pair, common_points)
    residuals = _residuals(found, left, right)
    rms = [_rms(residuals.residual_px[residuals.camera == k]) for k in (0, 1)]
    a, b = _coverage(pair, found)
    nan = np.full(2, np.nan)
    return Calibration(
        rig=found.rig,
        right_offset_s=0.0,
        right_offset_sigma_s=float("nan"),
        reference_row=pair.left.reference_row,
        jitter_s=0.0,
        row_time_s=nan,
        row_time_sigma_s=nan,
        bow_mm=np.zeros(3),
        bow_sigma_mm=np.full(3, np.nan),
        rms_left_px=rms[0],
        rms_right_px=rms[1],
        epipolar_rms_px=tested.epipolar_rms_px if tested else _epipolar(found.rig, left, right),
        holdout=tested,
        halves=(),
        left_coverage=a,
        right_coverage=b,
        views=_views(left, right),
        residuals=residuals,
        poses=_poses(found, left, right),
        point_sigma_px=(rms[0] / np.sqrt(2), rms[1] / np.sqrt(2)),
        cautions=(_CAUTION,),
        verdict=_verdict(tested),
        method="paper",
    )


_CAUTION = Caution(
    "paper-mode",
    "Calibrated as in the paper: closed form, without lens distortion, time lag or refinement.",
    "For measurements calibrate without --paper.",
)


def _verdict(tested: HoldOut | None) -> str:
    if tested is None:
        return "Closed form as in the paper; not tested on unused frames (too few)."
    return (
        f"Closed form as in the paper: on {tested.frames} unused frames, distances on the board "
        f"are right to {tested.rms_mm:.2f} mm ({tested.rms_percent:.2f} %) rms."
    )


def _tested(pair: Pair, common_points: int) -> HoldOut | None:
    left, right = pair.left.views, pair.right.views
    common = common_pairs(left, right, common_points)
    if len(common) < LEAST_TEST_FRAMES:
        return None
    test = common[1::2]
    cameras = (pair.left.camera, pair.right.camera)
    train = [without(v, [p[k] for p in test]) for k, v in enumerate((left, right))]
    rig = paper_rig(train[0], train[1], cameras).rig
    return measure(rig, _still(rig), pair.sides, test)


def _still(rig: StereoRig) -> State:
    """A state without lag: both images are taken as they are."""
    none = np.zeros((0, 3))
    return State(
        rig.left, rig.right, rig.R_right_left, rig.t_right_left_mm, 0.0, np.zeros(3),
        np.zeros((0, 3, 3)), none, np.zeros(0), np.zeros(2),
    )  # fmt: skip


def _rms(residual: Floats) -> float:
    return float(np.sqrt((residual**2).sum(axis=1).mean()))


def _residuals(found: PaperRig, left: Sequence[BoardView], right: Sequence[BoardView]) -> Residuals:
    """Each camera's points against its own boards in closed form."""
    parts = []
    cameras = (found.rig.left, found.rig.right)
    for k, (views, form) in enumerate(((left, found.left), (right, found.right))):
        for view, R, t in zip(views, form.R, form.t_mm, strict=True):
            miss = cameras[k].project(view.board_mm @ R.T + t) - view.px
            n = view.ids.size
            head = (np.full(n, k), np.full(n, view.frame), view.ids)
            parts.append((*head, view.px, miss, view.sigma_px, np.ones(n)))
    return Residuals(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _epipolar(rig: StereoRig, left: Sequence[BoardView], right: Sequence[BoardView]) -> float:
    errors = []
    for k, m in pair_views(left, right):
        ids = common_ids(left[k], right[m])
        a, b = (v.px[np.searchsorted(v.ids, ids)] for v in (left[k], right[m]))
        errors.append(epipolar_px(rig, a, b))
    return float(np.sqrt((np.concatenate(errors) ** 2).mean()))


def _coverage(pair: Pair, found: PaperRig) -> tuple[Coverage, Coverage]:
    shape = shape_of([*pair.left.views, *pair.right.views])
    a, b = (
        cover(side.views, side.camera.size_px, form.R, form.t_mm, shape.centre_mm)
        for side, form in zip(pair.sides, (found.left, found.right), strict=True)
    )
    return a, b


def _views(left: Sequence[BoardView], right: Sequence[BoardView]) -> tuple[ViewUse, ...]:
    return tuple(
        ViewUse(side, view.frame, view.t_s, view.ids.size, True, "", float("nan"))
        for side, views in zip(SIDES, (left, right), strict=True)
        for view in views
    )


def _poses(found: PaperRig, left: Sequence[BoardView], right: Sequence[BoardView]) -> BoardPoses:
    both = np.isin(np.arange(len(left)), [k for k, _ in pair_views(left, right)])
    frames = np.array([view.frame for view in left], dtype=np.int64)
    return BoardPoses(frames, found.left.R, found.left.t_mm, both)
