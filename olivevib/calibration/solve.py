"""Levenberg-Marquardt on the joint problem, the board poses eliminated (Schur complement).

One Gram matrix a board pose holds all that a step and the covariance need, so the cost grows
linearly with the views. Source: Triggs et al., Bundle adjustment, 2000, sections 4 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.bundle import (
    BOW,
    LAG,
    LENS_OF,
    POSE,
    ROW_OF,
    STEREO,
    THETA,
    Observations,
    State,
    huber_cost,
    huber_weights,
    linearise,
)
from olivevib.progress import Tick, silent

STIFF = 1e12  # precision that holds a parameter, relative to its unit


@dataclass(frozen=True)
class Prior:
    """What is known of THETA before any image: Gaussian, and beta/alpha = 1 per camera.

    mean (24,), precision (24, 24); aspect_sd is the sd of beta/alpha; aspect names the cameras
    to which it applies (0 left, 1 right).
    """

    mean: Floats
    precision: Floats
    aspect_sd: float
    aspect: tuple[int, ...] = (0, 1)

    def at(self, state: State) -> tuple[float, Floats, Floats]:
        """Half the squared distance, its gradient (24,) and Gauss-Newton matrix (24, 24)."""
        off = values(state) - self.mean
        gradient = self.precision @ off
        cost, matrix = 0.5 * float(off @ gradient), self.precision.copy()
        for camera in self.aspect:
            fx, fy = (state.left, state.right)[camera].lens[:2]
            residual = (fy / fx - 1) / self.aspect_sd
            slope = np.zeros(len(THETA))
            slope[LENS_OF[camera]][:2] = -fy / fx**2, 1 / fx
            slope /= self.aspect_sd
            cost += 0.5 * residual**2
            gradient = gradient + residual * slope
            matrix += np.outer(slope, slope)
        return cost, gradient, matrix


def values(state: State) -> Floats:
    """THETA of a state (24,); the small rotation is zero by definition."""
    out = np.zeros(len(THETA))
    out[LENS_OF[0]], out[LENS_OF[1]] = state.left.lens, state.right.lens
    out[STEREO][3:] = state.t_mm
    out[LAG], out[BOW] = state.lag_s, state.bow_mm
    out[list(ROW_OF)] = state.row_time_s
    return out


@dataclass(frozen=True)
class Problem:
    """Observations, prior and which of THETA are unknown: ``free`` (24,).

    jitter_sd_s: how far the lag of a single view may depart from the common one.
    """

    observations: Observations
    prior: Prior
    free: Bools
    huber: float = 2.0
    jitter_sd_s: float = 0.0

    @property
    def jitter_precision(self) -> float:
        """Precision of a view's jitter, 1/s^2; no jitter is one within a nanosecond."""
        return 1 / max(self.jitter_sd_s, 1e-9) ** 2


@dataclass(frozen=True)
class Solution:
    """Where the solver stopped: state, cost, residuals (N, 2) px, weights (N,), iterations."""

    state: State
    cost: float
    residual: Floats = field(repr=False)
    weight: Floats = field(repr=False)
    iterations: int = 0
    converged: bool = True


def cost(problem: Problem, state: State) -> float:
    """Robust cost of a state, prior included; inf where a point falls behind a camera."""
    residual = linearise(problem.observations, state).residual
    return _cost(problem, state, residual)


def _cost(problem: Problem, state: State, residual: Floats) -> float:
    data = huber_cost(residual, problem.observations.sigma_px, problem.huber)
    jitter = 0.5 * problem.jitter_precision * float(state.jitter_s @ state.jitter_s)
    return data + jitter + problem.prior.at(state)[0]


def grams(problem: Problem, state: State) -> tuple[Floats, Floats]:
    """Gram matrices (V, 8+p, 8+p) of [by pose, by free THETA, residual], and residuals (N, 2)."""
    obs = problem.observations
    linear = linearise(obs, state)
    scale = np.sqrt(huber_weights(linear.residual, obs.sigma_px, problem.huber)) / obs.sigma_px
    columns = (linear.by_pose, linear.by_theta[:, :, problem.free], linear.residual[:, :, None])
    rows = np.concatenate(columns, axis=2) * scale[:, None, None]
    order = np.argsort(obs.pose, kind="stable")
    pose = obs.pose[order]
    counts = np.bincount(pose, minlength=obs.poses)
    slot = np.arange(pose.size) - np.repeat(np.cumsum(counts) - counts, counts)
    padded = np.zeros((obs.poses, int(counts.max(initial=0)), 2, rows.shape[2]))
    padded[pose, slot] = rows[order]
    flat = padded.reshape(obs.poses, -1, rows.shape[2])
    gram = flat.transpose(0, 2, 1) @ flat
    gram[:, 6, 6] += problem.jitter_precision
    gram[:, 6, -1] += problem.jitter_precision * state.jitter_s
    return gram, linear.residual


@dataclass(frozen=True)
class Reduced:
    """The system of the free THETA after the poses are eliminated.

    H (V, p, p), g (V, p): information and gradient of each view; prior_matrix (p, p) and
    prior_gradient (p,) the prior's; pose (V, 7, p+1): what a view's pose does for a step of THETA
    (last column: its own step).
    """

    H: Floats
    g: Floats
    prior_matrix: Floats
    prior_gradient: Floats
    pose: Floats
    pose_gradient: Floats

    @property
    def total_H(self) -> Floats:
        """Information of all views and the prior (p, p)."""
        out: Floats = self.H.sum(axis=0) + self.prior_matrix
        return out

    @property
    def total_g(self) -> Floats:
        """Gradient of all views and the prior (p,)."""
        out: Floats = self.g.sum(axis=0) + self.prior_gradient
        return out


def reduce(problem: Problem, state: State, gram: Floats, damping: float = 0.0) -> Reduced:
    """Eliminate each view's pose from its Gram matrix."""
    U, W, C = gram[:, :POSE, :POSE], gram[:, :POSE, POSE:], gram[:, POSE:-1, POSE:]
    diagonal = np.einsum("vii->vi", U)
    floor = 1e-13 * diagonal + np.where(diagonal > 0, 0.0, 1.0)  # poses that nobody sees
    U = U + np.eye(POSE) * (damping * diagonal + floor)[:, None, :]
    solved = np.linalg.solve(U, W)
    left = C - W[:, :, :-1].transpose(0, 2, 1) @ solved
    _, gradient, matrix = problem.prior.at(state)
    free = problem.free
    return Reduced(
        left[:, :, :-1],
        left[:, :, -1],
        matrix[np.ix_(free, free)],
        gradient[free],
        solved,
        W[:, :, -1],
    )


def step(problem: Problem, reduced: Reduced, damping: float) -> tuple[Floats, Floats, float]:
    """The step of THETA (24,) and of the poses (V, 7), and its Newton decrement."""
    H, g = reduced.total_H, reduced.total_g
    theta = np.zeros(len(THETA))
    if g.size:
        known = np.diag(H) > 0
        scale = 1 / np.sqrt(np.where(known, np.diag(H), 1.0))
        scaled = H * np.outer(scale, scale) + np.diag(damping + 1e-13 + ~known)
        theta[problem.free] = -scale * np.linalg.solve(scaled, scale * g)
    move = theta[problem.free]
    pose = -(reduced.pose[:, :, -1] + reduced.pose[:, :, :-1] @ move)
    own = float(np.einsum("vi,vi->", reduced.pose_gradient, reduced.pose[:, :, -1]))
    return theta, pose, own - float(g @ move)


def solve(problem: Problem, start: State, limit: int = 60, tick: Tick = silent) -> Solution:
    """Minimise; stops when the Newton decrement falls below 1e-5 (0.5 % of a sigma).

    Not converged after ``limit`` iterations is told by ``converged``, never hidden.
    """
    state, damping, done = start, 1e-3, False
    gram, residual = grams(problem, state)
    best, iteration = _cost(problem, state, residual), 0
    while iteration < limit and not done and damping < 1e8:
        tick(iteration, None, "solving")
        iteration += 1
        theta, pose, decrement = step(problem, reduce(problem, state, gram, damping), damping)
        trial = state.moved(theta, pose) if _sane(state, theta) else None
        new_gram, new_residual = grams(problem, trial) if trial else (gram, residual)
        value = _cost(problem, trial, new_residual) if trial else float("inf")
        if trial is not None and value <= best:
            state, gram, residual, best = trial, new_gram, new_residual, value
            damping = max(damping / 5, 1e-12)
        else:
            damping *= 8
        if decrement < 1e-5:
            done = step(problem, reduce(problem, state, gram), 0.0)[2] < 1e-5
            damping = damping if done else damping / 25
    weight = huber_weights(residual, problem.observations.sigma_px, problem.huber)
    return Solution(state, best, residual, weight, iteration, done)


def _sane(state: State, theta: Floats) -> bool:
    """Whether a step keeps both focal lengths within a factor of two and everything finite."""
    if not np.isfinite(theta).all():
        return False
    lens = np.array([state.left.lens[:2], state.right.lens[:2]])
    ratio = 1 + np.array([theta[0:2], theta[6:8]]) / lens
    return bool((ratio > 0.5).all() and (ratio < 2).all())
