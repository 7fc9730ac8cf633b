"""A machine whose speed wanders: follow the apparent frequency, then fit its phase as a spline."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.progress import Tick
from olivevib.reconstruction.motion.branches import (
    NEAR_BEST,
    Weighed,
    distinct,
    families,
    merged,
    prefer_double,
)
from olivevib.reconstruction.motion.pixels import SLOW_HZ, line_power, views_of
from olivevib.reconstruction.motion.solve import SHARED, Model, settle
from olivevib.reconstruction.motion.spline import Knots, knots_over
from olivevib.reconstruction.motion.types import Observations

WINDOW_S = 1.0
HOP_S = 0.25
GRID_HZ = 0.1
STEP_SIGMA_HZ = 0.4  # change of the apparent frequency from window to window
TEMPER = 60.0  # largest drop of log evidence that a window may claim
PSI_KNOT_S = 0.5
PSI_SIGMA_RAD = 2.0
GAUGE_RAD = 1e-3  # mean and slope of the phase belong to amplitudes and frequency


@dataclass(frozen=True)
class Ridge:
    """Apparent frequency f_hz (K,) at t_s (K,), below half the frame rate."""

    t_s: Floats
    f_hz: Floats

    @property
    def fastest_hz_s(self) -> float:
        """Largest change of the frequency, Hz/s."""
        return float(np.abs(np.diff(self.f_hz)).max() / HOP_S) if self.f_hz.size > 1 else 0.0


def ridge_of(observations: Observations, knot_s: float) -> Ridge | None:
    """The strongest path through the windows' line evidence, sway taken out (Viterbi)."""
    views = views_of(observations)
    start = max(v.row_zero_s[0] for v in views)
    end = min(v.row_zero_s[-1] for v in views)
    t = np.arange(start + WINDOW_S / 2, end - WINDOW_S / 2 + 1e-9, HOP_S)
    if t.size < 3:
        return None
    f = np.arange(SLOW_HZ, observations.frame_rate_hz / 2, GRID_HZ)
    power = np.zeros((t.size, f.size))
    for v in views:
        Q = np.linalg.qr(knots_over(v.row_zero_s[0], v.row_zero_s[-1], knot_s).matrix(v.row_zero_s))
        y = v.px.reshape(v.row_zero_s.size, -1)
        W = np.linalg.inv(np.linalg.cholesky(v.covariance_px2.mean(axis=0)))
        r = (y - Q[0] @ (Q[0].T @ y)) @ W.T
        for k, at in enumerate(t):
            near = np.abs(v.row_zero_s - at) <= WINDOW_S / 2
            if near.sum() >= 12:
                none = np.zeros((int(near.sum()), 0))
                power[k] += line_power(v.row_zero_s[near], none, r[near], f)
    return Ridge(t, viterbi(f, power))


def viterbi(f: Floats, power: Floats) -> Floats:
    """The path (K,) of least cost, with the vertex of each window's parabola."""
    drop = power - power.max(axis=1, keepdims=True)
    scale = np.maximum(1.0, power.max(axis=1, keepdims=True) / TEMPER)
    score = drop / scale
    change = -0.5 * ((f[:, None] - f[None]) / STEP_SIGMA_HZ) ** 2
    total, back = score[0], []
    for row in score[1:]:
        choice = total[None] + change  # (to, from)
        back.append(choice.argmax(axis=1))
        total = choice.max(axis=1) + row
    at = [int(total.argmax())]
    for pointers in reversed(back):
        at.append(int(pointers[at[-1]]))
    path = []
    for k, j in enumerate(reversed(at)):
        shift = 0.0
        if 0 < j < f.size - 1:
            a, b, c = power[k, j - 1 : j + 2]
            bend = a - 2 * b + c
            shift = float(np.clip(0.5 * (a - c) / bend, -0.5, 0.5)) if bend < 0 else 0.0
        path.append(float(f[j] + shift * (f[1] - f[0])))
    return np.array(path)


def start_phase(ridge: Ridge, psi: Knots, start_s: float, end_s: float) -> tuple[float, Floats]:
    """Mean apparent frequency and the coefficients of the phase about it."""
    t = np.linspace(start_s, end_s, 400)
    f = np.interp(t, ridge.t_s, ridge.f_hz)
    phase = 2 * np.pi * np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(t))])
    line = np.polyfit(t, phase, 1)
    B = psi.matrix(t)
    ridge_term = 1e-6 * np.eye(psi.count)
    bend = np.linalg.solve(B.T @ B + ridge_term, B.T @ (phase - np.polyval(line, t)))
    return float(line[0] / (2 * np.pi)), np.asarray(bend)


def psi_precision(psi: Knots, start_s: float, end_s: float) -> Floats:
    """Third differences small, mean and slope none."""
    D = np.diff(np.eye(psi.count), 3, axis=0)
    P = D.T @ D / PSI_SIGMA_RAD**2 + np.eye(psi.count) / (5 * PSI_SIGMA_RAD) ** 2
    t = np.linspace(start_s, end_s, 200)
    B = psi.matrix(t)
    for weight in (np.ones(t.size), (t - t.mean()) / (end_s - start_s) * np.sqrt(12)):
        v = weight @ B / t.size
        P += np.outer(v, v) / GAUGE_RAD**2
    return np.asarray(P)


def with_phase(model: Model, psi: Knots, bend: Floats, span: tuple[float, float]) -> Model:
    """The model with a phase spline that starts at, and is expected about, ``bend``."""
    q = SHARED + psi.count
    precision = np.zeros((q, q))
    precision[:SHARED, :SHARED] = model.precision[:SHARED, :SHARED]
    precision[SHARED:, SHARED:] = psi_precision(psi, *span)
    theta0 = np.concatenate([model.theta0[:SHARED], bend])
    active: Bools = np.concatenate([model.active[:SHARED], np.ones(psi.count, np.bool_)])
    return replace(model, theta0=theta0, precision=precision, active=active, psi=psi)


def follow_speed(
    model: Model, observations: Observations, band_hz: tuple[float, float], tick: Tick
) -> tuple[Model, Weighed, Ridge] | None:
    """Branches with a wandering phase, best first; None where no ridge can be followed.

    The returned model has the phase of the best branch as its expectation.
    """
    ridge = ridge_of(observations, model.knots.step_s)
    if ridge is None:
        return None
    knots = model.knots
    start, end = knots.first_s, knots.first_s + knots.step_s * (knots.count - 5)
    psi = knots_over(start, end, PSI_KNOT_S)
    apparent, bend = start_phase(ridge, psi, start, end)
    rate = observations.frame_rate_hz
    found = merged(families((apparent,), rate, band_hz), 0.3 / (end - start))
    fitted, models = [], {}
    for k, f in enumerate(found):
        tick(k, found.size, f"{f:.2f} Hz, speed wandering")
        h = 1 if abs(abs(f - rate * round(f / rate)) - apparent) < 0.1 else 2
        sign = 1.0 if h * f >= rate * round(h * f / rate) else -1.0
        trial = with_phase(model, psi, sign * bend / h, (start, end))
        theta = trial.theta0.copy()
        theta[0] = f
        branch = settle(trial, theta, 15)
        fitted.append(branch)
        models[id(branch)] = trial
    if not fitted:
        return None
    weighed = prefer_double(distinct(fitted, 0.05), NEAR_BEST, 0.02)
    return models[id(weighed.branches[0])], weighed, ridge
