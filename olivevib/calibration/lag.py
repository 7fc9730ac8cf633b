"""How late the right camera is: a search that starts the joint refinement near the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.calibration.tracks import Samples, motion_at
from olivevib.geometry import CameraModel, nearest_rotation, rotation_from_vector, skew


@dataclass(frozen=True)
class Pose:
    """A rotation (3, 3) and translation (3,) mm from the left to the right camera."""

    R: Floats
    t_mm: Floats


def agreement(R_left: Floats, R_right: Floats, R: Floats) -> float:
    """Share of the views (V, 3, 3) whose stereo rotation is within 10 degrees of ``R``."""
    each = R_right @ R_left.transpose(0, 2, 1)
    trace = np.einsum("aij,ij->a", each, R)
    return float((trace > 1 + 2 * np.cos(np.radians(10.0))).mean())


@dataclass(frozen=True)
class LeftPoints:
    """Board points in the left camera's frame (N, 3) mm, with id (N,) and instant (N,) s."""

    xyz_mm: Floats
    id: Ints
    t_s: Floats


def medoid_pose(R_left: Floats, t_left: Floats, R_right: Floats, t_right: Floats) -> Pose:
    """The stereo pose that most of the views (V, 3, 3), (V, 3) agree on.

    Rotation: the medoid of R_right R_left^T; translation: the median of what it leaves over.
    """
    each = R_right @ R_left.transpose(0, 2, 1)
    trace = np.einsum("aij,bij->ab", each, each)
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1))
    R = each[int(angle.sum(axis=1).argmin())]
    return Pose(R, np.median(t_right - t_left @ R.T, axis=0))


def search_lag(
    points: LeftPoints, right: Samples, camera: CameraModel, start: Pose, lags_s: Floats
) -> tuple[float, Pose, Floats]:
    """The lag of ``lags_s`` at which one stereo pose explains the right image best.

    Returns the lag, its stereo pose and the robust rms (L,) px at every lag, NaN where too few
    points could be compared. Where the board hardly moved the rms is flat: the caller decides.
    """
    poses: list[Pose] = []
    rms = np.full(lags_s.size, np.nan)
    for k, lag in enumerate(lags_s):
        local = motion_at(right, points.id, points.t_s + lag)
        px, xyz = local.coefficients[local.ok, 0], points.xyz_mm[local.ok]
        pose, residual = fit_pose(xyz, px, camera, start)
        poses.append(pose)
        if local.ok.sum() >= 0.5 * points.id.size and residual.size:
            rms[k] = robust_rms(residual)
    if not np.isfinite(rms).any():
        return 0.0, start, rms
    best = int(np.nanargmin(rms))
    return float(lags_s[best]), poses[best], rms


def robust_rms(residual: Floats) -> float:
    """Rms per axis of residuals (N, 2), each point limited to three medians."""
    norm = np.linalg.norm(residual, axis=1)
    return float(np.sqrt((np.minimum(norm, 3 * np.median(norm)) ** 2).mean() / 2))


def fit_pose(
    xyz_mm: Floats, px: Floats, camera: CameraModel, start: Pose, steps: int = 6
) -> tuple[Pose, Floats]:
    """Stereo pose from known points (N, 3) of the left frame and right pixels (N, 2), robustly."""
    pose, residual = start, np.zeros((0, 2))
    for _ in range(steps if len(px) >= 6 else 0):
        turned = xyz_mm @ pose.R.T
        predicted, by_point, _ = camera.project_jacobian(turned + pose.t_mm)
        good = np.isfinite(predicted).all(axis=1)
        residual = (predicted - px)[good]
        if good.sum() < 6:
            break
        J = np.concatenate([-by_point @ skew(turned), by_point], axis=2)[good]
        norm = np.linalg.norm(residual, axis=1)
        weight = 1 / np.maximum(norm, 1.5 * np.median(norm) + 1e-9)
        A = np.einsum("nij,n,nik->jk", J, weight, J)
        g = np.einsum("nij,n,ni->j", J, weight, residual)
        move = -np.linalg.solve(A + 1e-9 * np.diag(np.diag(A)), g)
        R = nearest_rotation(rotation_from_vector(move[:3]) @ pose.R)
        pose = Pose(R, pose.t_mm + move[3:])
    return pose, residual
