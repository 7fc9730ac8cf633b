"""Points from both images at once: optimal triangulation of board points, for tests of a rig.

Source: Hartley & Sturm, Triangulation, 1997 (the optimum is the least squares of both images).
"""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig, skew


def triangulate(rig: StereoRig, left_px: Floats, right_px: Floats) -> tuple[Floats, Floats, Floats]:
    """Points (N, 3) mm in the left frame, residuals (N, 4) px and d point / d pixels (N, 3, 4).

    Residuals are predicted minus observed: u, v left, u, v right. Degenerates (huge derivatives)
    for rays that are almost parallel; NaN where the point falls behind a camera.
    """
    points = _midpoint(rig, left_px, right_px)
    observed = np.column_stack([left_px, right_px])
    for _ in range(3):
        residual, J = _residual(rig, points, observed)
        normal = J.transpose(0, 2, 1) @ J
        backward = np.asarray(
            np.linalg.solve(normal + 1e-15 * np.eye(3), J.transpose(0, 2, 1)), dtype=np.float64
        )
        points = points - np.einsum("nij,nj->ni", backward, residual)
    residual, _ = _residual(rig, points, observed)
    return points, residual, backward


def _residual(rig: StereoRig, points: Floats, observed: Floats) -> tuple[Floats, Floats]:
    left, by_left, _ = rig.left.project_jacobian(points)
    right, by_right, _ = rig.right.project_jacobian(rig.to_right(points))
    J = np.concatenate([by_left, by_right @ rig.R_right_left], axis=1)
    residual = np.column_stack([left, right]) - observed
    bad = ~np.isfinite(residual).all(axis=1)
    J[bad] = np.eye(4, 3)
    residual[bad] = np.nan
    return residual, J


def _midpoint(rig: StereoRig, left_px: Floats, right_px: Floats) -> Floats:
    """The middle of the shortest segment between the two viewing rays (N, 3)."""
    a = rig.left.ray(left_px)
    b = rig.right.ray(right_px) @ rig.R_right_left
    centre = -rig.R_right_left.T @ rig.t_right_left_mm
    aa, bb, ab = (a * a).sum(axis=1), (b * b).sum(axis=1), (a * b).sum(axis=1)
    ac, bc = a @ centre, b @ centre
    det = np.maximum(aa * bb - ab * ab, 1e-12)
    s, u = (ac * bb - bc * ab) / det, (ac * ab - bc * aa) / det
    out: Floats = (a * s[:, None] + centre + b * u[:, None]) / 2
    return out


def epipolar_px(rig: StereoRig, left_px: Floats, right_px: Floats) -> Floats:
    """How far (N,) px each pair of pixels (N, 2) misses its epipolar lines, rms of both images.

    Measured in undistorted pixels. Blind where the motion of a late camera runs along the lines.
    Source: Hartley & Zisserman, Multiple View Geometry, 2004, 9.2.
    """
    a = rig.left.ray(left_px) @ rig.left.K.T
    b = rig.right.ray(right_px) @ rig.right.K.T
    E = skew(rig.t_right_left_mm) @ rig.R_right_left
    F = np.linalg.inv(rig.right.K).T @ E @ np.linalg.inv(rig.left.K)
    in_right, in_left = a @ F.T, b @ F
    miss = (b * in_right).sum(axis=1)
    squares = [miss**2 / (line[:, :2] ** 2).sum(axis=1) for line in (in_right, in_left)]
    out: Floats = np.sqrt((squares[0] + squares[1]) / 2)
    return out
