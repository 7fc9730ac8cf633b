"""Clock offset, drift, gain and rotation together, by Gauss-Newton on the forward model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.forward import Nuisance, SensorMotion
from olivevib.geometry import rotation_from_vector

STEPS = 12
STOP = np.array([1e-9, 1e-10, 1e-9, 1e-9, 1e-9, 1e-9])
LIMIT = np.array([2e-3, 1e-3, 0.3, 0.3, 0.3, 0.3])
_OPEN_RAD = 1.0  # prior on each turn about the start: what the motion leaves open stays open


@dataclass(frozen=True)
class ClockFit:
    """offset_s at the middle of the record (t_ref_s), drift (s/s), gain, rotation, covariance.

    The sensor's stamp is t + offset + drift (t - t_ref). covariance (6, 6) of offset, drift, gain,
    and a small turn (rad, camera axes). predicted_mm (N, 3): the sensor's motion in camera axes
    (gain 1), residual_mm (N, 3), noise_mm (3,).
    """

    offset_s: float
    drift: float
    gain: float
    R_camera_sensor: Floats
    covariance: Floats
    predicted_mm: Floats
    residual_mm: Floats
    noise_mm: Floats
    t_ref_s: float

    @property
    def sigma(self) -> Floats:
        """(6,) standard deviations."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def turn_sigma_rad(self) -> float:
        """Standard deviation of the turn about its worst axis."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[3:, 3:])[-1]))


@dataclass(frozen=True)
class Seen:
    """What the camera saw: times (N,), motion (N, 3) without its slow part, the slow columns."""

    t_s: Floats
    mm: Floats
    slow: Nuisance
    exposure_s: float

    @property
    def t_ref_s(self) -> float:
        """Middle of the record."""
        return float(self.t_s[0] + self.t_s[-1]) / 2


def procrustes(camera_mm: Floats, predicted_mm: Floats) -> tuple[float, Floats]:
    """Gain and rotation (3, 3) that carry predicted (N, 3) onto camera (N, 3) best.

    Polar part of the cross matrix with determinant +1; on straight motion the turn about the
    line of motion is free and the smallest is taken.
    """
    cross = camera_mm.T @ predicted_mm
    u, s, vt = np.linalg.svd(cross)
    if s[1] < 1e-3 * s[0]:
        rotation = _between(u[:, 0], vt[0])
    else:
        flip = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
        rotation = (u * flip) @ vt
    size = float(np.sum(predicted_mm**2))
    gain = float(np.sum(camera_mm * (predicted_mm @ rotation.T))) / size if size > 0 else 0.0
    return gain, rotation


def _between(to: Floats, start: Floats) -> Floats:
    """The smallest rotation that carries one unit vector to another."""
    axis, cosine = np.cross(start, to), float(start @ to)
    if cosine < -1 + 1e-12:  # opposite: half a turn about anything across
        across = np.cross(start, np.eye(3)[int(np.argmin(np.abs(start)))])
        across /= np.linalg.norm(across)
        return np.asarray(2 * np.outer(across, across) - np.eye(3))
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + k + k @ k / (1 + cosine))


def fit_clock(seen: Seen, motion: SensorMotion, offset_s: float) -> ClockFit:
    """Refine from an offset within a quarter period of the truth."""
    state = _start(seen, motion, offset_s)
    noise = np.sqrt(np.mean(state.residual_mm**2, axis=0))
    for _ in range(STEPS):
        jacobian = _jacobian(seen, motion, state)
        step, _ = _weighed(jacobian, state.residual_mm, _floored(noise))
        step = np.clip(step, -LIMIT, LIMIT)
        state = _moved(seen, motion, state, step)
        freedom = max(1.0, seen.t_s.size - seen.slow.count - 2.0)
        noise = np.sqrt(np.sum(state.residual_mm**2, axis=0) / freedom)
        if (np.abs(step) < STOP).all():
            break
    _, covariance = _weighed(_jacobian(seen, motion, state), state.residual_mm, _floored(noise))
    return _with(state, covariance=covariance, noise_mm=noise)


def _floored(noise: Floats) -> Floats:
    floor = max(1e-6 * float(noise.max()), 1e-12)
    return np.asarray(np.maximum(noise, floor))


def _start(seen: Seen, motion: SensorMotion, offset_s: float) -> ClockFit:
    predicted = seen.slow.out(motion.seen(seen.t_s + offset_s, seen.exposure_s))
    gain, rotation = procrustes(seen.mm, predicted)
    return evaluated(seen, motion, offset_s, 0.0, gain, rotation)


def evaluated(
    seen: Seen, motion: SensorMotion, offset_s: float, drift: float, gain: float, rotation: Floats
) -> ClockFit:
    """The prediction and what it leaves at given clock, gain and turn; no covariance yet."""
    q = seen.t_s + offset_s + drift * (seen.t_s - seen.t_ref_s)
    predicted = seen.slow.out(motion.seen(q, seen.exposure_s)) @ rotation.T
    return ClockFit(
        offset_s=offset_s,
        drift=drift,
        gain=gain,
        R_camera_sensor=rotation,
        covariance=np.full((6, 6), np.nan),
        predicted_mm=predicted,
        residual_mm=seen.mm - gain * predicted,
        noise_mm=np.full(3, np.nan),
        t_ref_s=seen.t_ref_s,
    )


def _with(state: ClockFit, covariance: Floats, noise_mm: Floats) -> ClockFit:
    return ClockFit(
        state.offset_s, state.drift, state.gain, state.R_camera_sensor, covariance,
        state.predicted_mm, state.residual_mm, noise_mm, state.t_ref_s,
    )  # fmt: skip


def _jacobian(seen: Seen, motion: SensorMotion, state: ClockFit) -> Floats:
    """(N, 3, 6): what a small change of each parameter does to the predicted path."""
    since = seen.t_s - seen.t_ref_s
    q = seen.t_s + state.offset_s + state.drift * since
    raw = state.gain * motion.speed(q, seen.exposure_s) @ state.R_camera_sensor.T
    shift, stretch = seen.slow.out(raw), seen.slow.out(raw * since[:, None])
    moved = state.gain * state.predicted_mm
    turns = [np.cross(axis, moved) for axis in np.eye(3)]
    return np.stack([shift, stretch, state.predicted_mm, *turns], axis=2)


def _weighed(jacobian: Floats, residual: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Step and covariance, each axis weighted by its noise."""
    return solve((jacobian / noise[:, None]).reshape(-1, 6), (residual / noise).ravel())


def solve(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Step (6,) and covariance (6, 6) of whitened rows a (K, 6), b (K,); a weak prior on turns."""
    normal = a.T @ a + np.diag([0, 0, 0, *[1 / _OPEN_RAD**2] * 3])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    covariance = np.linalg.pinv(normal * np.outer(scale, scale), rcond=1e-13)
    covariance = covariance * np.outer(scale, scale)
    return np.asarray(covariance @ (a.T @ b.ravel())), np.asarray(covariance)


def _moved(seen: Seen, motion: SensorMotion, state: ClockFit, step: Floats) -> ClockFit:
    return evaluated(
        seen,
        motion,
        state.offset_s + float(step[0]),
        state.drift + float(step[1]),
        state.gain + float(step[2]),
        rotation_from_vector(step[3:]) @ state.R_camera_sensor,
    )
