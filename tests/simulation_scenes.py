"""Small scenes with known truth, shared by the tests of the simulator."""

from __future__ import annotations

import numpy as np

from olivevib.geometry import CameraModel, rotation_from_vector
from olivevib.marker import MarkerLayout
from olivevib.simulation import Body, Camera, Clock, Motion, Optics, Scene, Surroundings
from olivevib.simulation.planar import Planar, from_modules

K = np.array([[950.0, 0.0, 318.3], [0.0, 948.0, 241.7], [0.0, 0.0, 1.0]])
BENT = np.array([-0.1, 0.05, 0.001, -0.0007, 0.0])


def camera(distortion=BENT, row_time_s=0.0, size_px=(640, 480), **optics):
    """A camera with noise off unless asked for."""
    quiet = {"read_noise_dn": 0.0, "shot_noise_dn": 0.0, "exposure_s": 0.0, **optics}
    model = CameraModel(size_px, K, np.asarray(distortion, dtype=float), row_time_s)
    return Camera(model, Optics(**quiet), Clock())


def scene(cam, *bodies, around=None, seed=3):
    return Scene(cam, cam, bodies, around or Surroundings(), seed)


def lean(tilt_deg, azimuth_rad, roll_rad):
    """A marker's rotation: rolled in its plane, then tilted about an axis in the image."""
    axis = np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])
    tilted = rotation_from_vector(np.radians(tilt_deg) * axis)
    return tilted @ rotation_from_vector([0.0, 0.0, roll_rad])


def random_pattern(seed=0):
    """A random marker of the paper's layout, (11, 11), True where dark."""
    return MarkerLayout().pattern(np.random.default_rng(seed).random((7, 7)) < 0.5)


def marker(size_mm, R0, t0_mm, motion=None, seed=0):
    planar = from_modules(random_pattern(seed), size_mm / 11, 2.0)
    return Body(planar, R0, np.asarray(t0_mm, dtype=float), motion or Motion())


def bar(motion, t0_mm=(0.0, 0.0, 1400.0)):
    """A tall dark bar on a wide card, upright in the image."""
    planar = Planar(np.array([[-6.0, -120.0, 6.0, 120.0]]), np.array([-70.0, -130.0, 70.0, 130.0]))
    return Body(planar, np.eye(3), np.asarray(t0_mm, dtype=float), motion)
