"""One marker in both cameras as a linear problem in sway and harmonics, at given times.

Every row of pixels is whitened with its frame's covariance; each point keeps its own time, so the
columns are exact however long the marker is in rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector, skew
from olivevib.reconstruction.motion.sightings import MarkerSightings, Sightings
from olivevib.reconstruction.motion.spline import ORDER, Knots


@dataclass(frozen=True)
class Times:
    """What the times of all points depend on. theta: TIMING's offset, drift and row times."""

    offset_s: float
    drift: float
    left_row_s: float
    right_row_s: float
    mid_s: float


@dataclass(frozen=True)
class Pose:
    """Mean pose of a marker: X = exp(r) R0 p + t0 + x."""

    R0: Floats
    t0_mm: Floats


@dataclass(frozen=True)
class Problem:
    """Both cameras' frames of one marker stacked (N): zero_s, right (N,), rho (N, K) rows of the
    nodes from the reference row; V (N, K, 2P, 6) whitened Jacobians; y (N, 2P) whitened data such
    that y = sum_j V_j xi(t_j) + noise.
    """

    zero_s: Floats
    right: Bools
    rho: Floats
    V: Floats
    y: Floats

    def times(self, clock: Times) -> Floats:
        """(N, P) the instant of every point."""
        late = clock.offset_s + clock.drift * (self.zero_s + clock.offset_s - clock.mid_s)
        row = np.where(self.right, clock.right_row_s, clock.left_row_s)
        start = self.zero_s + np.where(self.right, late, 0.0)
        return np.asarray(start[:, None] + self.rho * row[:, None])


@dataclass(frozen=True)
class Whitening:
    """Inverse square roots of the pixel covariances (N, 2P, 2P) of each camera's frames."""

    left: Floats
    right: Floats


def localiser_whitening(view: Sightings) -> Floats:
    """From the localiser's own covariances."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(view.covariance_px2)))


def left_jacobian(r: Floats) -> Floats:
    """(..., 3, 3): d exp(r) turns by J dr; series to r^4, 1e-9 at 0.1 rad."""
    S = skew(r)
    S2 = S @ S
    q = np.sum(r * r, axis=-1)[..., None, None]
    return np.asarray(np.eye(3) + (0.5 - q / 24) * S + (1 / 6 - q / 120) * S2)


def project(
    camera: CameraModel, rig: StereoRig | None, pose: Pose, points_mm: Floats, xi: Floats
) -> tuple[Floats, Floats]:
    """Pixels (N, P, 2) and derivatives by xi (N, P, 2, 6); xi (N, P, 6) at each point's time.

    rig: None for the left camera.
    """
    n, p = xi.shape[:2]
    q = np.einsum("npij,pj->npi", rotation_from_vector(xi[..., 3:]), points_mm @ pose.R0.T)
    X = (q + pose.t0_mm + xi[..., :3]).reshape(-1, 3)
    if rig is None:
        px, by_point, _ = camera.project_jacobian(X)
    else:
        px, by_point, _ = camera.project_jacobian(rig.to_right(X))
        by_point = by_point @ rig.R_right_left
    by_point = by_point.reshape(n, p, 2, 3)
    turn = -by_point @ skew(q) @ left_jacobian(xi[..., 3:])
    return px.reshape(n, p, 2), np.concatenate([by_point, turn], axis=-1)


def linearise(
    marker: MarkerSightings,
    rig: StereoRig,
    pose: Pose,
    whiten: Whitening,
    at: tuple[Floats, Floats],
    reference_row: float,
) -> Problem:
    """The linear problem about the motion ``at``: xi of the left and right nodes (N, K, 6)."""
    parts = []
    for view, W, xi, other in (
        (marker.left, whiten.left, at[0], None),
        (marker.right, whiten.right, at[1], rig),
    ):
        camera = rig.left if other is None else rig.right
        px, J = project(camera, other, pose, marker.moving_mm, xi)
        seen = view.px if view.drawn is None else view.drawn.px
        data = seen - px + np.einsum("npij,npj->npi", J, xi)
        M = W if view.drawn is None else W @ view.drawn.reported  # (N, 2P, 2K)
        n, k = data.shape[:2]
        split = M.reshape(n, -1, k, 2).transpose(0, 2, 1, 3)  # (N, K, 2P, 2)
        V, y = split @ J, np.einsum("nij,nj->ni", M, data.reshape(n, 2 * k))
        parts.append((view.row_zero_s, np.full(n, other is not None), view.row, V, y))
    zero, right, row, V, y = (np.concatenate(c) for c in zip(*parts, strict=True))
    return Problem(zero, right, row - reference_row, V, y)


@dataclass(frozen=True)
class Sway:
    """The sway's part of the normal equations at given times, factored.

    groups (I, m): frames of each knot interval, N for none; D (I, m 2P, 36) their columns;
    L (6B, 6B) lower Cholesky factor of the normal matrix with its prior.
    """

    knots: Knots
    groups: Ints
    D: Floats
    L: Floats

    def by_interval(self, columns: Floats) -> Floats:
        """(N, 2P, k) columns of frames gathered by interval: (I, m 2P, k)."""
        _, d, k = columns.shape
        padded = np.concatenate([columns, np.zeros((1, d, k))])
        out: Floats = padded[self.groups].reshape(len(self.groups), -1, k)
        return out

    def cross(self, gathered: Floats) -> Floats:
        """(6B, k) products of the sway's columns with gathered others."""
        each = self.D.transpose(0, 2, 1) @ gathered
        out = np.zeros((self.knots.count, 6, gathered.shape[2]))
        intervals = len(each)
        parts = each.reshape(intervals, ORDER, 6, -1)
        for b in range(ORDER):
            out[b : b + intervals] += parts[:, b]
        return out.reshape(6 * self.knots.count, -1)


def group_frames(interval: Ints, intervals: int, none: int) -> Ints:
    """(I, m) frame numbers by interval, padded with ``none``."""
    order = np.argsort(interval, kind="stable")
    counts = np.bincount(interval, minlength=intervals)
    out = np.full((intervals, max(1, int(counts.max()))), none)
    place = np.arange(interval.size) - np.repeat(np.cumsum(counts) - counts, counts)
    out[interval[order], place] = order
    return out


def sway_part(problem: Problem, t_s: Floats, knots: Knots, prior: Floats) -> Sway:
    """Columns, normal matrix and factor of the sway; prior (6,): precision of each coefficient."""
    interval = knots.interval(t_s.mean(axis=1))
    w = knots.weights(t_s, interval[:, None])  # (N, P, 6)
    n, p, d, _ = problem.V.shape
    D = w.transpose(0, 2, 1) @ problem.V.reshape(n, p, d * 6)  # (N, 6, d 6)
    D = D.reshape(n, ORDER, d, 6).transpose(0, 2, 1, 3).reshape(n, d, 6 * ORDER)
    groups = group_frames(interval, knots.count - ORDER + 1, n)
    draft = Sway(knots, groups, np.empty(0), np.empty(0))
    D = draft.by_interval(D)
    blocks = D.transpose(0, 2, 1) @ D
    N = np.diag(np.tile(prior, knots.count))
    for i, block in enumerate(blocks):
        at = slice(6 * i, 6 * i + 6 * ORDER)
        N[at, at] += block
    return replace(draft, D=D, L=np.asarray(np.linalg.cholesky(N), dtype=np.float64))


def harmonic_columns(problem: Problem, phase: Floats, harmonics: int) -> Floats:
    """(N, 2P, 12 H): cosine and sine of each harmonic for the six axes; phase (N, P) rad."""
    n, p, d, _ = problem.V.shape
    h = np.arange(1, harmonics + 1)
    angle = phase[:, None, :] * h[:, None]  # (N, H, P)
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=2).reshape(n, 2 * harmonics, p)
    Z = basis @ problem.V.reshape(n, p, d * 6)
    return Z.reshape(n, 2 * harmonics, d, 6).transpose(0, 2, 1, 3).reshape(n, d, 12 * harmonics)
