"""Cameras and homographies against OpenCV, differences and exact identities."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.geometry import (
    CameraModel,
    StereoRig,
    apply_homography,
    diagonal_crossing,
    diagonal_crossing_jacobian,
    homography,
    homography_jacobian,
    nearest_rotation,
    rotation_from_vector,
    vector_from_rotation,
)

K = np.array([[905.0, 0.0, 633.0], [0.0, 899.0, 371.0], [0.0, 0.0, 1.0]])
LENS = np.array([-0.33, 0.10, 0.001, -0.002, 0.01])


def camera() -> CameraModel:
    return CameraModel((1280, 720), K, LENS)


def points(n: int = 40) -> np.ndarray:
    rng = np.random.default_rng(4)
    return rng.uniform([-400, -250, 800], [400, 250, 1600], (n, 3))


def test_projection_is_opencvs():
    want = cv2.projectPoints(points(), np.zeros(3), np.zeros(3), K, LENS)[0][:, 0]
    assert np.abs(camera().project(points()) - want).max() < 1e-9


def test_projection_jacobians_match_differences():
    one, P = camera(), points(8)
    _, by_point, by_lens = one.project_jacobian(P)
    for k in range(3):
        d = np.zeros(3)
        d[k] = 1e-4
        slope = (one.project(P + d) - one.project(P - d)) / 2e-4
        assert np.abs(slope - by_point[:, :, k]).max() < 1e-7
    for k in range(6):
        d = np.zeros(6)
        d[k] = 1e-5
        up, down = one.with_lens(one.lens + d), one.with_lens(one.lens - d)
        slope = (up.project(P) - down.project(P)) / 2e-5
        assert np.abs(slope - by_lens[:, :, k]).max() < 1e-6


def test_ray_undoes_projection_in_the_corners():
    rays = camera().ray([[0.0, 0.0], [1279.0, 719.0], [640.0, 360.0], [np.nan, 1.0]])
    back = camera().project(rays[:3] * 1000)
    assert np.abs(back - [[0.0, 0.0], [1279.0, 719.0], [640.0, 360.0]]).max() < 1e-5
    assert np.isnan(rays[3]).all()


def test_ray_undoes_the_projection_of_a_camera_with_skew():
    skewed = K + np.array([[0.0, 7.5, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    one, corner = CameraModel((1280, 720), skewed, LENS), np.array([[3.0, 2.0], [1270.0, 715.0]])
    given = corner.copy()
    assert np.abs(one.project(one.ray(corner) * 1000) - corner).max() < 1e-5
    assert np.array_equal(corner, given)


def test_points_behind_the_camera_have_no_image():
    assert np.isnan(camera().project([[10.0, 10.0, -500.0]])).all()


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3))
@settings(max_examples=50, deadline=None)
def test_rotation_vectors_round_trip(vector):
    v = np.array(vector)
    if np.linalg.norm(v) > 3.1:
        v = v / np.linalg.norm(v) * 3.1
    R = rotation_from_vector(v)
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-12
    assert np.abs(vector_from_rotation(R) - v).max() < 1e-7
    assert np.abs(nearest_rotation(R * 1.3) - R).max() < 1e-12


def test_homography_through_exact_points_and_its_slope():
    H = np.array([[1.2, 0.1, 30.0], [-0.2, 0.9, 11.0], [1e-4, -2e-4, 1.0]])
    source = np.array([[0, 0], [100, 0], [100, 80], [0, 80], [40, 33.0]])
    found = homography(source, apply_homography(H, source))
    assert np.abs(found - H).max() < 1e-9
    slope = homography_jacobian(H, source)
    for k in range(2):
        d = np.zeros(2)
        d[k] = 1e-5
        difference = (apply_homography(H, source + d) - apply_homography(H, source - d)) / 2e-5
        assert np.abs(difference - slope[:, :, k]).max() < 1e-8


def test_the_centre_is_the_diagonals_crossing_not_the_mean():
    H = np.array([[1.0, 0.2, 300.0], [0.1, 0.9, 200.0], [2e-3, 1e-3, 1.0]])
    corners = apply_homography(H, [[-30, -30], [30, -30], [30, 30], [-30, 30]])
    centre = apply_homography(H, [[0.0, 0.0]])[0]
    assert np.abs(diagonal_crossing(corners) - centre).max() < 1e-10
    assert np.abs(corners.mean(axis=0) - centre).max() > 0.3


def test_crossing_jacobian_matches_differences():
    rng = np.random.default_rng(0)
    square = np.array([[0, 0], [40, 2], [43, 38], [-3, 41.0]])
    corners = square + rng.normal(0, 2, (6, 4, 2))
    J = diagonal_crossing_jacobian(corners)
    for k in range(8):
        d = np.zeros(8)
        d[k] = 1e-5
        up, down = corners + d.reshape(4, 2), corners - d.reshape(4, 2)
        slope = (diagonal_crossing(up) - diagonal_crossing(down)) / 2e-5
        assert np.abs(slope - J[:, :, k]).max() < 1e-8


def test_rig_refuses_what_is_no_rotation():
    with pytest.raises(ValueError, match="not a rotation"):
        StereoRig(camera(), camera(), np.eye(3) * 1.1, np.array([-400.0, 0, 0]))


def test_projection_matrices_project_undistorted_points():
    plain = CameraModel((1280, 720), K, np.zeros(5))
    R, t = rotation_from_vector([0.02, -0.3, 0.01]), np.array([-420.0, 5.0, 30.0])
    rig = StereoRig(plain, plain, R, t)
    left, right = rig.projection_matrices()
    P = points(5)
    for matrix, px in ((left, plain.project(P)), (right, plain.project(rig.to_right(P)))):
        image = np.column_stack([P, np.ones(5)]) @ matrix.T
        assert np.abs(image[:, :2] / image[:, 2:] - px).max() < 1e-9
    assert rig.baseline_mm == pytest.approx(np.linalg.norm(t))
