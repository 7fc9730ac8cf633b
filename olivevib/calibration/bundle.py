"""The joint least-squares problem of two lenses, their pose, the lag, the board and its poses.

Board point P = (X, Y, bow) mm; left camera X1 = R_f P + t_f; right camera X2 = R X1 + t. The right
camera is late by tau: what the left one shows at its stamp t, the right one shows at t + tau.
Source: Brown, Close-range camera calibration, 1971; Triggs et al., Bundle adjustment, 2000.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.calibration.tracks import polynomial
from olivevib.geometry import LENS, CameraModel, rotation_from_vector, skew

POSE = 7  # unknowns of one view: rotation, translation, jitter of the lag
LEFT, RIGHT, RIGHT_ALONE = 0, 1, 2  # chain of an observation: which camera, through which pose
THETA = tuple(f"left_{p}" for p in LENS) + tuple(f"right_{p}" for p in LENS) + (
    *("wx", "wy", "wz"),  # small rotation on the left of R_right_left, rad
    *("tx", "ty", "tz"),  # mm
    "lag",  # s
    *("bow_xx", "bow_xy", "bow_yy"),  # mm at half the board's width
    *("left_row_time", "right_row_time"),  # s per sensor row
)  # fmt: skip
STEREO, LAG, BOW = slice(12, 18), 18, slice(19, 22)
LENS_OF, ROW_OF = (slice(0, 6), slice(6, 12)), (22, 23)


@dataclass(frozen=True)
class State:
    """One value of every unknown; R_pose (V, 3, 3), t_pose_mm (V, 3) are the board poses.

    jitter_s (V,): by how much the lag of a single view departs from ``lag_s`` (stamps of webcams
    scatter by milliseconds); row_time_s (2,) of left and right.
    """

    left: CameraModel
    right: CameraModel
    R: Floats
    t_mm: Floats
    lag_s: float
    bow_mm: Floats
    R_pose: Floats
    t_pose_mm: Floats
    jitter_s: Floats
    row_time_s: Floats

    def moved(self, theta: Floats, pose: Floats) -> State:
        """The state after a step: theta (24,), pose (V, 7) rotation, translation, jitter."""
        return State(
            self.left.with_lens(self.left.lens + theta[:6]),
            self.right.with_lens(self.right.lens + theta[6:12]),
            rotation_from_vector(theta[12:15]) @ self.R,
            self.t_mm + theta[15:18],
            self.lag_s + float(theta[LAG]),
            self.bow_mm + theta[BOW],
            rotation_from_vector(pose[:, :3]) @ self.R_pose,
            self.t_pose_mm + pose[:, 3:6],
            self.jitter_s + pose[:, 6],
            self.row_time_s + theta[list(ROW_OF)],
        )


@dataclass(frozen=True)
class Observations:
    """All image points of the problem, sorted by chain (LEFT, RIGHT, RIGHT_ALONE).

    chain (N,), pose (N,) index of the board pose, ids (N,) of the points, board_mm (N, 3);
    track (N, m, 2): the image point as a polynomial in time, px/s^k (stills: only the first row);
    for RIGHT in the lag, else about the view's own instant; row (N,): sensor rows below the
    reference row; row_time_s (2,): the row times with which the tracks were made; sigma_px (N,);
    centre_mm (2,) and half_mm scale the bow; poses: number of board poses, seen or not.
    """

    chain: Ints
    pose: Ints
    ids: Ints
    board_mm: Floats
    track: Floats
    row: Floats
    row_time_s: Floats
    sigma_px: Floats
    centre_mm: Floats
    half_mm: float
    poses: int

    @property
    def camera(self) -> Ints:
        """0 left, 1 right, for every observation (N,)."""
        return np.asarray(self.chain != LEFT, dtype=np.int64)

    def px(self, state: State) -> tuple[Floats, Floats]:
        """Image points (N, 2) at lag and row times of the state, and their velocity (N, 2) px/s."""
        lag = np.where(self.chain == RIGHT, state.lag_s + state.jitter_s[self.pose], 0.0)
        late = self.row * (state.row_time_s - self.row_time_s)[self.camera]
        return polynomial(self.track, lag - late)

    def bow_terms(self) -> Floats:
        """x^2, xy, y^2 of every point (N, 3), scaled by the half-width."""
        x, y = ((self.board_mm[:, :2] - self.centre_mm) / self.half_mm).T
        return np.column_stack([x * x, x * y, y * y])

    def only(self, keep: Bools) -> Observations:
        """The observations ``keep`` (N,); pose numbers stay."""
        return replace(
            self,
            chain=self.chain[keep],
            pose=self.pose[keep],
            ids=self.ids[keep],
            board_mm=self.board_mm[keep],
            track=self.track[keep],
            row=self.row[keep],
            sigma_px=self.sigma_px[keep],
        )


@dataclass(frozen=True)
class Linear:
    """Residuals (N, 2) px, predicted minus observed, with derivatives by pose and by THETA."""

    residual: Floats
    by_pose: Floats  # (N, 2, 7): rotation, translation, jitter
    by_theta: Floats  # (N, 2, 24)


def linearise(obs: Observations, state: State) -> Linear:
    """Residuals of all observations and their analytic derivatives; NaN behind a camera."""
    n, terms = obs.chain.size, obs.bow_terms()
    R = state.R_pose[obs.pose]
    P = obs.board_mm.copy()
    P[:, 2] += terms @ state.bow_mm
    turned = np.einsum("nij,nj->ni", R, P)
    X = turned + state.t_pose_mm[obs.pose]
    by_point = np.empty((n, 2, 3))  # by the point in the frame of the pose
    predicted, theta = np.empty((n, 2)), np.zeros((n, 2, len(THETA)))
    for chain in (LEFT, RIGHT, RIGHT_ALONE):
        at = slice(*np.searchsorted(obs.chain, [chain, chain + 1]))
        if at.stop > at.start:
            predicted[at], by_point[at] = _through(chain, X[at], state, theta[at])
    observed, velocity = obs.px(state)
    late = np.where(obs.chain == RIGHT, 1.0, 0.0)[:, None] * velocity
    theta[:, :, LAG] = -late
    for camera, column in enumerate(ROW_OF):
        theta[:, :, column] = velocity * np.where(obs.camera == camera, obs.row, 0.0)[:, None]
    theta[:, :, BOW] = (by_point @ R[:, :, 2:]) * terms[:, None, :]
    by_pose = np.concatenate([-by_point @ skew(turned), by_point, -late[:, :, None]], axis=2)
    return Linear(predicted - observed, by_pose, theta)


def _through(chain: int, X: Floats, state: State, theta: Floats) -> tuple[Floats, Floats]:
    """Pixels (n, 2) and derivatives by X (n, 2, 3); fills the columns of ``theta`` in place."""
    camera = 0 if chain == LEFT else 1
    model = (state.left, state.right)[camera]
    if chain != RIGHT:
        px, by_point, theta[:, :, LENS_OF[camera]] = model.project_jacobian(X)
        return px, by_point
    turned = X @ state.R.T
    px, by_right, theta[:, :, LENS_OF[camera]] = model.project_jacobian(turned + state.t_mm)
    theta[:, :, 12:15] = -by_right @ skew(turned)
    theta[:, :, 15:18] = by_right
    return px, by_right @ state.R


def huber_weights(residual: Floats, sigma_px: Floats, bound: float) -> Floats:
    """Weights (N,) of points: 1 within ``bound`` sigma (2-D norm), falling as 1/norm beyond."""
    norm = np.linalg.norm(residual, axis=1) / sigma_px
    return np.where(norm <= bound, 1.0, bound / np.maximum(norm, 1e-300))


def huber_cost(residual: Floats, sigma_px: Floats, bound: float) -> float:
    """Half the robust sum of squares; inf where a point lies behind a camera."""
    norm = np.linalg.norm(residual, axis=1) / sigma_px
    if not np.isfinite(norm).all():
        return float("inf")
    inside = norm <= bound
    return float(np.where(inside, 0.5 * norm**2, bound * (norm - 0.5 * bound)).sum())
