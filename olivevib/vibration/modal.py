"""Natural frequency and damping of a free decay, from several points at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.special import stdtrit

from olivevib.arrays import Floats, floats
from olivevib.vibration.clock import clock_of
from olivevib.vibration.lsscan import scan
from olivevib.vibration.sway import sway_columns

_STEPS = 30
_DAMPING_GRID = np.geomspace(0.002, 0.2, 9)
_FEWEST = 8


@dataclass(frozen=True)
class Decay:
    """Poles of a free decay common to all points, x(t) = sum exp(-s t)(a cos wd t + b sin wd t).

    Per mode (K,): f_hz = sqrt(s^2 + wd^2)/(2 pi) natural frequency, damping = s/sqrt(s^2 + wd^2)
    as a ratio, with sigmas; cosine, sine (K, C) in the unit of the signal at t_ref_s (its first
    sample). residual_rms (C,); share (0...1) of the motion that the fit explains; freedom.
    """

    f_hz: Floats
    f_sigma_hz: Floats
    damping: Floats
    damping_sigma: Floats
    cosine: Floats
    sine: Floats
    t_ref_s: float
    residual_rms: Floats
    share: float
    freedom: int
    converged: bool

    def __post_init__(self) -> None:
        k = np.asarray(self.f_hz).size
        for name in ("f_hz", "f_sigma_hz", "damping", "damping_sigma"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (k,), nan=True))

    @property
    def decrement(self) -> Floats:
        """(K,) logarithmic decrement a cycle."""
        return np.asarray(2 * np.pi * self.damping / np.sqrt(1 - self.damping**2))

    @property
    def time_to_tenth_s(self) -> Floats:
        """(K,) time in which the motion falls to a tenth, s."""
        return np.asarray(np.log(10) / (2 * np.pi * self.f_hz * self.damping))

    def student(self, confidence: float = 0.95) -> float:
        """How many sigma the two-sided interval of that confidence reaches."""
        return float(stdtrit(self.freedom, 0.5 + confidence / 2))


def fit_decay(
    t_s: Floats,
    values: Floats,
    modes: int = 1,
    start_hz: Floats | None = None,
    slow_hz: float = 0.0,
) -> Decay:
    """Fit the free decay of values (N, C) at t_s (N,), even or not, C points or axes together.

    Variable projection: amplitudes are eliminated, ln s and wd found by Levenberg-Marquardt from
    a grid about each spectral peak (damping 0.2-20 %). start_hz (K,): where the modes are, to
    leave the search for them out. slow_hz: slower motion is projected out of all (support, sway).
    Every column is weighted by its own noise. Start the record after the machine or the hammer
    has let go: a filter's or contact's own ringing changes the damping. Raises ValueError with too
    few samples.
    """
    if t_s.size < _FEWEST + 4 * modes:
        raise ValueError(f"{modes} modes need {_FEWEST + 4 * modes} samples, got {t_s.size}")
    slow = sway_columns(t_s, slow_hz)
    slow = np.full((t_s.size, 1), t_s.size**-0.5) if slow is None else slow
    record = _Record(t_s - t_s[0], values - slow @ (slow.T @ values), slow)
    weighted = record.weighted_by(np.sqrt(np.mean(record.values**2, axis=0)))
    poles = np.empty((0, 2))
    for k in range(modes):
        rest = weighted.left(poles) if k else weighted.values
        f = float(start_hz[k]) if start_hz is not None else _peak(t_s, rest)
        poles, _ = _refine(weighted, np.vstack([poles, _grid(weighted, rest, f)]))
    weighted = record.weighted_by(np.sqrt(np.mean(record.left(poles) ** 2, axis=0)))
    poles, converged = _refine(weighted, poles)
    return _result(t_s, record, weighted, poles, converged)


@dataclass(frozen=True)
class _Record:
    """Times from the first sample, values (N, C) without their slow part, slow columns (N, S)."""

    since: Floats
    values: Floats
    slow: Floats

    def weighted_by(self, noise: Floats) -> _Record:
        floor = max(1e-9 * float(noise.max()), 1e-300)
        return _Record(self.since, self.values / np.maximum(noise, floor), self.slow)

    def columns(self, poles: Floats) -> Floats:
        """(N, 2K): decaying cosine and sine of each pole (ln s, wd), without their slow part."""
        parts = []
        for log_s, wd in poles:
            fade = np.exp(-np.exp(log_s) * self.since)
            parts += [fade * np.cos(wd * self.since), fade * np.sin(wd * self.since)]
        return self.out(np.stack(parts, axis=1))

    def out(self, columns: Floats) -> Floats:
        return np.asarray(columns - self.slow @ (self.slow.T @ columns))

    def left(self, poles: Floats, values: Floats | None = None) -> Floats:
        """What the modes at these poles leave of the values."""
        x = self.values if values is None else values
        q = np.linalg.qr(self.columns(poles))[0]
        return np.asarray(x - q @ (q.T @ x))


def _peak(t_s: Floats, values: Floats) -> float:
    """Frequency of the strongest peak: by FFT on an even record, by least squares else."""
    clock = clock_of(t_s)
    if clock.complete and clock.worst_periods < 0.02:
        padded = fft.next_fast_len(4 * t_s.size, real=True)
        power = np.sum(np.abs(fft.rfft(values, padded, axis=0)) ** 2, axis=1)
        power[:4] = 0.0
        return float(int(np.argmax(power)) * clock.rate_hz / padded)
    found = scan(t_s, values, clock.rate_hz / 2)
    return float(found.f_hz[int(np.argmax(found.power))])


def _grid(record: _Record, values: Floats, f_hz: float) -> Floats:
    """(1, 2) best of 9 x 9 starts: damping 0.2-20 %, frequency within half a bin."""
    best, chosen = np.inf, np.array([[0.0, 0.0]])
    for f in f_hz + np.linspace(-0.5, 0.5, 9) / record.since[-1]:
        omega = 2 * np.pi * max(f, 0.05 / record.since[-1])
        for z in _DAMPING_GRID:
            pole = np.array([[np.log(z * omega), omega * np.sqrt(1 - z * z)]])
            left = float(np.sum(record.left(pole, values) ** 2))
            if left < best:
                best, chosen = left, pole
    return chosen


def _refine(record: _Record, poles: Floats) -> tuple[Floats, bool]:
    """Levenberg-Marquardt on the poles (K, 2) with the amplitudes eliminated."""
    damping = 1e-3
    now = float(np.sum(record.left(poles) ** 2))
    limit = np.array([0.5, np.pi / record.since[-1]])
    for _ in range(_STEPS):
        jacobian, residual = _derivatives(record, poles)
        normal, score = jacobian.T @ jacobian, jacobian.T @ residual
        diagonal = np.diag(np.maximum(np.diag(normal), 1e-300))
        step = np.linalg.lstsq(normal + damping * diagonal, score, rcond=None)[0]
        step = np.clip(step.reshape(-1, 2), -limit, limit)
        then = float(np.sum(record.left(poles + step) ** 2))
        if then <= now * (1 + 1e-14):
            poles, now, damping = poles + step, then, damping * 0.1
            if (np.abs(step) <= 1e-11 * np.abs([1.0, poles[0, 1]])).all():
                return poles, True
        else:
            damping *= 10
            if damping > 1e8:
                return poles, True
    return poles, False


def _derivatives(record: _Record, poles: Floats) -> tuple[Floats, Floats]:
    """Jacobian (N C, 2K) of the model to the poles, amplitudes eliminated, and residual (N C,)."""
    columns = record.columns(poles)
    q, r = np.linalg.qr(columns)
    coefficients = np.linalg.solve(r, q.T @ record.values)
    residual = record.values - columns @ coefficients
    since, out = record.since[:, None], []
    for k, (log_s, wd) in enumerate(poles):
        a, b = coefficients[2 * k], coefficients[2 * k + 1]
        fade = np.exp(-np.exp(log_s) * record.since)
        cos, sin = fade * np.cos(wd * record.since), fade * np.sin(wd * record.since)
        wave = np.outer(cos, a) + np.outer(sin, b)
        turned = np.outer(cos, b) - np.outer(sin, a)
        out += [-np.exp(log_s) * since * wave, since * turned]
    free = [record.out(d) for d in out]
    free = [d - q @ (q.T @ d) for d in free]
    return np.stack([d.ravel() for d in free], axis=1), residual.ravel()


def _result(
    t_s: Floats, record: _Record, weighted: _Record, poles: Floats, converged: bool
) -> Decay:
    jacobian, residual = _derivatives(weighted, poles)
    axes = record.values.shape[1]
    each = t_s.size - record.slow.shape[1] - 2 * len(poles)
    freedom = max(1, axes * each - 2 * len(poles))
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * np.sum(residual**2) / freedom
    columns = record.columns(poles)
    coefficients = np.linalg.lstsq(columns, record.values, rcond=None)[0]
    left = record.values - columns @ coefficients
    total = float(np.sum(record.values**2))
    f, z, sf, sz = _natural(poles, covariance)
    return Decay(
        f_hz=f,
        f_sigma_hz=sf,
        damping=z,
        damping_sigma=sz,
        cosine=np.array(coefficients[0::2], dtype=np.float64),
        sine=np.array(coefficients[1::2], dtype=np.float64),
        t_ref_s=float(t_s[0]),
        residual_rms=np.sqrt(np.sum(left**2, axis=0) / max(1, each)),
        share=1.0 - float(np.sum(left**2)) / total if total > 0 else np.nan,
        freedom=freedom,
        converged=converged,
    )


def _natural(poles: Floats, covariance: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Natural frequency, damping ratio and their sigmas from the poles (ln s, wd)."""
    s, wd = np.exp(poles[:, 0]), poles[:, 1]
    omega = np.hypot(s, wd)
    f, z = omega / (2 * np.pi), s / omega
    to_f = np.stack([s * s / omega, wd / omega], axis=1) / (2 * np.pi)
    to_z = np.stack([s * wd**2, -s * wd], axis=1) / omega[:, None] ** 3
    blocks = [covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] for k in range(len(poles))]
    sf, sz = (
        np.array([np.sqrt(max(0.0, float(g @ c @ g))) for g, c in zip(to, blocks, strict=True)])
        for to in (to_f, to_z)
    )
    return f, z, sf, sz
