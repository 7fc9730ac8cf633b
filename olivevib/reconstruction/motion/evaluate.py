"""Positions, turns, velocities and accelerations from the fitted model, never from differences."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import rotation_from_vector, vector_from_rotation
from olivevib.reconstruction.motion.spline import ORDER, Knots, knots_over
from olivevib.reconstruction.motion.types import MarkerMotion, Motion, MotionFit

TOLD_GROWTH = 0.005  # of the mean, from the middle to an end: less is not worth a word


def knots_of(fit: MotionFit) -> Knots:
    """The knots of the sway."""
    count = len(fit.markers[0].sway)
    return Knots(fit.first_knot_s, fit.knot_s, count)


def phase_of(fit: MotionFit, t_s: Floats) -> tuple[Floats, Floats, Floats]:
    """Phase of the machine, its rate and its acceleration at t_s of the fit's clock."""
    omega = 2 * np.pi * fit.f_hz
    phi, rate, bend = omega * (t_s - fit.mid_s), np.full_like(t_s, omega), np.zeros_like(t_s)
    if fit.psi.size:
        psi = Knots(fit.psi_first_s, fit.psi_knot_s, fit.psi.size)
        values = [psi.values(fit.psi[:, None], t_s, d)[:, 0] for d in range(3)]
        phi, rate, bend = phi + values[0], rate + values[1], bend + values[2]
    return phi, rate, bend


def uneven_words(fit: MotionFit) -> tuple[str, ...]:
    """What one frequency and one amplitude leave unsaid of how the machine ran."""
    words = []
    if abs(fit.growth) >= TOLD_GROWTH:
        percent = 100 * abs((1 + fit.growth) / (1 - fit.growth) - 1)
        verb = "grows" if fit.growth > 0 else "shrinks"
        words.append(
            f"The amplitude {verb} by {percent:.2g} % from start to end; "
            "that of the middle is given."
        )
    if fit.psi.size:
        f_hz = phase_of(fit, np.linspace(fit.start_s, fit.end_s, 200))[1] / (2 * np.pi)
        words.append(
            f"The speed wanders from {f_hz.min():.2f} to {f_hz.max():.2f} Hz; the mean is given."
        )
    return tuple(words)


def evaluate(fit: MotionFit, t_s: Floats) -> Motion:
    """All markers at trial times (N,); NaN outside the record."""
    own = np.asarray(t_s, dtype=np.float64) - fit.shift_s
    inside = (own >= fit.start_s) & (own <= fit.end_s)
    at = np.where(inside, own, fit.mid_s)
    columns = [_marker(fit, m, at) for m in fit.markers]
    stacked = [np.stack(c, axis=1) for c in zip(*columns, strict=True)]
    for values in stacked:
        values[~inside] = np.nan
    ids = np.array([m.id for m in fit.markers], dtype=np.int64)
    return Motion(np.asarray(t_s, dtype=np.float64), ids, *stacked)


def _harmonics(fit: MotionFit, m: MarkerMotion, t_s: Floats) -> tuple[Floats, Floats, Floats]:
    """Their sum and its two derivatives by time (N, 6)."""
    value, rate, bend = (np.zeros((t_s.size, 6)) for _ in range(3))
    if not np.isfinite(fit.f_hz):
        return value, rate, bend
    phi, omega, alpha = (v[:, None] for v in phase_of(fit, t_s))
    for h, (C, S) in enumerate(zip(m.cosine, m.sine, strict=True), start=1):
        cos, sin = np.cos(h * phi), np.sin(h * phi)
        value = value + cos * C + sin * S
        turned = h * (cos * S - sin * C)
        rate = rate + omega * turned
        bend = bend + alpha * turned - (h * omega) ** 2 * (cos * C + sin * S)
    slope = 2 * fit.growth / (fit.end_s - fit.start_s)
    size = 1 + slope * (t_s - fit.mid_s)[:, None]
    return size * value, size * rate + slope * value, size * bend + 2 * slope * rate


def _marker(fit: MotionFit, m: MarkerMotion, t_s: Floats) -> tuple[Floats, ...]:
    knots = knots_of(fit)
    value, rate, bend = _harmonics(fit, m, t_s)
    xi = knots.values(m.sway, t_s) + value
    velocity = knots.values(m.sway, t_s, 1) + rate
    acceleration = knots.values(m.sway, t_s, 2) + bend
    turns = rotation_from_vector(xi[:, 3:]) @ m.R0
    vectors = np.array([vector_from_rotation(R) for R in turns]).reshape(-1, 3)
    sigma = deviations(fit, m, t_s, 0)
    return (
        m.t0_mm + xi[:, :3],
        vectors,
        sigma[:, :3],
        sigma[:, 3:],
        velocity[:, :3],
        acceleration[:, :3] * 1e-3,
        deviations(fit, m, t_s, 2)[:, :3] * 1e-3,
    )


def deviations(fit: MotionFit, m: MarkerMotion, t_s: Floats, derivative: int) -> Floats:
    """(N, 6) standard deviations of xi or its second derivative, all parameters jointly."""
    knots = knots_of(fit)
    interval = knots.interval(t_s)
    w = knots.weights(t_s, interval, derivative)  # (N, 6)
    base = m.sway.size
    factors = _harmonic_factors(fit, m, t_s, derivative)  # (N, 6, 12 H + 1)
    out = np.empty((t_s.size, 6))
    tail = np.arange(base, base + factors.shape[2])
    for a in range(6):
        at = 6 * (interval[:, None] + np.arange(ORDER)) + a
        block = m.covariance[at[:, :, None], at[:, None, :]]
        sway = np.einsum("nb,nbc,nc->n", w, block, w)
        F = factors[:, a]
        cross = np.einsum("nb,nbt,nt->n", w, m.covariance[at[:, :, None], tail], F)
        rest = np.einsum("nt,tu,nu->n", F, m.covariance[np.ix_(tail, tail)], F)
        out[:, a] = np.sqrt(np.maximum(sway + 2 * cross + rest, 0.0))
    return out


def _harmonic_factors(fit: MotionFit, m: MarkerMotion, t_s: Floats, derivative: int) -> Floats:
    """Derivative of each axis by the harmonics' coefficients and the frequency."""
    h_count = len(m.cosine)
    out = np.zeros((t_s.size, 6, 12 * h_count + 1))
    if not np.isfinite(fit.f_hz):
        return out
    phi, omega, _ = phase_of(fit, t_s)
    for h in range(1, h_count + 1):
        size = 1 + 2 * fit.growth * (t_s - fit.mid_s) / (fit.end_s - fit.start_s)
        factor = size if derivative == 0 else -size * (h * omega) ** 2
        cos, sin = np.cos(h * phi) * factor, np.sin(h * phi) * factor
        by_phase = h * 2 * np.pi * (t_s - fit.mid_s)
        C, S = m.cosine[h - 1], m.sine[h - 1]
        for a in range(6):
            out[:, a, 12 * (h - 1) + a] = cos
            out[:, a, 12 * (h - 1) + 6 + a] = sin
            out[:, a, -1] += by_phase * (cos * S[a] - sin * C[a])
            if derivative == 2:
                out[:, a, -1] += 2 / fit.f_hz * (cos * C[a] + sin * S[a])
    return out


__all__ = ["evaluate", "knots_of", "knots_over", "phase_of"]
