"""How well everything is known: covariance from the fit and from the scatter of whole views.

Source: MacKinnon & White, Some heteroskedasticity-consistent covariance matrix estimators, 1985
(the jackknife form), with the board view as the unit of chance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.bundle import LAG, STEREO, THETA
from olivevib.calibration.solve import Problem, Solution, grams, reduce
from olivevib.geometry import skew, vector_from_rotation


@dataclass(frozen=True)
class Uncertainty:
    """Covariances (24, 24) in the order of THETA; parameters that were held have zero rows.

    model: from the sigmas of the points; cluster: from the scatter of the views' gradients, so
    errors shared within a view count; published: the model widened so that no parameter's sd is
    below either. sd_view (V,): g H^-1 g of each view, large where one view pulls hard.
    """

    model: Floats
    cluster: Floats
    published: Floats
    pull: Floats


def uncertainty(problem: Problem, solution: Solution) -> Uncertainty:
    """Both covariances of a solution and the one to publish."""
    gram, _ = grams(problem, solution.state)
    reduced = reduce(problem, solution.state, gram)
    model = symmetric(np.linalg.inv(reduced.total_H))
    used = np.einsum("vii->v", reduced.H) > 0
    H, g = reduced.H[used], reduced.g[used]
    count = max(int(used.sum()), 2)
    lever = np.eye(len(model)) - H @ model
    pulls = np.linalg.solve(lever, g[:, :, None])[:, :, 0] * np.sqrt((count - 1) / count)
    cluster = symmetric(model @ (pulls.T @ pulls + reduced.prior_H) @ model)
    published = widen(model, pulls, reduced.prior_H)
    pull = np.zeros(used.size)
    pull[used] = np.einsum("vi,ij,vj->v", g, model, g)
    full = [_full(problem, matrix) for matrix in (model, cluster, published)]
    return Uncertainty(full[0], full[1], full[2], pull)


def widen(model: Floats, pulls: Floats, prior_H: Floats) -> Floats:
    """The model covariance (p, p), widened wherever the views (V, p) scatter more than it says.

    In the frame in which the model is the unit matrix, the views' scatter is shrunk towards its
    mean by as much as so few views make it uncertain (Ledoit & Wolf, A well-conditioned estimator
    for large-dimensional covariance matrices, 2004); no direction ends below the model.
    """
    root = np.linalg.cholesky(model)
    x = np.sqrt(len(pulls)) * pulls @ root
    own = root.T @ prior_H @ root
    scatter = x.T @ x / len(x) + own
    mean, p = np.trace(scatter) / len(scatter), len(scatter)
    spread = float(((scatter - mean * np.eye(p)) ** 2).sum())
    each = ((x * x).sum(axis=1) ** 2).sum() / len(x) ** 2 - ((x.T @ x / len(x)) ** 2).sum() / len(x)
    shrink = float(np.clip(each / max(spread, 1e-300), 0, 1))
    values, vectors = np.linalg.eigh(shrink * mean * np.eye(p) + (1 - shrink) * scatter)
    whitened = vectors @ np.diag(np.maximum(values, 1.0)) @ vectors.T
    return symmetric(root @ whitened @ root.T)


def symmetric(matrix: Floats) -> Floats:
    """The symmetric part, against rounding."""
    out: Floats = (matrix + matrix.T) / 2
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
