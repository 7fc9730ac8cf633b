"""From the fitted branch to the motion of each marker with its covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig
from olivevib.reconstruction.motion.problem import Pose, Problem, Whitening, linearise
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.solve import (
    SHARED,
    Branch,
    Coefficients,
    Model,
    envelope,
    marginal,
    reduce,
)
from olivevib.reconstruction.motion.types import MarkerMotion, Timing

FIXED = 1e24  # precision of what is not fitted, in units of its own curvature


def motion_at(model: Model, problem: Problem, branch: Branch, own: Coefficients) -> Floats:
    """Xi (N, P, 6) at every point's time."""
    t_s = problem.times(model.clock(branch.theta))
    phi, _ = model.phase(branch.theta, t_s)
    xi = model.knots.values(own.sway, t_s)
    size = envelope(model, t_s)[..., None]
    for k, (cosine, sine) in enumerate(own.harmonic, start=1):
        turn = np.cos(k * phi)[..., None] * cosine + np.sin(k * phi)[..., None] * sine
        xi = xi + size * turn
    return np.asarray(xi)


def relinearise(
    model: Model,
    branch: Branch,
    observations: Observations,
    rig: StereoRig,
    poses: tuple[Pose, ...],
    whites: tuple[Whitening, ...],
) -> Model:
    """The same model about the motion of the branch."""
    problems = []
    for m, marker in enumerate(observations.markers):
        xi = motion_at(model, model.problems[m], branch, branch.coefficients[m])
        n = marker.left.frame.size
        at = (xi[:n], xi[n:])
        problems.append(linearise(marker, rig, poses[m], whites[m], at, observations.reference_row))
    return replace(model, problems=tuple(problems))


def degrees_of_freedom(model: Model) -> float:
    """Pixels less parameters."""
    rows = sum(p.y.size for p in model.problems)
    each = 6 * model.knots.count + 12 * model.harmonics
    return max(1.0, rows - len(model.problems) * each - float(model.active.sum()))


def markers_of(
    model: Model,
    branch: Branch,
    observations: Observations,
    poses: tuple[Pose, ...],
    blind: tuple[bool, ...],
    scale: float,
) -> tuple[tuple[MarkerMotion, ...], Floats]:
    """Motions with covariance (variances times ``scale``), and that of TIMING (5, 5)."""
    parts = []
    total = model.precision.copy()
    for problem, own in zip(model.problems, branch.coefficients, strict=True):
        reduced = reduce(model, problem, branch.theta, own)
        part = marginal(model, reduced)
        total = total + part.G
        parts.append((reduced, part))
    off = ~model.active
    total[off, off] += FIXED * (1 + np.abs(np.diag(total)[off]))
    timing = _inverse(total)[:SHARED, :SHARED] * scale
    out = []
    k = 12 * model.harmonics
    prior = np.tile(model.precision_harmonic, 2 * model.harmonics)
    for m, (reduced, part) in enumerate(parts):
        own = branch.coefficients[m]
        tail = reduced.R[:-1, :-1].copy()
        tail[:k, :k] += np.diag(prior)
        tail[k:, k:] += total - part.G
        C = _inverse(tail)
        inverse = solve_triangular(reduced.sway.L, np.eye(len(reduced.sway.L)), lower=True)
        K = inverse.T @ reduced.Y[:, :-1]
        cross = -K @ C
        full = np.block([[inverse.T @ inverse - cross @ K.T, cross], [cross.T, C]])
        keep = own.sway.size + k + SHARED
        out.append(_marker(observations, m, poses[m], own, full[:keep, :keep] * scale, blind))
    return tuple(out), timing


def _marker(
    observations: Observations,
    m: int,
    pose: Pose,
    own: Coefficients,
    covariance: Floats,
    blind: tuple[bool, ...],
) -> MarkerMotion:
    marker = observations.markers[m]
    shares = []
    for view in (marker.left, marker.right):
        frames = int(view.frame[-1] - view.frame[0]) + 1
        shares.append(view.frame.size / frames)
    return MarkerMotion(
        id=marker.id,
        R0=pose.R0,
        t0_mm=pose.t0_mm,
        sway=own.sway,
        cosine=own.harmonic[:, 0],
        sine=own.harmonic[:, 1],
        covariance=0.5 * (covariance + covariance.T),
        blind=blind,
        seen_share=min(shares),
    )


def with_gain_sigma(marker: MarkerMotion, share: Floats) -> MarkerMotion:
    """The marker whose amplitudes are also as unsure as the blur's gains (share (H,) of them)."""
    if not share.any():
        return marker
    covariance = marker.covariance.copy()
    for h, part in enumerate(share):
        rows = marker.sway.size + 12 * h + np.arange(12)
        both = np.concatenate([marker.cosine[h], marker.sine[h]])
        covariance[np.ix_(rows, rows)] += part**2 * np.outer(both, both)
    return replace(marker, covariance=covariance)


def _inverse(matrix: Floats) -> Floats:
    """Of a symmetric positive matrix with very unlike units."""
    unit = 1 / np.sqrt(np.diag(matrix))
    scaled = np.linalg.inv(matrix * unit[:, None] * unit)
    return np.asarray(scaled * unit[:, None] * unit)


def timing_of(theta: Floats, reference_row: float, covariance: Floats) -> Timing:
    """The shared parameters by name."""
    f, offset, drift, left, right = (float(v) for v in theta[:SHARED])
    return Timing(f, offset, drift, left, right, reference_row, covariance)
