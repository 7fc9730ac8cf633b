"""Gauss-Newton over what all markers share: frequency, offset, drift, row times, phase.

Sway and harmonics of each marker are eliminated (Schur complement); what is left of each marker is
added up. Marginal evidence by Laplace's method, priors included: a branch that needs other row
times than the anchor's pays for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from olivevib.arrays import Bools, Floats
from olivevib.reconstruction.motion.problem import (
    Problem,
    Sway,
    Times,
    harmonic_columns,
    sway_part,
)
from olivevib.reconstruction.motion.spline import ORDER, Knots

SHARED = 5  # TIMING
CONVERGED = 0.02  # of each standard deviation
MOST_STEPS = 8


@dataclass(frozen=True)
class Model:
    """What does not change while a branch is fitted.

    prior: theta0 (Q,) with precision (Q, Q); active (Q,): the rest stays at theta0. Q = 5 + J, J
    coefficients of the phase spline on ``psi``. precision_sway, precision_harmonic (6,).
    growth: share by which all amplitudes grow from the middle to the end.
    gain (2, H): what the blur leaves of each harmonic in the left and right camera.
    """

    problems: tuple[Problem, ...]
    knots: Knots
    mid_s: float
    theta0: Floats
    precision: Floats
    active: Bools
    precision_sway: Floats
    precision_harmonic: Floats
    gain: Floats
    psi: Knots | None = None
    growth: float = 0.0

    @property
    def harmonics(self) -> int:
        """H."""
        return int(self.gain.shape[1])

    def clock(self, theta: Floats) -> Times:
        """The times that theta stands for."""
        offset, drift, left, right = (float(v) for v in theta[1:SHARED])
        return Times(offset, drift, left, right, self.mid_s)

    def phase(self, theta: Floats, t_s: Floats) -> tuple[Floats, Floats]:
        """Phi and its rate, rad and rad/s, at t_s."""
        phi = 2 * np.pi * theta[0] * (t_s - self.mid_s)
        rate = np.full_like(phi, 2 * np.pi * theta[0])
        if self.psi is not None:
            bend = theta[SHARED:, None]
            phi = phi + self.psi.values(bend, t_s)[..., 0]
            rate = rate + self.psi.values(bend, t_s, 1)[..., 0]
        return phi, rate


@dataclass(frozen=True)
class Coefficients:
    """Of one marker: sway (B, 6), harmonic (H, 2, 6): cosine, sine."""

    sway: Floats
    harmonic: Floats


@dataclass(frozen=True)
class Branch:
    """One frequency fitted: theta, each marker's coefficients, chi2 (priors included), evidence,
    information (Q, Q) of the active part of theta, free: degrees of freedom, squares: chi2 of the
    pixels alone.
    """

    theta: Floats
    coefficients: tuple[Coefficients, ...]
    chi2: float
    evidence: float
    information: Floats
    steps: int


@dataclass(frozen=True)
class Reduced:
    """One marker after its sway is eliminated: R over [harmonics, theta, data]."""

    R: Floats
    Y: Floats  # (6B, K + Q + 1)
    sway: Sway


def gains(model: Model, problem: Problem) -> Floats:
    """(N, H) what the blur leaves of each harmonic, times the slow growth of the amplitude."""
    blur = np.where(problem.right[:, None], model.gain[1], model.gain[0])
    return np.asarray(blur * envelope(model, problem.zero_s)[:, None])


def envelope(model: Model, t_s: Floats) -> Floats:
    """1 in the middle, growing evenly by ``growth`` to the end."""
    half = 0.5 * model.knots.step_s * (model.knots.count - ORDER + 1)
    return np.asarray(1.0 + model.growth * (t_s - model.mid_s) / half)


def gained(columns: Floats, gain: Floats) -> Floats:
    """Harmonic columns (N, d, 12 H) as the blur leaves them."""
    return np.asarray(columns * np.repeat(gain, 12, axis=1)[:, None, :])


def shared_columns(
    model: Model, problem: Problem, theta: Floats, t_s: Floats, now: Coefficients
) -> Floats:
    """(N, d, Q) derivatives of the data by theta at the motion ``now``."""
    phi, rate = model.phase(theta, t_s)
    gain = gains(model, problem)
    by_phase = np.zeros((*t_s.shape, 6))
    for k, (cosine, sine) in enumerate(now.harmonic, start=1):
        turn = k * (np.cos(k * phi)[..., None] * sine - np.sin(k * phi)[..., None] * cosine)
        by_phase += gain[:, k - 1, None, None] * turn
    velocity = model.knots.values(now.sway, t_s, 1) + rate[..., None] * by_phase
    right = problem.right[:, None]
    late = np.broadcast_to(problem.zero_s[:, None] + theta[1] - model.mid_s, t_s.shape)
    by_time = np.stack(
        [
            np.where(right, 1.0 + theta[2], 0.0) * np.ones_like(t_s),
            np.where(right, late, 0.0),
            np.where(right, 0.0, problem.rho),
            np.where(right, problem.rho, 0.0),
        ],
        axis=-1,
    )
    weights = [2 * np.pi * (t_s - model.mid_s)[..., None]]
    if model.psi is not None:
        flat = model.psi.matrix(t_s.ravel()).reshape(*t_s.shape, -1)
        weights.append(flat)
    phase_part = np.einsum("npdk,npk->npd", problem.V, by_phase)  # (N, P, d)
    time_part = np.einsum("npdk,npk->npd", problem.V, velocity)
    first = np.einsum("npd,npq->ndq", phase_part, np.concatenate(weights, axis=-1))
    second = np.einsum("npd,npq->ndq", time_part, by_time)
    return np.concatenate([first[..., :1], second, first[..., 1:]], axis=-1)


def sways_at(model: Model, theta: Floats) -> tuple[Sway, ...]:
    """The factored sway of each marker at theta's times."""
    return tuple(
        sway_part(p, p.times(model.clock(theta)), model.knots, model.precision_sway)
        for p in model.problems
    )


def reduce(
    model: Model,
    problem: Problem,
    theta: Floats,
    now: Coefficients | None,
    sway: Sway | None = None,
) -> Reduced:
    """Eliminate the sway (``sway``: already factored); without ``now`` theta's columns are zero."""
    t_s = problem.times(model.clock(theta))
    sway = sway or sway_part(problem, t_s, model.knots, model.precision_sway)
    phi, _ = model.phase(theta, t_s)
    Z = gained(harmonic_columns(problem, phi, model.harmonics), gains(model, problem))
    if now is None:
        Q = np.zeros((*problem.y.shape, theta.size))
    else:
        Q = shared_columns(model, problem, theta, t_s, now)
    X = sway.by_interval(np.concatenate([Z, Q, problem.y[..., None]], axis=2))
    Y = solve_triangular(sway.L, sway.cross(X), lower=True, check_finite=False)
    flat = X.reshape(-1, X.shape[2])
    return Reduced(flat.T @ flat - Y.T @ Y, Y, sway)


@dataclass(frozen=True)
class _Marginal:
    """One marker after its harmonics are eliminated too."""

    E: Floats  # (K, Q + 1): A^-1 [R_theta, R_data]
    G: Floats  # (Q, Q)
    g: Floats  # (Q,)
    chi2: float
    log_det: float


def marginal(model: Model, reduced: Reduced) -> _Marginal:
    """Eliminate the harmonics; log_det: of their precision over the prior's."""
    k = 12 * model.harmonics
    prior = np.tile(model.precision_harmonic, 2 * model.harmonics)
    R = reduced.R
    A = np.linalg.cholesky(R[:k, :k] + np.diag(prior))
    E = cho_solve((A, True), R[:k, k:], check_finite=False)
    rest = R[k:, k:] - R[k:, :k] @ E
    log_det = 2 * float(np.log(np.diag(A)).sum()) - float(np.log(prior).sum())
    return _Marginal(E, rest[:-1, :-1], rest[:-1, -1], float(rest[-1, -1]), log_det)


def back_substitute(model: Model, reduced: Reduced, E: Floats, move: Floats) -> Coefficients:
    """Harmonics and sway of one marker once theta moves."""
    k = 12 * model.harmonics
    c = E[:, -1] - E[:, :-1] @ move
    rest = reduced.Y[:, -1] - reduced.Y[:, :k] @ c - reduced.Y[:, k:-1] @ move
    s = solve_triangular(reduced.sway.L, rest, lower=True, trans=1, check_finite=False)
    return Coefficients(s.reshape(-1, 6), c.reshape(model.harmonics, 2, 6))


def at_theta(model: Model, theta: Floats, sways: tuple[Sway, ...] | None = None) -> Branch:
    """Amplitudes at given theta, nothing of it fitted; sways: factored, at these or near times."""
    chi2, log_det, found = prior_cost(model, theta), 0.0, []
    for problem, sway in zip(model.problems, sways or sways_at(model, theta), strict=True):
        reduced = reduce(model, problem, theta, None, sway)
        part = marginal(model, reduced)
        chi2, log_det = chi2 + part.chi2, log_det + part.log_det
        found.append(back_substitute(model, reduced, part.E, np.zeros(theta.size)))
    evidence = -0.5 * (chi2 + log_det)
    return Branch(theta, tuple(found), chi2, evidence, np.zeros((theta.size,) * 2), 0)


def prior_cost(model: Model, theta: Floats) -> float:
    """What theta costs by its prior, in chi2."""
    d = theta - model.theta0
    return float(d @ model.precision @ d)


def step(
    model: Model, branch: Branch, limit: Floats, sways: tuple[Sway, ...]
) -> tuple[Branch, Floats]:
    """One Gauss-Newton step; returns the branch *evaluated where it stood*, moved, and the move.

    limit (Q,): the largest step of each of theta.
    """
    q = branch.theta.size
    G, g = model.precision.copy(), model.precision @ (model.theta0 - branch.theta)
    chi2, log_det, parts = prior_cost(model, branch.theta), 0.0, []
    for problem, now, sway in zip(model.problems, branch.coefficients, sways, strict=True):
        reduced = reduce(model, problem, branch.theta, now, sway)
        part = marginal(model, reduced)
        G, g = G + part.G, g + part.g
        chi2, log_det = chi2 + part.chi2, log_det + part.log_det
        parts.append((reduced, part.E))
    on = np.flatnonzero(model.active)
    sub = G[np.ix_(on, on)]
    unit = 1 / np.sqrt(np.diag(sub))
    L = np.linalg.cholesky(sub * unit[:, None] * unit + 1e-12 * np.eye(on.size))
    move = np.zeros(q)
    move[on] = unit * cho_solve((L, True), unit * g[on])
    gain = float(g @ move)
    move *= min(1.0, float(np.min(limit[on] / np.maximum(np.abs(move[on]), 1e-300))))
    log_det += 2 * float(np.log(np.diag(L)).sum() - np.log(unit).sum())
    found = tuple(back_substitute(model, r, E, move) for r, E in parts)
    evidence = -0.5 * (chi2 - max(gain, 0.0) + log_det)
    return Branch(branch.theta + move, found, chi2, evidence, G, branch.steps + 1), move


def settle(model: Model, start: Floats, steps: int = MOST_STEPS) -> Branch:
    """Gauss-Newton from theta ``start`` until nothing moves by more than 0.02 of its sigma."""
    span = float(np.ptp(model.problems[0].zero_s))
    f = max(float(start[0]), 1.0)
    sways = sways_at(model, start)
    branch = at_theta(model, start, sways)
    limit = np.full(start.size, 0.6)
    for k in range(steps):
        rows = 0.5 * np.maximum(np.abs(branch.theta[3:SHARED]), 1e-5)
        limit[:SHARED] = [0.3 / span, 0.15 / f, 2e-4, *rows]
        if k > 0:
            sways = sways_at(model, branch.theta)
        branch, move = step(model, branch, limit, sways)
        sigma = 1 / np.sqrt(np.maximum(np.diag(branch.information), 1e-300))
        if k > 0 and (np.abs(move) < CONVERGED * sigma)[model.active].all():
            break
    return branch


def with_frequency(model: Model, f_hz: float) -> Model:
    """The same model about another frequency (which has no prior of its own)."""
    theta0 = model.theta0.copy()
    theta0[0] = f_hz
    return replace(model, theta0=theta0)


__all__ = ["ORDER", "Branch", "Coefficients", "Model", "at_theta", "settle", "step"]
