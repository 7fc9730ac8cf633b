"""Markers wrapped round a branch: rendered by rays on a cylinder, measured where they touch."""

import cv2
import numpy as np
import pytest

from olivevib.detection import Detector, Wrapped
from olivevib.geometry import rotation_from_vector
from olivevib.marker import load_library
from olivevib.studies.detection.canvas import F_PX, Z_MM

LIBRARY = load_library("olive49")
ROW = 3
PRINT = np.pad(LIBRARY.layout.pattern(LIBRARY.codes[ROW]), 2)


def on_a_branch(radius, tilt_deg, azimuth_deg, seed, size_px=60.0, fine=6, side=160):
    """A picture 1280 wide of a marker upright on a branch (radius in modules), its middle (2,)."""
    rng = np.random.default_rng(seed)
    middle = np.array([80.0, 80.0]) + rng.uniform(-0.5, 0.5, 2)
    module = size_px * Z_MM / F_PX / 11
    a, t = np.radians([azimuth_deg, tilt_deg])
    R = rotation_from_vector([t * np.cos(a), t * np.sin(a), 0])
    ray = np.array([(middle[0] - 80) / F_PX, (middle[1] - 80) / F_PX, 1.0])
    camera = -(R.T @ (Z_MM * ray / np.linalg.norm(ray))) / module
    at = (np.arange(side * fine) + 0.5) / fine - 0.5
    x, y = np.meshgrid((at - 80) / F_PX, (at - 80) / F_PX)
    d = np.stack([x, y, np.ones_like(x)], -1) @ R
    A = d[..., 0] ** 2 + d[..., 2] ** 2
    B = camera[0] * d[..., 0] + (camera[2] - radius) * d[..., 2]
    D = B * B - A * (camera[0] ** 2 + (camera[2] - radius) ** 2 - radius**2)
    far = (-B - np.sqrt(np.maximum(D, 0))) / A
    across, along, back = (camera[k] + far * d[..., k] for k in range(3))
    u = radius * np.arctan2(across, radius - back)
    i, j = np.floor(u + 7.5).astype(int), np.floor(along + 7.5).astype(int)
    on = (D > 0) & (i >= 0) & (i < 15) & (j >= 0) & (j < 15)
    light = np.full(x.shape, 120, np.float32)
    light[on] = np.where(PRINT[j[on], i[on]], 40, 210)
    light = cv2.GaussianBlur(light, (0, 0), 0.7 * fine)
    light = light.reshape(side, fine, side, fine).mean((1, 3)) + rng.normal(0, 2, (side, side))
    picture = np.full((side, 1280), 120, np.uint8)
    picture[:, :side] = np.clip(np.rint(light), 0, 255)
    return picture, middle


def errors(detector, radius, tilt_deg):
    """Largest error of the middle, px and in stated sigmas, of each marker found."""
    out = []
    for seed, azimuth in enumerate((10, 100, 250)):
        picture, middle = on_a_branch(radius, tilt_deg, azimuth, seed)
        found = [d for d in detector.detect(picture) if d.id == int(LIBRARY.ids[ROW])]
        for d in found:
            error = np.abs(d.centre_px - middle)
            out.append((error.max(), (error / np.sqrt(np.diag(d.centre_cov_px2))).max()))
    return np.array(out).reshape(-1, 2)


@pytest.mark.parametrize(("radius", "tilt", "reach"), [(12.0, 35, 0.03), (None, 25, 0.1)])
def test_the_middle_of_a_wrapped_marker_is_unbiased(radius, tilt, reach):
    one = Wrapped(int(LIBRARY.ids[ROW]), radius)
    bent = errors(Detector(LIBRARY, wrapped=(one,)), 12.0, tilt)
    assert len(bent) == 3
    assert bent[:, 0].max() < reach
    assert bent[:, 1].max() < 2.5
    flat = errors(Detector(LIBRARY), 12.0, tilt)
    assert not len(flat) or (flat[:, 0].max() > 0.1 and flat[:, 1].max() > 2.5)


def test_a_flat_marker_called_wrapped_is_within_the_sigma_of_that():
    one = Wrapped(int(LIBRARY.ids[ROW]))
    found = errors(Detector(LIBRARY, wrapped=(one,)), 2000.0, 30)
    assert len(found) == 3
    assert found[:, 0].max() < 0.1 and found[:, 1].max() < 2.5
