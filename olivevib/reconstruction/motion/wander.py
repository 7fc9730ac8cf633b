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
    offset_starts,
    prefer_double,
)
from olivevib.reconstruction.motion.pixels import SLOW_HZ, line_power, views_of
from olivevib.reconstruction.motion.sightings import Observations, Sightings
from olivevib.reconstruction.motion.solve import SHARED, Model, settle
from olivevib.reconstruction.motion.spline import Knots, knots_over

WINDOW_S = 1.0
HOP_S = 0.25
GRID_HZ = 0.1
STEP_SIGMA_HZ = 0.4  # change of the apparent frequency from window to window
TEMPER = 60.0  # largest drop of log evidence that a window may claim
PSI_KNOT_S = 0.5
PSI_SIGMA_RAD = 2.0
POLISH_STEPS = 25
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


@dataclass(frozen=True)
class Pace:
    """The apparent phase 2 pi f_hz (t - mid_s) + psi(t) of a machine whose speed wanders.

    gain: noise variance that a steady line leaves over what this phase leaves.
    """

    f_hz: float
    psi: Knots
    bend: Floats
    mid_s: float
    span: tuple[float, float]
    ridge: Ridge
    gain: float

    def phase(self, t_s: Floats) -> Floats:
        """Apparent phase, rad."""
        bend = self.psi.values(self.bend[:, None], t_s)[..., 0]
        return np.asarray(2 * np.pi * self.f_hz * (t_s - self.mid_s) + bend)


def pace_of(
    observations: Observations, knot_s: float, span: tuple[float, float], steady_hz: float
) -> Pace | None:
    """Follow the apparent speed by its ridge, then fit its phase to the pixels (no branch yet)."""
    ridge = ridge_of(observations, knot_s)
    if ridge is None:
        return None
    psi = knots_over(*span, PSI_KNOT_S)
    f, bend = start_phase(ridge, psi, *span)
    mid = 0.5 * (span[0] + span[1])
    lines = [PixelLine.of(v, knot_s) for v in views_of(observations)]
    prior = psi_precision(psi, *span)
    start = bend
    for _ in range(POLISH_STEPS):
        G, g = prior.copy(), prior @ (start - bend)
        H = np.zeros((psi.count + 1, psi.count + 1))
        h = np.zeros(psi.count + 1)
        for line in lines:
            phase = 2 * np.pi * f * (line.t_s - mid) + psi.values(bend[:, None], line.t_s)[:, 0]
            by_phase = np.column_stack([2 * np.pi * (line.t_s - mid), psi.matrix(line.t_s)])
            part, score = line.normal(phase, by_phase)
            H, h = H + part, h + score
        H[1:, 1:] += G
        h[1:] += g
        move = np.linalg.solve(H + 1e-9 * np.diag(np.diag(H)), h)
        size = float(np.abs(psi.matrix(lines[0].t_s) @ move[1:]).max())
        move *= min(1.0, 0.6 / max(size, 1e-12))
        f, bend = f + float(move[0]), bend + move[1:]
        if size < 1e-3:
            break
    left = sum(
        x.left_over(2 * np.pi * f * (x.t_s - mid) + psi.values(bend[:, None], x.t_s)[:, 0])
        for x in lines
    )
    steady = sum(x.left_over(2 * np.pi * steady_hz * (x.t_s - mid)) for x in lines)
    return Pace(f, psi, bend, mid, span, ridge, steady / max(left, 1e-12))


@dataclass(frozen=True)
class PixelLine:
    """One view's whitened pixels with the spline taken out, for any phase of a line in them."""

    t_s: Floats
    Q: Floats
    r: Floats

    @classmethod
    def of(cls, view: Sightings, knot_s: float) -> PixelLine:
        """From one camera's sightings of one marker."""
        t = view.row_zero_s
        Q = np.linalg.qr(knots_over(t[0], t[-1], knot_s).matrix(t))[0]
        W = np.linalg.inv(np.linalg.cholesky(view.covariance_px2.mean(axis=0)))
        y = view.px.reshape(t.size, -1)
        return cls(t, Q, np.asarray((y - Q @ (Q.T @ y)) @ W.T))

    def _fit(self, phase: Floats) -> tuple[Floats, Floats, Floats]:
        X = np.column_stack([np.cos(phase), np.sin(phase), np.cos(2 * phase), np.sin(2 * phase)])
        X = X - self.Q @ (self.Q.T @ X)
        c = np.linalg.lstsq(X, self.r, rcond=None)[0]
        return X, c, self.r - X @ c

    def rest(self, phase: Floats) -> Floats:
        """What a line of this phase and its double leave (N, d), over the localiser's noise."""
        return self._fit(phase)[2]

    def left_over(self, phase: Floats) -> float:
        """Squares of that."""
        return float(np.sum(self.rest(phase) ** 2))

    def growing(self, phase: Floats, u: Floats, share: float) -> tuple[Floats, Floats]:
        """Derivative of the line by its growth along u, and what the line leaves (N, d) each."""
        X = np.column_stack([np.cos(phase), np.sin(phase), np.cos(2 * phase), np.sin(2 * phase)])
        Y = (1 + share * u)[:, None] * X
        Y = Y - self.Q @ (self.Q.T @ Y)
        c = np.linalg.lstsq(Y, self.r, rcond=None)[0]
        slope = u[:, None] * (X @ c)
        basis = np.column_stack([np.linalg.qr(Y)[0], self.Q])
        return slope - basis @ (basis.T @ slope), self.r - Y @ c

    def normal(self, phase: Floats, by_phase: Floats) -> tuple[Floats, Floats]:
        """Normal matrix and score of the phase's parameters, amplitudes eliminated."""
        X, c, rest = self._fit(phase)
        slope = -np.sin(phase)[:, None] * c[0] + np.cos(phase)[:, None] * c[1]
        basis = np.column_stack([np.linalg.qr(X)[0], self.Q])
        q, d = by_phase.shape[1], self.r.shape[1]
        H, h = np.zeros((q, q)), np.zeros(q)
        noise = float(np.sum(rest**2)) / max(1.0, rest.size - basis.shape[1] * d)
        for k in range(d):
            J = slope[:, k, None] * by_phase
            J = J - basis @ (basis.T @ J)
            H, h = H + J.T @ J / noise, h + J.T @ rest[:, k] / noise
        return H, h


def weigh_paces(
    model: Model,
    pace: Pace,
    rate_hz: float,
    band_hz: tuple[float, float],
    offset_sigma_s: float,
    tick: Tick,
) -> tuple[Model, Weighed] | None:
    """Branches with the wandering phase, best first, and the model of the best."""
    fitted, models = [], {}
    found = merged(families((pace.f_hz,), rate_hz, band_hz), 0.3 / (pace.span[1] - pace.span[0]))
    for k, f in enumerate(found):
        tick(k, found.size, f"{f:.2f} Hz, speed wandering")
        h = 1 if abs(abs(f - rate_hz * round(f / rate_hz)) - pace.f_hz) < 0.05 else 2
        sign = 1.0 if h * f >= rate_hz * round(h * f / rate_hz) else -1.0
        trial = with_phase(model, pace.psi, sign * pace.bend / h, pace.span)
        for start in offset_starts(trial, float(f), offset_sigma_s):
            branch = settle(trial, start, 6)
            fitted.append(branch)
            models[id(branch)] = trial
    if not fitted:
        return None
    weighed = prefer_double(distinct(fitted, 0.05), NEAR_BEST, 0.02)
    return models[id(weighed.branches[0])], weighed
