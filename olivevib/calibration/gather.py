"""From the fit to the result: rig with covariance, every residual, which views were used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.bundle import BOW, LAG, LEFT, RIGHT, RIGHT_ALONE, ROW_OF
from olivevib.calibration.coverage import Coverage, cover
from olivevib.calibration.holdout import HoldOut
from olivevib.calibration.joint import JointFit, Pair
from olivevib.calibration.outliers import Cleaned
from olivevib.calibration.quality import SIDES, Evidence, cautions
from olivevib.calibration.result import BoardPoses, Calibration, HalfTest, Residuals, ViewUse
from olivevib.calibration.rigid import epipolar_px
from olivevib.calibration.solve import Solution
from olivevib.calibration.uncertainty import Uncertainty, rig_covariance, uncertainty
from olivevib.calibration.verdict import verdict
from olivevib.geometry import LENS, StereoRig


def published_rig(fit: JointFit, sure: Uncertainty) -> StereoRig:
    """The rig with its published covariance."""
    state, n = fit.state, len(LENS)
    cov = rig_covariance(sure.published, state.R)
    left = replace(state.left, covariance=cov[:n, :n])
    right = replace(state.right, covariance=cov[n : 2 * n, n : 2 * n])
    return StereoRig(left, right, state.R, state.t_mm, cov)


def gather(
    pair: Pair, cleaned: Cleaned, tested: HoldOut | None, halves: tuple[HalfTest, ...]
) -> Calibration:
    """The whole result of a joint calibration; ``pair`` holds all views, also those not used."""
    fit, state = cleaned.fit, cleaned.fit.state
    sure = uncertainty(fit.problem, fit.solution)
    rig = published_rig(fit, sure)
    residuals, poses, covered = residuals_of(fit), poses_of(fit), coverage_of(fit)
    rms = (rms_px(residuals, 0), rms_px(residuals, 1))
    a, b = (_plain_rms(lens.solution) for lens in fit.lenses)
    evidence = Evidence(cleaned, sure, covered, poses.both, tested, halves, rms, (a, b))
    sigma = sigma_px(residuals, max(1.0, tested.rms_z) if tested is not None else 1.0)
    sd, rows = np.sqrt(np.diag(sure.published)), list(ROW_OF)
    return Calibration(
        rig=rig,
        right_offset_s=-state.lag_s,
        right_offset_sigma_s=float(sd[LAG]) if fit.lag_free else float("nan"),
        reference_row=fit.pair.left.reference_row,
        jitter_s=fit.jitter_sd_s,
        row_time_s=_where(state.row_time_s, fit.problem.free[rows]),
        row_time_sigma_s=_where(sd[rows], fit.problem.free[rows]),
        bow_mm=state.bow_mm,
        bow_sigma_mm=sd[BOW],
        rms_left_px=rms[0],
        rms_right_px=rms[1],
        epipolar_rms_px=tested.epipolar_rms_px if tested else epipolar_of(fit, rig),
        holdout=tested,
        halves=halves,
        left_coverage=covered[0],
        right_coverage=covered[1],
        views=views_of(pair, cleaned, residuals),
        residuals=residuals,
        poses=poses,
        cautions=cautions(evidence),
        point_sigma_px=sigma,
        verdict=verdict(evidence, rig, sigma),
    )


def _where(values: Floats, known: Bools) -> Floats:
    return np.where(known, values, np.nan)


def _plain_rms(solution: Solution) -> float:
    return float(np.sqrt((solution.residual**2).sum(axis=1).mean()))


def rms_px(residuals: Residuals, camera: int) -> float:
    """Square root of the mean squared distance, px, over a camera's points."""
    at = residuals.camera == camera
    return float(np.sqrt((residuals.residual_px[at] ** 2).sum(axis=1).mean()))


def sigma_px(residuals: Residuals, widening: float) -> tuple[float, float]:
    """The middle sigma of a point of each camera, px, widened as the unused frames demand."""
    a, b = (float(np.median(residuals.sigma_px[residuals.camera == k])) for k in (0, 1))
    return a * widening, b * widening


def residuals_of(fit: JointFit) -> Residuals:
    """Every point of the fit with its residual."""
    obs = fit.problem.observations
    px, _ = obs.px(fit.state)
    frames = np.array([view.frame for view in fit.pair.left.views], dtype=np.int64)
    own = {int(p): fit.pair.right.views[k].frame for k, p in enumerate(fit.made.right_pose)}
    frame = np.array([
        own[int(pose)] if chain == RIGHT_ALONE else frames[pose]
        for chain, pose in zip(obs.chain, obs.pose, strict=True)
    ])  # fmt: skip
    return Residuals(
        camera=obs.camera,
        frame=frame,
        id=obs.ids,
        px=px,
        residual_px=fit.solution.residual,
        sigma_px=obs.sigma_px,
        weight=fit.solution.weight,
    )


def poses_of(fit: JointFit) -> BoardPoses:
    """The board poses of the left camera's views that were used."""
    obs, state = fit.problem.observations, fit.state
    seen, shared = (np.unique(obs.pose[obs.chain == chain]) for chain in (LEFT, RIGHT))
    frames = np.array([fit.pair.left.views[k].frame for k in seen], dtype=np.int64)
    return BoardPoses(frames, state.R_pose[seen], state.t_pose_mm[seen], np.isin(seen, shared))


def coverage_of(fit: JointFit) -> tuple[Coverage, Coverage]:
    """What each camera covered, with the poses that it found alone."""
    a, b = (
        cover(side.views, side.camera.size_px, lens.solution.state, fit.pair.shape.centre_mm)
        for side, lens in zip(fit.pair.sides, fit.lenses, strict=True)
    )
    return a, b


def epipolar_of(fit: JointFit, rig: StereoRig) -> float:
    """Rms of the epipolar error on the views of the fit, px."""
    obs = fit.problem.observations
    px, _ = obs.px(fit.state)
    key = obs.pose * (int(obs.ids.max()) + 1) + obs.ids
    left, right = (np.flatnonzero(obs.chain == chain) for chain in (LEFT, RIGHT))
    _, a, b = np.intersect1d(key[left], key[right], return_indices=True)
    return float(np.sqrt((epipolar_px(rig, px[left[a]], px[right[b]]) ** 2).mean()))


def views_of(pair: Pair, cleaned: Cleaned, residuals: Residuals) -> tuple[ViewUse, ...]:
    """Each view of both cameras: used or not, and why not."""
    why = {(d.camera, d.frame): d.reason for d in cleaned.dropped}
    out = []
    for camera, (name, side) in enumerate(zip(SIDES, pair.sides, strict=True)):
        used = {v.frame for v in cleaned.fit.pair.sides[camera].views}
        at = residuals.camera == camera
        frames, squares = residuals.frame[at], (residuals.residual_px[at] ** 2).sum(axis=1)
        for view in side.views:
            mine = squares[frames == view.frame]
            reason = why.get((name, view.frame), why.get(("both", view.frame), ""))
            if not reason and view.frame not in used:
                reason = "tells less than the views that were chosen"
            rms = float(np.sqrt(mine.mean())) if mine.size and not reason else float("nan")
            use = ViewUse(name, view.frame, view.t_s, view.ids.size, not reason, reason, rms)
            out.append(use)
    return tuple(out)
