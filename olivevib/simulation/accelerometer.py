"""The accelerometer on a marker: its own clock, its own axes, gravity, noise, bias."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import rotation_from_vector
from olivevib.signals import GRAVITY_M_S2
from olivevib.simulation.motion import acceleration_m_s2
from olivevib.simulation.scene import Body

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Sensor:
    """One three-axis sensor and its logger.

    turn_rad (3,): rotation vector that takes the marker's frame (x right, y down as printed) to the
    sensor's axes. lever_mm (3,): the sensor from the marker's centre, in the marker's frame.
    A sample of the trial time t carries the stamp clock_offset_s + t (1 + drift_ppm 1e-6).
    """

    marker: int
    rate_hz: float = 1000.0
    before_s: float = 0.8  # the logger was started before the cameras
    after_s: float = 0.4
    clock_offset_s: float = 0.8
    drift_ppm: float = 30.0
    turn_rad: Vector = (0.3, -0.2, 1.4)
    lever_mm: Vector = (0.0, 0.0, 0.0)
    noise_m_s2: float = 0.05
    bias_m_s2: Vector = (0.12, -0.08, 0.05)
    range_g: float = 16.0
    step_g: float = 0.00049  # one count

    @property
    def R_sensor_marker(self) -> Floats:
        """Rotation (3, 3) from the marker's frame to the sensor's axes."""
        out: Floats = rotation_from_vector(self.turn_rad)
        return out


def record(
    sensor: Sensor, body: Body, down: Floats, seconds: float, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """What the logger writes: stamps (N,) s and specific force (N, 3) in g.

    ``down`` (3,) is the direction of gravity in the left camera's frame. The sensor turns with its
    marker; at rest it reads +1 g upwards.
    """
    count = int((sensor.before_s + seconds + sensor.after_s) * sensor.rate_hz)
    t = np.arange(count) / sensor.rate_hz - sensor.before_s
    moved = acceleration_m_s2(lambda u: _place_mm(sensor, body, u), t)
    R, _ = body.pose(t)
    force = moved - GRAVITY_M_S2 * np.asarray(down)
    felt = np.einsum("ij,nkj,nk->ni", sensor.R_sensor_marker, R, force)
    felt += np.array(sensor.bias_m_s2) + sensor.noise_m_s2 * rng.standard_normal(felt.shape)
    counts = np.rint(felt / GRAVITY_M_S2 / sensor.step_g)
    most = sensor.range_g / sensor.step_g
    g = np.clip(counts, -most, most) * sensor.step_g
    return sensor.clock_offset_s + t * (1 + sensor.drift_ppm * 1e-6), g


def _place_mm(sensor: Sensor, body: Body, t_s: Floats) -> Floats:
    R, place = body.pose(t_s)
    out: Floats = place + R @ np.array(sensor.lever_mm)
    return out
