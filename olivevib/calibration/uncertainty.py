"""How well everything is known: covariance from the fit and from the scatter of whole views.

Source: MacKinnon & White, Some heteroskedasticity-consistent covariance matrix estimators, 1985
(the jackknife form), with the board view as the unit of chance, and neighbouring views correlated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats
from olivevib.calibration.bundle import LAG, LENS_OF, STEREO, THETA
from olivevib.calibration.solve import Problem, Solution, grams, reduce
from olivevib.geometry import StereoRig, skew, vector_from_rotation

LEVERAGE = 0.75  # 0.5: right on average for many views; 1: the jackknife, wide for few (simulated:
# 97 % within two sigma at 20 stills, 98 % at ten)
LEAST_ALIKE = 0.1  # correlation of neighbouring views below which they count as independent
LEAST_BLOCKS = 6  # blocks of neighbouring views that tell a covariance


@dataclass(frozen=True)
class Uncertainty:
    """Covariances (24, 24) in the order of THETA; parameters that were held have zero rows.

    model: from the sigmas of the points; cluster: from the scatter of the views' gradients, so
    errors shared within a view count; published: the model widened where the views scatter more
    than it says. pull (V,): g H^-1 g of each view, large where one view pulls hard; alike: how many
    neighbouring views err alike.
    """

    model: Floats
    cluster: Floats
    published: Floats
    pull: Floats
    alike: int


def uncertainty(problem: Problem, solution: Solution) -> Uncertainty:
    """Both covariances of a solution and the one to publish."""
    gram, _ = grams(problem, solution.state)
    reduced = reduce(problem, solution.state, gram)
    model = firm_inverse(reduced.total_H)
    used = np.einsum("vii->v", reduced.H) > 0
    H, g = reduced.H[used], reduced.g[used]
    count = max(int(used.sum()), 2)
    lever = np.eye(len(model)) - H @ model
    pulls = np.linalg.solve(lever, g[:, :, None])[:, :, 0] * np.sqrt((count - 1) / count)
    cluster = symmetric(model @ (pulls.T @ pulls + reduced.prior_matrix) @ model)
    lag = int(problem.free[:LAG].sum()) if problem.free[LAG] else None
    size = alike_views(model, H, g)
    published = widen(model, H, g, reduced.prior_matrix, size, lag)
    pull = np.zeros(used.size)
    pull[used] = np.einsum("vi,ij,vj->v", g, model, g)
    full = [_full(problem, matrix) for matrix in (model, cluster, published)]
    return Uncertainty(full[0], full[1], full[2], pull, size)


def firm_inverse(H: Floats) -> Floats:
    """The inverse of an information matrix (p, p); directions without any get a huge variance."""
    diagonal = np.diag(H)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(symmetric(H * np.outer(scale, scale)))
    inside = vectors / np.maximum(values, 1e-12) @ vectors.T
    return symmetric(inside * np.outer(scale, scale))


def widen(
    model: Floats,
    H: Floats,
    g: Floats,
    prior_matrix: Floats,
    size: int = 1,
    lag: int | None = None,
) -> Floats:
    """The model covariance (p, p), widened wherever the views scatter more than it says.

    H (V, p, p), g (V, p) information and gradient of each view, in the order of time; ``size``
    neighbours err alike and count as one. In a frame in which the model is the unit matrix, the
    scatter, each block of views freed from its own leverage (Bell & McCaffrey, 2002), is shrunk
    towards its mean by as much as so few blocks make it uncertain (Ledoit & Wolf, A
    well-conditioned estimator for large-dimensional covariance matrices, 2004); no direction ends
    below the model. ``lag``: the parameter whose scatter from view to view the model holds already
    (the jitter); it is shrunk towards its own scatter, not towards that of the others.
    """
    root = factor(model, lag)
    x = _freed(blocks(root.T @ H @ root, size), blocks(g @ root, size))
    x = x * np.sqrt(len(x))
    scatter = x.T @ x / len(x) + root.T @ prior_matrix @ root
    target = np.full(len(scatter), np.trace(scatter) / len(scatter))
    if lag is not None:
        target[0], target[1:] = scatter[0, 0], np.diag(scatter)[1:].mean()
    spread = float(((scatter - np.diag(target)) ** 2).sum())
    each = ((x * x).sum(axis=1) ** 2).sum() / len(x) ** 2 - ((x.T @ x / len(x)) ** 2).sum() / len(x)
    shrink = float(np.clip(each / max(spread, 1e-300), 0, 1))
    values, turn = np.linalg.eigh(shrink * np.diag(target) + (1 - shrink) * scatter)
    whitened = turn @ np.diag(np.maximum(values, 1.0)) @ turn.T
    return symmetric(root @ whitened @ root.T)


def _freed(H: Floats, g: Floats) -> Floats:
    """Gradients (V, p) in the model's own frame, each freed from its own leverage H (V, p, p)."""
    lever, axes = np.linalg.eigh(symmetric(H))
    free = np.maximum(1 - lever, 1e-3) ** -LEVERAGE
    return np.asarray(np.einsum("vij,vj,vkj,vk->vi", axes, free, axes, g), dtype=np.float64)


def factor(model: Floats, first: int | None) -> Floats:
    """A factor (p, p) of a covariance, model = factor factor^T; column 0 is parameter ``first``'s.

    By eigenvalues, since a Cholesky factor fails where nothing is known.
    """
    rest, columns = model, []
    if first is not None and model[first, first] > 0:
        columns.append(model[:, first] / np.sqrt(model[first, first]))
        rest = symmetric(model - np.outer(columns[0], columns[0]))
    sizes, vectors = np.linalg.eigh(rest)
    root = vectors * np.sqrt(np.maximum(sizes, 0.0))
    if columns:
        return np.column_stack([columns[0], root[:, 1:]])  # the smallest is that of ``first``: none
    return np.asarray(root, dtype=np.float64)


def alike_views(model: Floats, H: Floats, g: Floats) -> int:
    """How many neighbouring views, in the order of time, err alike and count as one.

    model (p, p), H (V, p, p), g (V, p): covariance, information and gradient of each view.

    Neighbouring frames of a waved board do (the same corners on the same pixels, the same motion).
    Twice the lag at which the correlation, over all directions together, is gone; at least
    ``LEAST_BLOCKS`` blocks remain. Source: Carlstein, The use of subseries values, 1986 (blocks).
    """
    root = factor(model, None)
    x = _freed(root.T @ H @ root, g @ root)
    square, most = float((x * x).sum()), max(len(x) // LEAST_BLOCKS, 1)
    gone = 2 / np.sqrt(max(x.size, 1))
    for k in range(1, most // 2 + 1):
        if float((x[k:] * x[:-k]).sum()) < max(gone, LEAST_ALIKE) * square:
            return max(2 * (k - 1), 1)
    return most


def blocks(values: Floats, size: int) -> Floats:
    """Sums over blocks of ``size`` neighbouring rows (the last block may be shorter)."""
    return np.add.reduceat(values, np.arange(0, len(values), size), axis=0)


def symmetric(matrix: NDArray[np.floating[Any]]) -> Floats:
    """The symmetric part of a matrix (..., p, p), against rounding."""
    out: Floats = (matrix + np.swapaxes(matrix, -1, -2)) / 2
    return out


def _full(problem: Problem, matrix: Floats) -> Floats:
    out = np.zeros((len(THETA), len(THETA)))
    out[np.ix_(problem.free, problem.free)] = matrix
    return out


def rig_covariance(theta: Floats, R: Floats) -> Floats:
    """Covariance (18, 18) of geometry.RIG from one of THETA: small rotation to rotation vector."""
    J = np.eye(LAG)
    J[STEREO, STEREO][:3, :3] = vector_jacobian(R)
    out: Floats = J @ theta[:LAG, :LAG] @ J.T
    return symmetric(out)


def vector_jacobian(R: Floats) -> Floats:
    """Derivative (3, 3) of the rotation vector by a small rotation on the left."""
    v = vector_from_rotation(R)
    angle, S = float(np.linalg.norm(v)), skew(v)
    if angle < 1e-6:
        return np.asarray(np.eye(3) - S / 2, dtype=np.float64)
    factor = 1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))
    return np.asarray(np.eye(3) - S / 2 + factor * S @ S, dtype=np.float64)


@dataclass(frozen=True)
class PointSigma:
    """How well points are known: covariances (N, 3, 3) mm^2, the rig's part and one frame's part.

    common: the same error in every frame (the rig is a little wrong); frame: fresh in every frame
    (the pixels are).
    """

    common: Floats
    frame: Floats

    @property
    def common_mm(self) -> Floats:
        """Sigma of x, y, z (N, 3) from the rig."""
        return np.asarray(np.sqrt(np.einsum("nii->ni", self.common)), dtype=np.float64)

    @property
    def frame_mm(self) -> Floats:
        """Sigma of x, y, z (N, 3) from the pixels of one frame."""
        return np.asarray(np.sqrt(np.einsum("nii->ni", self.frame)), dtype=np.float64)


def rig_sensitivity(rig: StereoRig, xyz_mm: Floats) -> tuple[Floats, Floats]:
    """Derivatives of points (left frame) by RIG (N, 3, 18) and by the four pixels (N, 3, 4).

    NaN for points that not both cameras have in front of them.
    """
    J = np.zeros((len(xyz_mm), 4, LAG))
    _, by_left, J[:, :2, LENS_OF[0]] = rig.left.project_jacobian(xyz_mm)
    turned = xyz_mm @ rig.R_right_left.T
    _, by_right, lens = rig.right.project_jacobian(turned + rig.t_right_left_mm)
    J[:, 2:, LENS_OF[1]] = lens
    small = -by_right @ skew(turned)
    J[:, 2:, 12:15] = small @ np.linalg.inv(vector_jacobian(rig.R_right_left))
    J[:, 2:, 15:18] = by_right
    A = np.concatenate([by_left, by_right @ rig.R_right_left], axis=1)
    normal = A.transpose(0, 2, 1) @ A
    backward = np.full((len(xyz_mm), 3, 4), np.nan)
    seen = np.isfinite(normal).all(axis=(1, 2))  # in front of both cameras
    seen[seen] = np.linalg.det(normal[seen]) > 0
    backward[seen] = np.linalg.solve(normal[seen], A[seen].transpose(0, 2, 1))
    return -backward @ J, backward


def point_sigma(rig: StereoRig, xyz_mm: Floats, sigma_px: tuple[float, float]) -> PointSigma:
    """What to expect of points (N, 3) mm in the left frame, measured with these pixel sigmas.

    Needs ``rig.covariance``; NaN for points that a camera has behind it.
    """
    by_rig, by_px = rig_sensitivity(rig, xyz_mm)
    noise = np.diag(np.repeat(np.square(sigma_px), 2))
    cov = np.full((LAG, LAG), np.nan) if rig.covariance is None else rig.covariance
    frame = by_px @ noise @ by_px.transpose(0, 2, 1)
    return PointSigma(by_rig @ cov @ by_rig.transpose(0, 2, 1), frame)


def length_sigma(rig: StereoRig, a_mm: Floats, b_mm: Floats) -> Floats:
    """Sigma (N,) mm of the distances between points (N, 3) that an error of the rig causes."""
    between = a_mm - b_mm
    unit = between / np.linalg.norm(between, axis=1, keepdims=True)
    by_rig = rig_sensitivity(rig, a_mm)[0] - rig_sensitivity(rig, b_mm)[0]
    slope = np.einsum("ni,nij->nj", unit, by_rig)
    cov = np.full((LAG, LAG), np.nan) if rig.covariance is None else rig.covariance
    return np.asarray(np.sqrt(np.einsum("ni,ij,nj->n", slope, cov, slope)), dtype=np.float64)
