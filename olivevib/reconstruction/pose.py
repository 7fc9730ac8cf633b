"""The turn of a marker's plane from its four corners in both cameras."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import (
    StereoRig,
    nearest_rotation,
    rotation_from_vector,
    skew,
    vector_from_rotation,
)
from olivevib.reconstruction.triangulation import inverse_each, linear_eigen

STEPS = 5


def rotations(
    rig: StereoRig,
    corners_mm: Floats,
    left: tuple[Floats, Floats],
    right: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """Rotation vectors (N, 3) rad of a marker and their sigmas (N, 3), NaN where not seen.

    corners_mm (4, 3): the corners in the marker's own frame (x right, y down, z into the marker).
    left, right: corners_px (N, 4, 2) with covariance (N, 8, 8). Rigid fit of the triangulated
    corners, then Gauss-Newton on the reprojection of all eight images. R turns marker to camera.
    """
    n = len(left[0])
    flat = [p.reshape(-1, 2) for p in (left[0], right[0])]
    points = linear_eigen(rig, flat[0], flat[1]).reshape(n, 4, 3)
    vectors, sigmas = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    good = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    if not good.size:
        return vectors, sigmas
    R, t = _rigid(corners_mm, points[good])
    pixels = [left[0][good], right[0][good]]
    weights = [inverse_each(left[1][good]), inverse_each(right[1][good])]
    for step in range(STEPS + 1):
        A, b = _normal(rig, corners_mm, R, t, pixels, weights)
        covariance = inverse_each(A)
        if step < STEPS:
            move = np.einsum("nij,nj->ni", covariance, b)
            R = rotation_from_vector(move[:, :3]) @ R
            t = t + move[:, 3:]
    vectors[good] = [vector_from_rotation(r) if np.isfinite(r).all() else [np.nan] * 3 for r in R]
    sigmas[good] = np.sqrt(np.einsum("nii->ni", covariance)[:, :3])
    return vectors, sigmas


def _rigid(corners_mm: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Kabsch: rotations (N, 3, 3) and positions (N, 3) of the corners (4, 3) in ``points``."""
    centre = points.mean(axis=1)
    M = np.einsum("nki,kj->nij", points - centre[:, None], corners_mm - corners_mm.mean(axis=0))
    R = np.stack([nearest_rotation(m) for m in M])
    return R, centre - R @ corners_mm.mean(axis=0)


def _normal(
    rig: StereoRig,
    corners_mm: Floats,
    R: Floats,
    t: Floats,
    pixels: list[Floats],
    weights: list[Floats],
) -> tuple[Floats, Floats]:
    """Normal equations (N, 6, 6), (N, 6) of a small left-multiplied turn and a shift."""
    n = len(R)
    arms = np.einsum("nij,kj->nki", R, corners_mm)
    points = (arms + t[:, None]).reshape(-1, 3)
    by_pose = np.concatenate([-skew(arms), np.broadcast_to(np.eye(3), (n, 4, 3, 3))], axis=-1)
    A, b = np.zeros((n, 6, 6)), np.zeros((n, 6))
    views = ((rig.left, points, np.eye(3)), (rig.right, rig.to_right(points), rig.R_right_left))
    for (camera, seen, turn), px, weight in zip(views, pixels, weights, strict=True):
        projected, by_point, _ = camera.project_jacobian(seen)
        J = ((by_point @ turn).reshape(n, 4, 2, 3) @ by_pose).reshape(n, 8, 6)
        r = (px - projected.reshape(n, 4, 2)).reshape(n, 8)
        JW = np.swapaxes(J, 1, 2) @ weight
        A += JW @ J
        b += np.einsum("nij,nj->ni", JW, r)
    return A, b
