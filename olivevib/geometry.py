"""Cameras, stereo rigs, homographies: projection, viewing rays and their derivatives.

Pixel centres are integers, x right, y down; camera frame x right, y down, z forward; mm and px.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import ArrayLike

from olivevib.arrays import Floats, floats

LENS = ("fx", "fy", "cx", "cy", "k1", "k2")  # order of lens parameters in every covariance
RIG = tuple(f"left_{p}" for p in LENS) + tuple(f"right_{p}" for p in LENS) + (
    *("rx", "ry", "rz"),  # rotation vector of R_right_left, rad
    *("tx", "ty", "tz"),  # t_right_left_mm
)  # fmt: skip


@dataclass(frozen=True)
class CameraModel:
    """One camera: pin-hole with Brown distortion, and the time its sensor takes to read a row.

    size_px (width, height); K (3, 3); distortion (5,) in OpenCV's order k1 k2 p1 p2 k3;
    row_time_s signed seconds per raw sensor row (0: global shutter, or unknown; ``row_time_source``
    tells which: "global", "unknown", "declared", "led", "board", "trial");
    covariance (6, 6) of the LENS parameters, or None where it is not known.
    """

    size_px: tuple[int, int]
    K: Floats
    distortion: Floats
    row_time_s: float = 0.0
    row_time_sigma_s: float = float("nan")
    row_time_source: str = "unknown"
    covariance: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", floats("K", self.K, (3, 3)))
        object.__setattr__(self, "distortion", floats("distortion", self.distortion, (5,)))
        if self.covariance is not None:
            cov = floats("covariance", self.covariance, (6, 6))
            object.__setattr__(self, "covariance", cov)
        if self.K[0, 0] <= 0 or self.K[1, 1] <= 0:
            raise ValueError(f"focal lengths must be positive, got {self.K[0, 0]}, {self.K[1, 1]}")

    @property
    def lens(self) -> Floats:
        """The LENS parameters (6,)."""
        k = self.K
        return np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *self.distortion[:2]])

    def with_lens(self, lens: ArrayLike, covariance: Floats | None = None) -> CameraModel:
        """The same camera with other LENS parameters (6,); skew and other terms are kept."""
        fx, fy, cx, cy, k1, k2 = (float(v) for v in np.asarray(lens))
        K = np.array([[fx, self.K[0, 1], cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        distortion = np.array([k1, k2, *self.distortion[2:]])
        return replace(self, K=K, distortion=distortion, covariance=covariance)

    def project(self, points_mm: ArrayLike) -> Floats:
        """Pixels (N, 2) of points (N, 3) in this camera's frame; NaN behind the camera."""
        return self.project_jacobian(points_mm)[0]

    def project_jacobian(self, points_mm: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Pixels (N, 2), derivatives by the point (N, 2, 3) per mm and by LENS (N, 2, 6).

        NaN for points that are not in front of the camera. Model: OpenCV's, see CONVENTIONS.md.
        """
        points = np.asarray(points_mm, dtype=np.float64).reshape(-1, 3)
        z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
        x, y = points[:, 0] / z, points[:, 1] / z
        distorted, by_xy, by_k = _distort(x, y, self.distortion)
        k = self.K[:2, :2]
        px = distorted @ k.T + self.K[:2, 2]
        dxy = np.zeros((len(points), 2, 3))
        dxy[:, 0, 0] = dxy[:, 1, 1] = 1 / z
        dxy[:, 0, 2], dxy[:, 1, 2] = -x / z, -y / z
        by_point = k @ by_xy @ dxy
        by_lens = np.zeros((len(points), 2, 6))
        by_lens[:, 0, 0], by_lens[:, 1, 1] = distorted[:, 0], distorted[:, 1]
        by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1.0
        by_lens[:, :, 4:] = k @ by_k
        return px, by_point, by_lens

    def ray(self, px: ArrayLike) -> Floats:
        """Viewing directions (N, 3) with z = 1 of pixels (N, 2); NaN stays NaN.

        OpenCV's fixed point with 20 steps: 3e-8 px where five steps are 0.4 px off in a corner.
        """
        pixels = np.array(px, dtype=np.float64).reshape(-1, 2)
        # undistortPoints takes K for a camera without skew
        pixels[:, 0] -= self.K[0, 1] * (pixels[:, 1] - self.K[1, 2]) / self.K[1, 1]
        out = np.full((len(pixels), 3), np.nan)
        good = np.isfinite(pixels).all(axis=1)
        if good.any():
            criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 1e-12)
            xy = cv2.undistortPoints(
                pixels[good][:, None], self.K, self.distortion, None, None, None, criteria
            )
            out[good, :2] = xy[:, 0]
            out[good, 2] = 1.0
        return out


def _distort(x: Floats, y: Floats, distortion: Floats) -> tuple[Floats, Floats, Floats]:
    """Distorted (N, 2), derivatives by (x, y) (N, 2, 2) and by (k1, k2) (N, 2, 2)."""
    k1, k2, p1, p2, k3 = distortion
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * k3 * r2))  # d radial / d(r2) * 2
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    by_xy = np.empty((x.size, 2, 2))
    by_xy[:, 0, 0] = radial + x * slope * x + 2 * p1 * y + 6 * p2 * x
    by_xy[:, 0, 1] = x * slope * y + 2 * p1 * x + 2 * p2 * y
    by_xy[:, 1, 0] = by_xy[:, 0, 1]
    by_xy[:, 1, 1] = radial + y * slope * y + 6 * p1 * y + 2 * p2 * x
    by_k, distorted = np.empty((x.size, 2, 2)), np.empty((x.size, 2))
    by_k[:, 0, 0], by_k[:, 1, 0] = x * r2, y * r2
    by_k[:, :, 1] = by_k[:, :, 0] * r2[:, None]
    distorted[:, 0], distorted[:, 1] = u, v
    return distorted, by_xy, by_k


@dataclass(frozen=True)
class StereoRig:
    """A calibrated pair: X_right = R_right_left X_left + t_right_left_mm.

    covariance (18, 18) of the RIG parameters, or None where it is not known.
    """

    left: CameraModel
    right: CameraModel
    R_right_left: Floats
    t_right_left_mm: Floats
    covariance: Floats | None = None

    def __post_init__(self) -> None:
        R = floats("R_right_left", self.R_right_left, (3, 3))
        if abs(np.linalg.det(R) - 1) > 1e-6 or np.abs(R @ R.T - np.eye(3)).max() > 1e-6:
            raise ValueError("R_right_left is not a rotation")
        object.__setattr__(self, "R_right_left", R)
        t = floats("t_right_left_mm", self.t_right_left_mm, (3,))
        object.__setattr__(self, "t_right_left_mm", t)
        if self.covariance is not None:
            cov = floats("covariance", self.covariance, (18, 18))
            object.__setattr__(self, "covariance", cov)

    @property
    def baseline_mm(self) -> float:
        """Distance between the two projection centres, mm."""
        return float(np.linalg.norm(self.t_right_left_mm))

    @property
    def angle_deg(self) -> float:
        """Angle between the two optical axes, degrees."""
        return float(np.degrees(np.arccos(np.clip(self.R_right_left[2, 2], -1, 1))))

    def projection_matrices(self) -> tuple[Floats, Floats]:
        """The perspective projection matrices K [R | t] of left and right (3, 4), paper section 4.

        They hold for undistorted pixels; the left camera's frame is the world.
        """
        left = self.left.K @ np.eye(3, 4)
        right = self.right.K @ np.column_stack([self.R_right_left, self.t_right_left_mm])
        return left, right

    def to_right(self, points_mm: ArrayLike) -> Floats:
        """Points (N, 3) of the left camera's frame in the right camera's frame, mm."""
        points = np.asarray(points_mm, dtype=np.float64)
        return points @ self.R_right_left.T + self.t_right_left_mm


def rotation_from_vector(vector: ArrayLike) -> Floats:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), rad (Rodrigues)."""
    v = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    S = skew(v)
    small = angle < 1e-8
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1 - angle**2 / 6, np.sin(safe) / safe)
    b = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    out: Floats = np.eye(3) + a * S + b * (S @ S)
    return out


def vector_from_rotation(R: ArrayLike) -> Floats:
    """Rotation vector (3,), at most pi long, of a rotation matrix (3, 3), rad.

    Through the quaternion's largest component, so tiny turns keep all their digits (cv2.Rodrigues
    returns zero below 1e-5 rad). Source: Shepperd, J. Guidance and Control 1978.
    """
    m = np.asarray(R, dtype=np.float64)
    d = np.diag(m)
    off = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    choice = int(np.argmax([m.trace(), *d]))
    if choice == 0:
        q = np.array([1 + m.trace(), *off])
    else:
        i = choice - 1
        q = np.empty(4)
        q[0] = off[i]
        q[1:] = m[i] + m[:, i]
        q[1 + i] = 1 + 2 * d[i] - m.trace()
    q = q / np.linalg.norm(q) * (1.0 if q[0] >= 0 else -1.0)
    sine = float(np.linalg.norm(q[1:]))
    angle = 2 * np.arctan2(sine, q[0])
    out: Floats = q[1:] * (angle / sine if sine > 0 else 2.0)
    return out


def skew(v: ArrayLike) -> Floats:
    """The matrices (..., 3, 3) with skew(v) @ w = v x w."""
    w = np.asarray(v, dtype=np.float64)
    out = np.zeros((*w.shape[:-1], 3, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    out[..., 1, 2], out[..., 2, 0], out[..., 0, 1] = -w[..., 0], -w[..., 1], -w[..., 2]
    return out


def nearest_rotation(M: ArrayLike) -> Floats:
    """The rotation (3, 3) nearest to M in the Frobenius norm (SVD, det +1)."""
    u, _, vt = np.linalg.svd(np.asarray(M, dtype=np.float64))
    out: Floats = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return out


def homography(source: ArrayLike, target: ArrayLike) -> Floats:
    """H (3, 3), H33 = 1, with target ~ H source, from N >= 4 pairs (N, 2); normalised DLT.

    Degenerates (raises LinAlgError or returns a singular H) when three of four points are in line.
    Source: Hartley, In defense of the eight-point algorithm, 1997.
    """
    a, b = (np.asarray(p, dtype=np.float64).reshape(-1, 2) for p in (source, target))
    Ta, Tb = _normaliser(a), _normaliser(b)
    x, y = apply_homography(Ta, a).T
    u, v = apply_homography(Tb, b).T
    one, zero = np.ones_like(x), np.zeros_like(x)
    top = np.column_stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u])
    low = np.column_stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v])
    H = np.linalg.svd(np.vstack([top, low]))[2][-1].reshape(3, 3)
    H = np.linalg.solve(Tb, H @ Ta)
    out: Floats = H / H[2, 2]
    return out


def _normaliser(points: Floats) -> Floats:
    centre = points.mean(axis=0)
    scale = np.sqrt(2) / max(np.linalg.norm(points - centre, axis=1).mean(), 1e-12)
    return np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1]])


def apply_homography(H: Floats, points: ArrayLike) -> Floats:
    """Image (N, 2) of points (N, 2) under H (3, 3)."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    w = p @ H[:, :2].T + H[:, 2]
    out: Floats = w[:, :2] / w[:, 2:]
    return out


def homography_jacobian(H: Floats, points: ArrayLike) -> Floats:
    """Derivative (N, 2, 2) of apply_homography by the source point."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    w = p @ H[:, :2].T + H[:, 2]
    image = w[:, :2] / w[:, 2:]
    out: Floats = (H[None, :2, :2] - image[:, :, None] * H[None, None, 2, :2]) / w[:, 2, None, None]
    return out


def diagonal_crossing(corners: ArrayLike) -> Floats:
    """The crossing (N, 2) of the diagonals of N quadrilaterals (N, 4, 2).

    For the image of a square this is the image of its centre, which the mean of the corners is not.
    """
    p1, p2, p3, p4 = np.moveaxis(np.asarray(corners, dtype=np.float64), -2, 0)
    d, e = p3 - p1, p4 - p2
    along = _cross(p2 - p1, e) / _cross(d, e)
    out: Floats = p1 + along[..., None] * d
    return out


def diagonal_crossing_jacobian(corners: ArrayLike) -> Floats:
    """Derivative (N, 2, 8) of diagonal_crossing by the corners x1 y1 … x4 y4.

    A corner displaced along the other diagonal's normal moves the crossing in proportion to the
    crossing's distance from the opposite end; exact to first order.
    """
    c = np.asarray(corners, dtype=np.float64)
    p1, p2, p3, p4 = np.moveaxis(c, -2, 0)
    d, e = p3 - p1, p4 - p2
    w = _cross(d, e)
    s = _cross(p2 - p1, e) / w  # crossing = p1 + s d = p2 + r e
    r = _cross(p2 - p1, d) / w
    n_d = np.stack([-d[..., 1], d[..., 0]], -1)  # n_d . v = cross(d, v)
    n_e = np.stack([-e[..., 1], e[..., 0]], -1)
    on_d = -e / w[..., None]  # moving line d by one normal unit moves the crossing along e
    on_e = d / w[..., None]
    parts = [
        -(1 - s)[..., None, None] * on_d[..., :, None] * n_d[..., None, :],
        -(1 - r)[..., None, None] * on_e[..., :, None] * n_e[..., None, :],
        -s[..., None, None] * on_d[..., :, None] * n_d[..., None, :],
        -r[..., None, None] * on_e[..., :, None] * n_e[..., None, :],
    ]
    return np.concatenate(parts, axis=-1)


def _cross(a: Floats, b: Floats) -> Floats:
    out: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
