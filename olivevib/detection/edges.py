"""Corners of a square marker from its four straight edges, with an honest covariance.

Each side is crossed by scan lines; on each the edge is the centroid of the grey step; a robust line
through these points is the side, and neighbouring sides meet in the corners. Points near the ends
are left out, so neighbours (a chessboard's squares) do not pull the corners as they do with
cv2.cornerSubPix. Source: line-intersection corners, e.g. Olson, AprilTag (ICRA 2011), section III.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, Grey

STEP_PX = 0.25  # distance of samples on a scan line
CORRELATION = 2.0  # scan lines 1 px apart share pixels: their errors count about half
TUKEY = 4.685  # robust tuning constant, 95 % efficiency
NOISE_FLOOR_PX = 0.02  # smallest believed scatter of an edge point (8-bit rounding, texture)
ROOMY_PX = 6.5  # from this module width on the whole slope counts, and the pixel grid hardly
GRID_SIGMA_PX = {True: 0.012, False: 0.006}  # what the pixel grid does to a whole side
ROUGH_PX = 0.4  # an edge whose points scatter more is covered or not straight
CROWDED_PX = 3.5  # below this module width neighbouring edges pull: a bias sigma is added
CROWDED_SIGMA = 0.06  # px of bias sigma per px of missing module width (rendered scenes)


@dataclass(frozen=True)
class Quad:
    """Refined corners (4, 2), their covariance (8, 8) px², rms scatter of the edge points, px."""

    corners_px: Floats
    covariance_px2: Floats
    rms_px: float


@dataclass(frozen=True)
class _Side:
    """One edge: the points base + t along + offset normal with offset = a + b t (px)."""

    base: Floats
    along: Floats
    normal: Floats
    a: float
    b: float
    covariance: Floats  # (2, 2) of a, b
    rms_px: float


def refine_quad(grey: Grey, corners: Floats, modules: int) -> Quad | None:
    """Refine the outer corners (4, 2) of a dark or light square of ``modules`` modules a side.

    grey: (H, W) uint8. The start may be off by up to a third of a module. None where a side has no
    usable edge (too small, outside the image, covered). Errors are independent between sides.
    """
    sides = []
    for k in range(4):
        far = (corners[(k + 2) % 4] + corners[(k + 3) % 4]) / 2
        side = _side(grey, corners[k], corners[(k + 1) % 4], far, modules)
        if side is None:
            return None
        sides.append(side)
    points = np.empty((4, 2))
    jacobian = np.zeros((8, 8))
    for k in range(4):
        before, after = sides[k - 1], sides[k]
        points[k] = _meet(before, after)
        jacobian[2 * k : 2 * k + 2] = _meet_jacobian(before, after, points[k], k)
    spread = np.zeros((8, 8))
    for k, side in enumerate(sides):
        spread[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = side.covariance
    covariance = jacobian @ spread @ jacobian.T
    rms = float(np.sqrt(np.mean([side.rms_px**2 for side in sides])))
    return Quad(points, (covariance + covariance.T) / 2, rms)


def _side(grey: Grey, start: Floats, end: Floats, far: Floats, modules: int) -> _Side | None:
    """The side from ``start`` to ``end``; ``far`` is the middle of the side opposite."""
    length = float(np.hypot(*(end - start)))
    if length < 8:
        return None
    along = (end - start) / length
    normal = np.array([along[1], -along[0]])  # outwards, corners running clockwise on the screen
    module = abs(float(normal @ (far - start))) / modules
    reach = float(np.clip(0.45 * module, 1.25, 3.0))
    half = 0.5 * length - max(1.5, 0.08 * length)
    t = np.linspace(-half, half, max(6, int(2 * half) + 1))
    base = (start + end) / 2
    wide = float(np.clip(0.7 * module, reach, 4.0))  # the start may be off by a pixel or two
    first = _offsets(grey, base[None] + t[:, None] * along, normal, wide, True)
    line = _line(t, first) if first is not None else None
    if line is None:
        return None
    a, b, _, _ = line
    moved = base + a * normal
    turned = np.array([along + b * normal, normal - b * along]) / np.hypot(1.0, b)
    clipped = module < ROOMY_PX
    again = _offsets(grey, moved[None] + t[:, None] * turned[0], turned[1], reach, clipped)
    line = _line(t, again) if again is not None else None
    if line is None or line[3] > ROUGH_PX:
        return None
    a, b, covariance, rms = line
    covariance[0, 0] += (CROWDED_SIGMA * max(0.0, CROWDED_PX - module)) ** 2
    covariance[0, 0] += GRID_SIGMA_PX[clipped] ** 2
    return _Side(moved, turned[0], turned[1], a, b, covariance, rms)


def _offsets(
    grey: Grey, feet: Floats, normal: Floats, reach: float, clipped: bool
) -> Floats | None:
    """Edge position on the scan line through each of ``feet`` (N, 2), px; NaN where unclear.

    The centroid of the grey slope; ``clipped`` leaves out the weak part of it, where other edges
    are near. That costs linearity: the position then depends a little on the pixel grid.
    """
    s = np.arange(-reach - STEP_PX / 2, reach + STEP_PX, STEP_PX)
    points = feet[:, None, :] + s[None, :, None] * normal
    height, width = grey.shape
    inside = (points >= 0).all() and (points[..., 0].max() < width - 1)
    if not (inside and points[..., 1].max() < height - 1):
        return None
    slope = np.diff(_bilinear(grey, points), axis=1)
    if slope.sum() < 0:  # light square on dark
        slope = -slope
    centre = (s[:-1] + s[1:]) / 2
    step = slope.sum(axis=1)
    weight = slope
    if clipped:
        weight = np.clip(slope - 0.1 * slope.max(axis=1, keepdims=True), 0, None)
    total = weight.sum(axis=1)
    good = (step > 0.4 * np.median(step)) & (step > 8) & (total > 0)
    where = (weight @ centre) / np.where(total > 0, total, 1.0)
    out: Floats = np.where(good, where, np.nan)
    return out


def _bilinear(grey: Grey, points: Floats) -> Floats:
    """Grey values at ``points`` (..., 2), which lie inside the image."""
    x, y = points[..., 0], points[..., 1]
    i, j = x.astype(np.intp), y.astype(np.intp)
    fx, fy = x - i, y - j
    top = grey[j, i] * (1 - fx) + grey[j, i + 1] * fx
    low = grey[j + 1, i] * (1 - fx) + grey[j + 1, i + 1] * fx
    out: Floats = top * (1 - fy) + low * fy
    return out


def _line(t: Floats, offset: Floats) -> tuple[float, float, Floats, float] | None:
    """Robust a, b of offset = a + b t, their covariance and the rms scatter; None if too few."""
    good: Bools = np.isfinite(offset)
    if good.sum() < max(4, t.size // 3):
        return None
    t, y = t[good], offset[good]
    weight = np.ones_like(t)
    for _ in range(4):
        A = np.stack([np.ones_like(t), t], axis=1)
        normal = (A * weight[:, None]).T @ A
        a, b = np.linalg.solve(normal, A.T @ (weight * y))
        residual = y - a - b * t
        scale = max(1.4826 * float(np.median(np.abs(residual))), NOISE_FLOOR_PX)
        u = np.clip(residual / (TUKEY * scale), -1, 1)
        weight = (1 - u**2) ** 2
        if weight.sum() < max(3.0, t.size / 3):
            return None
    rms = float(np.sqrt(np.sum(weight * residual**2) / max(weight.sum() - 2, 1.0)))
    scatter = CORRELATION * max(rms, NOISE_FLOOR_PX) ** 2
    covariance: Floats = scatter * np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return float(a), float(b), covariance, rms


def _meet(one: _Side, two: _Side) -> Floats:
    """Where two sides cross."""
    rows = np.array([one.normal - one.b * one.along, two.normal - two.b * two.along])
    right = np.array([one.a + rows[0] @ one.base, two.a + rows[1] @ two.base])
    return np.asarray(np.linalg.solve(rows, right), dtype=np.float64)


def _meet_jacobian(one: _Side, two: _Side, corner: Floats, k: int) -> Floats:
    """Derivative (2, 8) of corner k by (a, b) of sides 0…3; it depends on sides k - 1 and k."""
    rows = np.array([one.normal - one.b * one.along, two.normal - two.b * two.along])
    inverse = np.linalg.inv(rows)
    out = np.zeros((2, 8))
    for column, (side, at) in enumerate(((one, (k - 1) % 4), (two, k))):
        t = float(side.along @ (corner - side.base))
        out[:, 2 * at] = inverse[:, column]
        out[:, 2 * at + 1] = inverse[:, column] * t
    return out
