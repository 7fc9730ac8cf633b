"""From a fitted homography to points of the marker in the image, with their covariance.

W maps image to template, both as X = (x - centre)/scale; ``frame`` is (centre (2,) px, scale px).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import apply_homography

if TYPE_CHECKING:
    from olivevib.detection.refine import Fit


def image_homography(W: Floats, frame: tuple[Floats, float]) -> Floats:
    """The homography (3, 3) from template to image, px, of W (3, 3)."""
    (x, y), scale = frame
    N = np.array([[1, 0, -x], [0, 1, -y], [0, 0, scale]]) / scale
    out: Floats = np.linalg.inv(N) @ np.linalg.inv(W) @ N
    return out


def point_jacobian(H: Floats, W: Floats, points: Floats, frame: tuple[Floats, float]) -> Floats:
    """Derivative (N, 2, 8), px, of the images of fixed module points (N, 2) by W's first entries.

    H (3, 3): pose; W (3, 3) from image to template; in ``frame``.
    """
    centre, scale = frame
    x = apply_homography(H, points)
    X, Y = ((x - centre) / scale).T
    w = W[2, 0] * X + W[2, 1] * Y + W[2, 2]
    Xt = (W[0, 0] * X + W[0, 1] * Y + W[0, 2]) / w
    Yt = (W[1, 0] * X + W[1, 1] * Y + W[1, 2]) / w
    Q = np.zeros((len(points), 2, 8))
    Q[:, 0, 0] = Q[:, 1, 3] = X
    Q[:, 0, 1] = Q[:, 1, 4] = Y
    Q[:, 0, 2] = Q[:, 1, 5] = 1
    Q[:, 0, 6], Q[:, 0, 7] = -Xt * X, -Xt * Y
    Q[:, 1, 6], Q[:, 1, 7] = -Yt * X, -Yt * Y
    B = np.empty((len(points), 2, 2))
    B[:, 0, 0], B[:, 0, 1] = W[0, 0] - Xt * W[2, 0], W[0, 1] - Xt * W[2, 1]
    B[:, 1, 0], B[:, 1, 1] = W[1, 0] - Yt * W[2, 0], W[1, 1] - Yt * W[2, 1]
    out: Floats = np.asarray(-scale * np.linalg.solve(B, Q), dtype=np.float64)
    return out


def point_images(
    H: Floats, W: Floats, covariance: Floats, points: Floats, frame: tuple[Floats, float]
) -> tuple[Floats, Floats]:
    """Images (N, 2), px, of centred module points (N, 2) and their covariance (2 N, 2 N), px².

    covariance (8, 8) of the first entries of W; H, W, frame as in ``point_jacobian``.
    """
    J = point_jacobian(H, W, points, frame).reshape(2 * len(points), 8)
    return apply_homography(H, points), J @ covariance @ J.T


def fitted_points(fit: Fit, points: Floats) -> tuple[Floats, Floats]:
    """Images (N, 2), px, of centred module points (N, 2) of a fit, and their covariance."""
    frame = (fit.centre, fit.scale)
    return point_images(fit.H, fit.to_template, fit.covariance, points, frame)
