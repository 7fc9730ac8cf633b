"""Frames of the results: distances stay, directions are the chosen ones, sigmas turn along."""

from __future__ import annotations

import boards_simulated as bs
import numpy as np
import pytest

from olivevib.calibration import calibrate
from olivevib.calibration.uncertainty import point_sigma
from olivevib.geometry import rotation_from_vector, vector_from_rotation
from olivevib.reconstruction import Reconstruction, Trajectory, TrialClock
from olivevib.reconstruction.world import (
    board_world,
    gravity_world,
    placed,
    plumb_up,
    with_rig_sigma,
)


def reconstruction(xyz):
    n, m = xyz.shape[:2]
    cov = np.broadcast_to(np.diag([0.01, 0.02, 0.09]), (n, m, 3, 3))
    path = Trajectory(
        t_s=np.arange(n) / 30,
        ids=np.arange(m) + 1,
        sample_t_s=np.tile(np.arange(n)[:, None] / 30, (1, m)),
        xyz_mm=xyz,
        sigma_xyz_mm=np.sqrt(np.einsum("nmii->nmi", cov)),
        covariance_mm2=cov,
        rotation_rad=np.full((n, m, 3), 0.1),
        sigma_rotation_rad=np.full((n, m, 3), 0.01),
        state=np.zeros((n, m), np.int64),
        epipolar_px=np.zeros((n, m)),
        frame="left camera",
        method="optimal",
    )
    return Reconstruction(path, TrialClock(), 1.0, 0.1)


def points(n=20, m=3, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform([-200, -150, 900], [200, 150, 1200], (n, m, 3))


def test_a_board_frame_puts_its_origin_on_the_board():
    R, t = rotation_from_vector([0.3, -0.2, 0.1]), np.array([10.0, 20, 1000])
    local = points() - [0, 0, 1000]
    before = reconstruction(local @ R.T + t)
    after = placed(before, board_world(R, t, 0.001, "here")).trajectory
    assert after.frame == "board" and np.allclose(after.xyz_mm, local)
    assert np.allclose(after.left_camera_mm, before.trajectory.xyz_mm)
    assert np.allclose(
        np.linalg.det(after.covariance_mm2), np.linalg.det(np.diag([0.01, 0.02, 0.09]))
    )
    turned = rotation_from_vector(after.rotation_rad[0, 0])
    assert np.allclose(turned, R.T @ rotation_from_vector([0.1, 0.1, 0.1]))
    assert np.linalg.norm(vector_from_rotation(turned)) < np.pi


def test_gravity_is_level_and_right_handed():
    up = rotation_from_vector([0.2, 0, 0.1]) @ np.array([0.0, -1, 0])
    world = gravity_world(up, 0.01, "told")
    R = world.R_world_left
    assert np.allclose(R @ up, [0, 0, 1]) and np.linalg.det(R) == pytest.approx(1)
    assert (R @ [1, 0, 0])[0] > 0.9 and (R @ [0, 0, 1])[1] > 0.9


def test_a_plumb_line_gives_the_vertical_and_how_sure_it_is():
    up = np.array([0.05, -0.99, 0.12]) / np.linalg.norm([0.05, -0.99, 0.12])
    rng = np.random.default_rng(3)
    lower = np.array([0.0, 200, 1000]) + 0.1 * rng.standard_normal((200, 3))
    ends = np.stack([lower + 400 * up + 0.1 * rng.standard_normal((200, 3)), lower], axis=1)
    found, sigma = plumb_up(reconstruction(ends).trajectory, 1, 2)
    assert np.linalg.norm(found - up) < 4 * sigma < 1e-3
    with pytest.raises(IndexError):
        plumb_up(reconstruction(ends).trajectory, 1, 7)


def test_every_sample_says_what_the_calibration_adds():
    left, right = bs.record(bs.rig(), np.random.default_rng(5), bs.Recording(stills=True))
    rig = calibrate(left[::4], right[::4], bs.SIZE, bs.SIZE).rig
    xyz = points(4, 2)
    xyz[1, 1] = np.nan
    told = with_rig_sigma(reconstruction(xyz), rig).trajectory.sigma_rig_mm
    assert np.allclose(told[2, 1], point_sigma(rig, xyz[2, 1][None], (0.1, 0.1)).common_mm[0])
    assert np.isnan(told[1, 1]).all() and np.isfinite(told[0]).all()
    world = gravity_world(np.array([0.0, -1, 0]), 0.01, "told")
    turned = with_rig_sigma(placed(reconstruction(xyz), world), rig).trajectory.sigma_rig_mm
    assert np.allclose(turned[0, 0], told[0, 0][[0, 2, 1]])
