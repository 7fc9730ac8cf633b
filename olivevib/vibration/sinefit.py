"""Sines fitted to a motion on its true times: one set of frequencies, every axis its own waves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from olivevib.arrays import Floats

_STEPS = 20
_STOP = 1e-13  # of the frequency
_STOP_SIGMA = 1e-4  # of its standard deviation: the step after that is smaller still
_STEP_LIMIT = 0.3  # bins of 1/T: a Gauss-Newton step stays inside its basin (0.75 bin)


@dataclass(frozen=True)
class Tones:
    """Which waves are fitted: wave j has the frequency multiples[j] x f[group[j]]."""

    group: tuple[int, ...]
    multiples: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of free frequencies."""
        return max(self.group) + 1

    def adding(self, multiple: int = 1) -> Tones:
        """These tones and one more of its own free frequency."""
        return Tones((*self.group, self.count), (*self.multiples, multiple))


SINGLE = Tones((0,), (1,))


@dataclass(frozen=True)
class SineFit:
    """Fitted waves, mean apart: x_c(t) = sum_j cosine cos(2 pi m f (t - t_ref)) + sine sin(...).

    f_hz (K,) with covariance f_cov_hz2 (K, K); cosine, sine (J, C); amplitude_sigma (J, C);
    noise (C,): standard deviation of the residual (N, C); freedom: degrees of freedom an axis.
    """

    tones: Tones
    f_hz: Floats
    f_cov_hz2: Floats
    t_ref_s: float
    cosine: Floats
    sine: Floats
    amplitude_sigma: Floats
    noise: Floats
    residual: Floats
    freedom: float
    converged: bool

    @property
    def amplitude(self) -> Floats:
        """(J, C) peak amplitudes."""
        return np.asarray(np.hypot(self.cosine, self.sine))

    @property
    def phase_rad(self) -> Floats:
        """(J, C): wave j is amplitude cos(2 pi m f (t - t_ref) + phase)."""
        return np.asarray(np.arctan2(-self.sine, self.cosine))

    @property
    def f_sigma_hz(self) -> Floats:
        """(K,) standard deviations of the frequencies."""
        return np.asarray(np.sqrt(np.diag(self.f_cov_hz2)))

    def student(self, confidence: float = 0.95) -> float:
        """How many sigma the two-sided interval of that confidence reaches."""
        return float(stdtrit(self.freedom, 0.5 + confidence / 2))

    def wave_f_hz(self) -> Floats:
        """(J,) frequency of each wave."""
        return np.asarray(self.f_hz[list(self.tones.group)] * np.array(self.tones.multiples))

    def motion(self, t_s: Floats, derivative: int = 0, group: int | None = None) -> Floats:
        """The waves (N, C) at times t_s without the mean, or their derivative, exactly.

        group: only the waves of that free frequency.
        """
        omega = 2 * np.pi * self.wave_f_hz()
        turn = np.outer(t_s - self.t_ref_s, omega) + derivative * np.pi / 2
        scale = omega**derivative
        if group is not None:
            scale = scale * (np.array(self.tones.group) == group)
        a, b = scale[:, None] * self.cosine, scale[:, None] * self.sine
        return np.asarray(np.cos(turn) @ a + np.sin(turn) @ b)


def fit_sines(
    t_s: Floats,
    values: Floats,
    start_hz: Floats,
    tones: Tones = SINGLE,
    sway: Floats | None = None,
) -> SineFit:
    """Fit waves to values (N, C) at t_s (N,), all axes together, each weighted by its own noise.

    start_hz (K,) within 0.75/T of the truth; sway (N, S): orthonormal slow columns, the constant
    among them, to project out of everything.
    Gauss-Newton with the linear coefficients eliminated (variable projection); steps are limited
    and halved while they do not reduce the residual. Covariance s^2 (D'D)^-1 of the joint problem.
    Degenerate where waves coincide on these times: the caller leaves such waves out (folds.py).
    Raises ValueError with fewer samples than unknowns.
    """
    problem = _Problem.of(t_s, values, tones, sway)
    f = np.array(start_hz, dtype=np.float64)
    state = problem.solve(f)
    converged = False
    for _ in range(_STEPS):
        step, sigma = problem.step(state)
        f, state, moved = problem.search(f, state, step)
        small = np.maximum(_STOP * np.abs(f), _STOP_SIGMA * sigma)
        converged = bool(np.all(np.abs(step) <= small))
        if converged or not moved:
            break
    return problem.result(f, state, converged or not moved)


@dataclass(frozen=True)
class _State:
    """The linear solution at given frequencies."""

    q: Floats  # orthonormal basis of the projected columns
    r: Floats
    cos: Floats
    sin: Floats
    coefficients: Floats  # (1 + 2J, C)
    residual: Floats

    @property
    def noise(self) -> Floats:
        """Size of the residual per axis, with a floor: a clean axis keeps a finite weight."""
        rms = np.sqrt(np.mean(self.residual**2, axis=0))
        floor = max(1e-6 * float(rms.max()), 1e-15 * float(np.abs(self.coefficients).max()))
        return np.asarray(np.maximum(rms, floor if floor > 0 else 1.0))


@dataclass(frozen=True)
class _Problem:
    since_s: Floats
    t_ref_s: float
    values: Floats
    tones: Tones
    sway: Floats | None

    @classmethod
    def of(cls, t_s: Floats, values: Floats, tones: Tones, sway: Floats | None) -> _Problem:
        unknowns = 1 + 2 * len(tones.group) + tones.count + (0 if sway is None else sway.shape[1])
        if t_s.size <= unknowns:
            raise ValueError(f"{unknowns} unknowns need more than {t_s.size} samples")
        t_ref = float(t_s.mean())
        problem = cls(t_s - t_ref, t_ref, values, tones, sway)
        return cls(t_s - t_ref, t_ref, problem.project(values), tones, sway)

    def project(self, columns: Floats) -> Floats:
        return columns if self.sway is None else columns - self.sway @ (self.sway.T @ columns)

    @property
    def span_s(self) -> float:
        return float(self.since_s[-1] - self.since_s[0])

    def waves(self, f: Floats) -> tuple[Floats, Floats]:
        first = np.multiply.outer(2 * np.pi * f, self.since_s)
        cos, sin = np.cos(first), np.sin(first)
        columns = np.empty((2, len(self.tones.group), self.since_s.size))
        for j, (k, m) in enumerate(zip(self.tones.group, self.tones.multiples, strict=True)):
            c, s = cos[k], sin[k]
            for _ in range(m - 1):
                c, s = c * cos[k] - s * sin[k], s * cos[k] + c * sin[k]
            columns[:, j] = c, s
        return columns[0].T, columns[1].T

    def solve(self, f: Floats) -> _State:
        cos, sin = self.waves(f)
        constant = [np.ones((self.since_s.size, 1))] if self.sway is None else []
        q, r = np.linalg.qr(self.project(np.hstack([*constant, cos, sin])))
        coefficients = np.linalg.solve(r, q.T @ self.values)
        residual = self.values - q @ (q.T @ self.values)
        return _State(q, r, cos, sin, coefficients, residual)

    def parts(self, state: _State) -> tuple[Floats, Floats]:
        """Cosine and sine coefficients (J, C)."""
        j = len(self.tones.group)
        return state.coefficients[-2 * j : -j], state.coefficients[-j:]

    def slopes(self, state: _State) -> Floats:
        """(K, N, C): derivative of the waves to each free frequency, per Hz."""
        a, b = self.parts(state)
        turn = 2 * np.pi * np.array(self.tones.multiples, dtype=np.float64)[:, None]
        out = []
        for k in range(self.tones.count):
            of = np.array(self.tones.group) == k
            wave = state.cos[:, of] @ (turn * b)[of] - state.sin[:, of] @ (turn * a)[of]
            out.append(self.project(self.since_s[:, None] * wave))
        return np.stack(out)

    def information(self, state: _State) -> tuple[Floats, Floats]:
        """(K, K) information on the frequencies, and (K,) what the residual asks of them."""
        slopes = self.slopes(state)
        free = (slopes - state.q @ (state.q.T @ slopes)) / state.noise
        return (
            np.einsum("knc,lnc->kl", free, free),
            np.einsum("knc,nc->k", free, state.residual / state.noise),
        )

    def step(self, state: _State) -> tuple[Floats, Floats]:
        """The Gauss-Newton step of the frequencies, limited, and their standard deviations."""
        information, score = self.information(state)
        step = np.linalg.lstsq(information, score, rcond=1e-14)[0]
        limit = _STEP_LIMIT / self.span_s
        sigma = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        return np.asarray(np.clip(step, -limit, limit)), np.asarray(sigma)

    def search(self, f: Floats, state: _State, step: Floats) -> tuple[Floats, _State, bool]:
        """Halve the step until the weighted residual does not grow; (f, state, moved)."""
        weight = 1.0 / state.noise**2
        now = float(np.sum(state.residual**2 * weight))
        for _ in range(6):
            trial = self.solve(f + step)
            if float(np.sum(trial.residual**2 * weight)) <= now * (1 + 1e-12):
                return f + step, trial, True
            step = step / 2
        return f, state, False

    def result(self, f: Floats, state: _State, converged: bool) -> SineFit:
        n, axes = self.values.shape
        slow = 0 if self.sway is None else self.sway.shape[1]
        freedom = n - state.q.shape[1] - slow - self.tones.count / axes
        noise = np.sqrt(np.sum(state.residual**2, axis=0) / freedom)
        information, _ = self.information(state)
        scale = float(n / freedom)  # information was weighted with the rms of the residual
        f_cov = np.asarray(np.linalg.pinv(information) * scale, dtype=np.float64)
        a, b = self.parts(state)
        return SineFit(
            tones=self.tones,
            f_hz=f,
            f_cov_hz2=f_cov,
            t_ref_s=self.t_ref_s,
            cosine=a,
            sine=b,
            amplitude_sigma=self._amplitude_sigma(state, noise, f_cov),
            noise=noise,
            residual=state.residual,
            freedom=freedom,
            converged=converged,
        )

    def _amplitude_sigma(self, state: _State, noise: Floats, f_cov: Floats) -> Floats:
        """(J, C): the linear covariance of (a, b) and what the frequencies' errors add."""
        inverse = np.linalg.inv(state.r)
        linear = inverse @ inverse.T
        shift = -(inverse @ (state.q.T @ self.slopes(state)))  # (K, P, C)
        a, b = self.parts(state)
        count = len(self.tones.group)
        out = np.empty_like(a)
        for j in range(count):
            at = [state.r.shape[0] - 2 * count + j, state.r.shape[0] - count + j]
            for c in range(a.shape[1]):
                moves = shift[:, at, c]
                cov = linear[np.ix_(at, at)] * noise[c] ** 2 + moves.T @ f_cov @ moves
                size = float(np.hypot(a[j, c], b[j, c]))
                way = np.array([a[j, c], b[j, c]]) / size if size > 0 else np.array([1.0, 0.0])
                out[j, c] = np.sqrt(max(0.0, float(way @ cov @ way)))
        return out
