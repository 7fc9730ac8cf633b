"""Board to image within one view: a homography and the gentle bend that lens and paper add."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import apply_homography, homography, homography_jacobian

QUADRATIC_FROM, CUBIC_FROM = 9, 24  # points that carry a bend of that degree


@dataclass(frozen=True)
class Warp:
    """px = H(board) + polynomial(board); ``bend`` (T, 2) px, on coordinates centred and scaled."""

    H: Floats
    bend: Floats
    centre_mm: Floats
    scale_mm: float

    def _terms(self, board_mm: Floats) -> tuple[Floats, Floats]:
        """Monomials (N, T) and their derivatives by board x and y (N, T, 2)."""
        x, y = ((board_mm - self.centre_mm) / self.scale_mm).T
        degree = {1: 0, 3: 1, 6: 2, 10: 3}[len(self.bend)]
        powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
        terms = np.stack([x**i * y**j for i, j in powers], -1)
        dx = np.stack([i * x ** max(i - 1, 0) * y**j for i, j in powers], -1)
        dy = np.stack([j * x**i * y ** max(j - 1, 0) for i, j in powers], -1)
        return terms, np.stack([dx, dy], -1) / self.scale_mm

    def forward(self, board_mm: Floats) -> Floats:
        """Pixels (N, 2) of board points (N, 2)."""
        terms, _ = self._terms(board_mm)
        out: Floats = apply_homography(self.H, board_mm) + terms @ self.bend
        return out

    def jacobian(self, board_mm: Floats) -> Floats:
        """Derivative of the pixel by the board point (N, 2, 2)."""
        _, slopes = self._terms(board_mm)
        bend = np.einsum("nti,tj->nji", slopes, self.bend)
        return np.asarray(homography_jacobian(self.H, board_mm) + bend, dtype=np.float64)

    def local_inverse(self, board_mm: Floats, reach_mm: Floats) -> list[LocalInverse]:
        """For each point (N, 2) the way back from pixels near it, good within its reach (N,)."""
        u, v = (grid.ravel() for grid in np.meshgrid(*[np.linspace(-1, 1, 7)] * 2))
        around = np.column_stack([u, v])
        places = board_mm[:, None] + reach_mm[:, None, None] * around
        px = self.forward(places.reshape(-1, 2)).reshape(len(board_mm), -1, 2)
        off = px - self.forward(board_mm)[:, None]
        scale = np.maximum(np.abs(off).max(axis=(1, 2)), 1e-9)
        terms = _monomials(off[:, :, 0] / scale[:, None], off[:, :, 1] / scale[:, None])
        normal = terms.transpose(0, 2, 1) @ terms + RIDGE * np.eye(len(CUBIC))
        back = np.linalg.solve(normal, terms.transpose(0, 2, 1) @ places)
        return [LocalInverse(b, float(s)) for b, s in zip(back, scale, strict=True)]


RIDGE = 1e-9  # of 49: a board seen edge-on by a wrong reading has no way back, but no crash either
CUBIC = tuple((i, j) for i in range(4) for j in range(4 - i))


def _monomials(x: Floats, y: Floats) -> Floats:
    """All x^i y^j up to the third degree (..., 10)."""
    one = np.ones_like(x)
    px, py = (one, x, x * x, x * x * x), (one, y, y * y, y * y * y)
    return np.stack([px[i] * py[j] for i, j in CUBIC], -1)


@dataclass(frozen=True)
class LocalInverse:
    """Board place as a cubic in the pixels' distance from one point; scale_px keeps it tame."""

    coefficients: Floats  # (10, 2)
    scale_px: float

    def at(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Board points (M, 2) and d board / d pixel (M, 4) at these distances, px."""
        x, y = x / self.scale_px, y / self.scale_px
        c = self.coefficients
        terms = _monomials(x, y)
        slope = np.zeros((len(CUBIC), 4))
        for k, (i, j) in enumerate(CUBIC):  # derivative of x^i y^j, again in monomials
            if i:
                slope[CUBIC.index((i - 1, j)), [0, 2]] += i * c[k]
            if j:
                slope[CUBIC.index((i, j - 1)), [1, 3]] += j * c[k]
        return terms @ c, terms @ slope / self.scale_px


def sane(warp: Warp, board_mm: Floats) -> bool:
    """Whether the warp neither folds nor flips anywhere near the points (N, 2)."""
    det = np.linalg.det(warp.jacobian(board_mm))
    size = np.abs(det)
    return bool(
        np.isfinite(det).all()
        and (np.sign(det) == np.sign(det[0])).all()
        and size.min() > 1e-3 * size.max()
    )


def straight(H: Floats) -> Warp:
    """The warp that is the homography alone."""
    return Warp(H, np.zeros((1, 2)), np.zeros(2), 1.0)


def bent_warp(board_mm: Floats, px: Floats) -> Warp:
    """The warp through points (N, 2): bent as far as the number of points bears."""
    H = robust_homography(board_mm, px)
    if len(px) < QUADRATIC_FROM:
        return straight(H)
    centre = board_mm.mean(axis=0)
    scale = float(np.abs(board_mm - centre).max())
    count = 10 if len(px) >= CUBIC_FROM else 6
    warp = Warp(H, np.zeros((count, 2)), centre, scale)
    terms, _ = warp._terms(board_mm)
    left = px - apply_homography(H, board_mm)
    weight = np.ones(len(px))
    for _ in range(4):  # Cauchy weights: a wrong point does not bend the rest
        A = terms * weight[:, None]
        bend = np.linalg.solve(A.T @ terms + 1e-3 * np.eye(count), A.T @ left)
        miss = np.linalg.norm(left - terms @ bend, axis=1)
        weight = 1 / (1 + (miss / max(2 * float(np.median(miss)), 0.05)) ** 2)
    return Warp(H, np.asarray(bend), centre, scale)


def robust_homography(board_mm: Floats, px: Floats) -> Floats:
    """Board to image from points of which a few may be wrong; drops those beyond 4 medians."""
    keep = np.ones(len(px), dtype=np.bool_)
    H = homography(board_mm, px)
    for _ in range(5):
        miss = np.linalg.norm(apply_homography(H, board_mm) - px, axis=1)
        keep = miss <= max(4 * float(np.median(miss)), 0.3)
        if keep.sum() < 4 or keep.all():
            break
        H = homography(board_mm[keep], px[keep])
    return H
