"""A point in space from its images in both cameras: the paper's Linear-Eigen, and the optimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig

STEPS = 6  # Gauss-Newton from Linear-Eigen converges in two or three


@dataclass(frozen=True)
class Points:
    """Triangulated points: xyz_mm (N, 3), covariance_mm2 (N, 3, 3), in the left camera's frame.

    epipolar_px (N,): distance of the two images from epipolar consistency (square root of the
    weighted residual in units of sigma times the mean pixel sigma, signed by the vertical
    disparity); epipolar_z (N,): the same in sigmas, one degree of freedom. NaN where an image is
    missing or the point lies behind a camera.
    """

    xyz_mm: Floats
    covariance_mm2: Floats
    epipolar_px: Floats
    epipolar_z: Floats


def linear_eigen(rig: StereoRig, left_px: Floats, right_px: Floats) -> Floats:
    """Points (N, 3) mm by the homogeneous DLT, smallest singular vector (paper, section 5).

    Distortion is removed first, and lengths are taken in baselines, without which the four columns
    differ a thousandfold. Degenerates for parallel rays (points far beyond the baseline).
    Source: Hartley and Sturm, Triangulation, CVIU 1997, "Linear-Eigen".
    """
    left, right = rig.left.ray(left_px), rig.right.ray(right_px)
    P_left = np.eye(3, 4)
    P_right = np.column_stack([rig.R_right_left, rig.t_right_left_mm / rig.baseline_mm])
    good = np.isfinite(left[:, 0]) & np.isfinite(right[:, 0])
    out = np.full((len(left), 3), np.nan)
    if good.any():
        A = np.concatenate(
            [
                ray[good, axis, None, None] * P[None, 2:3] - P[None, axis : axis + 1]
                for ray, P in ((left, P_left), (right, P_right))
                for axis in (0, 1)
            ],
            axis=1,
        )
        X = np.linalg.svd(A)[2][:, -1]
        out[good] = X[:, :3] / X[:, 3:] * rig.baseline_mm
    return out


def triangulate(
    rig: StereoRig, left_px: Floats, left_cov: Floats, right_px: Floats, right_cov: Floats
) -> Points:
    """Points that minimise the reprojection error in both images, weighted by the covariances.

    left_px, right_px (N, 2) raw pixels; covariances (N, 2, 2). Gauss-Newton from Linear-Eigen;
    the covariance is that of the images alone (the rig's own is reported apart).
    """
    xyz = linear_eigen(rig, left_px, right_px)
    weights = [inverse_each(left_cov), inverse_each(right_cov)]
    for _ in range(STEPS):
        residuals, jacobians = _residuals(rig, xyz, left_px, right_px)
        A, b = _normal(residuals, jacobians, weights)
        xyz = xyz + _solve(A, b)
    residuals, jacobians = _residuals(rig, xyz, left_px, right_px)
    A, _ = _normal(residuals, jacobians, weights)
    chi2 = sum(np.einsum("ni,nij,nj->n", r, w, r) for r, w in zip(residuals, weights, strict=True))
    z = np.sqrt(np.asarray(chi2)) * np.where(residuals[0][:, 1] < 0, -1.0, 1.0)
    sigma_px = np.sqrt(
        (np.trace(left_cov, axis1=1, axis2=2) + np.trace(right_cov, axis1=1, axis2=2)) / 2
    )
    return Points(xyz, inverse_each(A), z * sigma_px, z)


def _residuals(
    rig: StereoRig, xyz: Floats, left_px: Floats, right_px: Floats
) -> tuple[list[Floats], list[Floats]]:
    """Observed minus projected (N, 2) and the derivatives of the projection (N, 2, 3), both."""
    pl, jl, _ = rig.left.project_jacobian(xyz)
    pr, jr, _ = rig.right.project_jacobian(rig.to_right(xyz))
    return [left_px - pl, right_px - pr], [jl, jr @ rig.R_right_left]


def _normal(
    residuals: list[Floats], jacobians: list[Floats], weights: list[Floats]
) -> tuple[Floats, Floats]:
    rows = list(zip(residuals, jacobians, weights, strict=True))
    A = sum(np.einsum("nki,nkl,nlj->nij", J, w, J) for _, J, w in rows)
    b = sum(np.einsum("nki,nkl,nl->ni", J, w, r) for r, J, w in rows)
    return np.asarray(A), np.asarray(b)


def inverse_each(matrices: Floats) -> Floats:
    """Inverses (N, k, k); NaN where a matrix is not finite or singular."""
    out = np.full_like(matrices, np.nan)
    good = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))
    good = good[np.abs(np.linalg.det(matrices[good])) > 0]
    out[good] = np.linalg.inv(matrices[good])
    return out


def _solve(A: Floats, b: Floats) -> Floats:
    """Solutions (N, k); NaN where the system is not finite."""
    out: Floats = np.einsum("nij,nj->ni", inverse_each(A), b)
    return out
