"""One camera: a start that finds no false minimum, then its lens from its own views.

Source: Zhang, A flexible new technique for camera calibration, 2000 (poses from homographies).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.calibration.assemble import BoardShape, Side, flatten
from olivevib.calibration.bundle import BOW, LEFT, ROW_OF, THETA, Observations, State, linearise
from olivevib.calibration.settings import LensPrior
from olivevib.calibration.solve import Prior, Problem, Solution, solve
from olivevib.geometry import CameraModel, homography, nearest_rotation

FOCAL_STARTS = (0.65, 0.5, 0.9, 1.3)  # of the image width; webcams lie between
START_VIEWS = 15  # views used to choose among the starts
EFFICIENCY = 2 * (1 - np.exp(-2.0))  # E min(e^2, k^2) of a 2-D normal norm e at k = 2


def lens_prior(
    prior: LensPrior, size_px: tuple[int, int], known: CameraModel | None
) -> tuple[Floats, Floats]:
    """Mean (6,) and precision (6, 6) of one lens before any image."""
    width, height = size_px
    mean = np.array([0.0, 0.0, (width - 1) / 2, (height - 1) / 2, 0.0, 0.0])
    sd = np.array([prior.centre_sd * width] * 2 + [prior.distortion_sd] * 2)
    precision = np.diag([0.0, 0.0, *(1 / sd**2)])
    if known is None or known.covariance is None:
        return mean, precision
    covariance = known.covariance.copy()
    widening = 0.005 * known.lens[:2]
    covariance[:2, :2] += np.outer(widening, widening)
    return known.lens, np.asarray(np.linalg.inv(covariance), dtype=np.float64)


def mono_prior(
    prior: LensPrior, side: Side, known: CameraModel | None, row_time_sd_s: float
) -> Prior:
    """The prior of a problem with one camera, which stands in the left camera's place."""
    mean, precision = np.zeros(len(THETA)), np.zeros((len(THETA), len(THETA)))
    mean[:6], precision[:6, :6] = lens_prior(prior, side.camera.size_px, known)
    precision[BOW, BOW] = np.eye(3) / prior.bow_sd_mm**2
    if row_time_sd_s > 0:
        precision[ROW_OF[0], ROW_OF[0]] = 1 / row_time_sd_s**2
    return Prior(mean, precision, prior.aspect_sd, aspect=(0,))


@dataclass(frozen=True)
class LensFit:
    """One camera from its own views: solution, problem, and the scale of its claimed sigmas."""

    solution: Solution
    problem: Problem
    scale: float

    @property
    def camera(self) -> CameraModel:
        """The fitted camera."""
        return self.solution.state.left


def fit_lens(side: Side, shape: BoardShape, prior: Prior, huber: float = 2.0) -> LensFit:
    """Lens and board poses from one camera's views (at least 3), by robust least squares.

    The lens of ``side.camera`` is only used where ``prior`` knows it already. Several focal starts
    guard against false minima, both planar poses of every view are tried, and the scale of the
    localiser's sigmas is estimated (Huber's proposal 2). Where ``prior`` holds a row time, it is
    estimated too.
    """
    every = np.arange(len(side.views))
    obs = flatten(side, every, LEFT, every, shape)
    unit = float(np.median(obs.sigma_px))
    start = choose_start(side, shape, prior)
    state = posed(side, every, start)
    free = (np.arange(len(THETA)) < 6) | (np.diag(prior.precision) > 0)
    scale = 1 / unit  # 1 px to begin with
    for _ in range(3):
        problem = Problem(replace(obs, sigma_px=obs.sigma_px * scale), prior, free, huber)
        solution = solve(problem, state)
        turned = better_poses(problem, solution.state)
        if turned is not None:
            solution = solve(problem, turned)
        state = solution.state
        scale *= scale_of(problem, solution)
    return LensFit(solution, problem, scale)


def choose_start(side: Side, shape: BoardShape, prior: Prior) -> CameraModel:
    """The best of several focal lengths after a short fit of focal length, k1 and k2 alone."""
    known = prior.precision[0, 0] > 0
    count = len(side.views)
    some = np.unique(np.linspace(0, count - 1, min(START_VIEWS, count)).round().astype(np.int64))
    obs = flatten(side, some, LEFT, np.arange(some.size), shape)
    obs = replace(obs, sigma_px=np.ones_like(obs.sigma_px))
    free = np.zeros(len(THETA), dtype=np.bool_)
    free[[0, 1, 4, 5]] = True
    tied = Problem(obs, replace(prior, aspect_sd=1e-5), free)
    width = side.camera.size_px[0]
    starts = [f * width for f in FOCAL_STARTS]
    lenses = [np.array([f, f, *prior.mean[2:4], 0.0, 0.0]) for f in starts]
    cameras = [side.camera.with_lens(lens) for lens in ([prior.mean[:6]] if known else lenses)]
    fits = [solve(tied, posed(side, some, camera), 40) for camera in cameras]
    return min(fits, key=lambda fit: fit.cost).state.left


def posed(side: Side, pick: Ints, camera: CameraModel) -> State:
    """A state with each view's pose from the homography of its undistorted points."""
    views = [side.views[k] for k in pick]
    poses = [planar_pose(view.board_mm, camera.ray(view.px)) for view in views]
    R, t = np.array([p[0] for p in poses]), np.array([p[1] for p in poses])
    row_time = np.array([side.row_time_s, 0.0])
    none = np.zeros(3)
    return State(camera, camera, np.eye(3), none, 0.0, none, R, t, np.zeros(len(R)), row_time)


def planar_pose(board_mm: Floats, rays: Floats) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and translation (3,) of a flat board from viewing rays (N, 3), N >= 4."""
    middle = board_mm.mean(axis=0)
    H = homography((board_mm - middle)[:, :2], rays[:, :2])  # H33 = 1: the middle is in front
    H = H * (2 / (np.linalg.norm(H[:, 0]) + np.linalg.norm(H[:, 1])))
    R = nearest_rotation(np.column_stack([H[:, 0], H[:, 1], np.cross(H[:, 0], H[:, 1])]))
    depth = (board_mm - middle) @ R[2] + H[2, 2]
    if depth.min() < 0.2 * depth.max():  # few points, almost in line: no pose to trust
        return frontal_pose(board_mm, rays)
    return R, H[:, 2] - R @ middle


def frontal_pose(board_mm: Floats, rays: Floats) -> tuple[Floats, Floats]:
    """The pose of a board that faces the camera: the best similarity of board and rays (N, 3)."""
    a, b = board_mm[:, :2] @ [1, 1j], rays[:, :2] @ [1, 1j]
    turn = np.vdot(a - a.mean(), b - b.mean()) / np.vdot(a - a.mean(), a - a.mean()).real
    depth, angle = 1 / max(abs(turn), 1e-12), np.angle(turn)
    R = np.array([
        [np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]
    ])  # fmt: skip
    middle = depth * np.array([b.mean().real, b.mean().imag, 1.0])
    return R, middle - R @ board_mm.mean(axis=0)


def better_poses(problem: Problem, state: State) -> State | None:
    """The state with those views turned whose second planar pose fits better; None if none does."""
    centre = np.append(problem.observations.centre_mm, 0.0)
    middle = np.einsum("vij,j->vi", state.R_pose, centre) + state.t_pose_mm
    d = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    mirror = np.eye(3) - 2 * d[:, :, None] * d[:, None, :]
    R = mirror @ state.R_pose @ np.diag([1.0, 1.0, -1.0])
    flipped = replace(state, R_pose=R, t_pose_mm=middle - np.einsum("vij,j->vi", R, centre))
    alone = replace(problem, free=np.zeros(len(THETA), dtype=np.bool_))
    other = solve(alone, flipped, 15)
    now = view_costs(problem.observations, linearise(problem.observations, state).residual)
    then = view_costs(problem.observations, other.residual)
    swap = then < now - 1e-6
    if not swap.any():
        return None
    pick = swap[:, None]
    return replace(
        state,
        R_pose=np.where(pick[:, :, None], other.state.R_pose, state.R_pose),
        t_pose_mm=np.where(pick, other.state.t_pose_mm, state.t_pose_mm),
    )


def view_costs(obs: Observations, residual: Floats, bound: float = 2.0) -> Floats:
    """Robust cost of each board pose (V,)."""
    norm = np.linalg.norm(residual, axis=1) / obs.sigma_px
    each = np.where(norm <= bound, 0.5 * norm**2, bound * (norm - 0.5 * bound))
    weights = np.where(np.isfinite(each), each, np.inf)
    return np.asarray(np.bincount(obs.pose, weights, obs.poses), dtype=np.float64)


def scale_of(problem: Problem, solution: Solution, at: Bools | None = None) -> float:
    """By how much the claimed sigmas must grow for the residuals to be as large as they are."""
    obs = problem.observations
    keep = np.ones(obs.chain.size, dtype=np.bool_) if at is None else at
    norm = np.linalg.norm(solution.residual[keep], axis=1) / obs.sigma_px[keep]
    unknown = 6 * np.unique(obs.pose[keep]).size + int(problem.free.sum())
    share = max(1 - unknown / (2 * norm.size), 0.05)
    scale = float(np.median(norm)) + 1e-9
    for _ in range(30):
        clipped = np.minimum(norm / scale, problem.huber) ** 2
        scale *= float(np.sqrt(clipped.sum() / (EFFICIENCY * share * norm.size)))
    return scale
