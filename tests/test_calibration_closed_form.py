"""The paper's closed form: exact on exact points, honest where no camera exists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boards_simulated import SIZE, Recording, camera, grid, record, rig
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.calibration.closed_form import (
    camera_matrix,
    fixes_homography,
    solve_closed,
    stereo_pose,
)
from olivevib.calibration.views import BoardView
from olivevib.errors import InputError
from olivevib.geometry import CameraModel, rotation_from_vector

STILLS = Recording(noise_px=0.0, seconds=10.0, fps=1.0, stills=True)


def plain_rig(skew=0.0):
    """Cameras without distortion, the left one with skew."""
    left, right = camera(990.0, 0.0, 0.0), camera(975.0, 0.0, 0.0, 631.0, 366.0, 1.02)
    K = left.K.copy()
    K[0, 1] = skew
    return rig(left=replace(left, K=K), right=right)


def seen(K, tilts, seed=3, board=None):
    """Exact views of the board at given rotation vectors (V, 3)."""
    board = grid() if board is None else board
    rng, one, views = np.random.default_rng(seed), CameraModel(SIZE, K, np.zeros(5)), []
    for k, tilt in enumerate(tilts):
        R = rotation_from_vector(tilt)
        middle = rng.uniform([-80, -40, 600], [80, 40, 900])
        px = one.project((board - board.mean(axis=0)) @ R.T + middle)
        views.append(BoardView(k, float("nan"), np.arange(len(board)), px, board, 0.1))
    return views


@settings(max_examples=15, deadline=None)
@given(
    st.floats(400, 3000),
    st.floats(0.9, 1.1),
    st.floats(-30, 30),
    st.floats(500, 780),
    st.floats(300, 420),
)
def test_exact_points_give_the_camera_back(f, aspect, skew, cx, cy):
    K = np.array([[f, skew, cx], [0, f * aspect, cy], [0, 0, 1.0]])
    tilts = np.random.default_rng(8).uniform(-0.6, 0.6, (6, 3))
    found = solve_closed(seen(K, tilts), SIZE, "left")
    assert np.abs(found.camera.K - K).max() < 1e-6 * f
    assert np.abs(found.R - rotation_from_vector(tilts)).max() < 1e-9
    assert (found.t_mm[:, 2] > 0).all()


def test_exact_points_give_the_pair_back():
    truth = plain_rig(skew=4.0)
    left, right = record(truth, np.random.default_rng(2), STILLS)
    a, b = solve_closed(left, SIZE, "left"), solve_closed(right, SIZE, "right")
    pose = stereo_pose(a, b, left, right)
    assert abs(a.camera.K[0, 0] - 990.0) < 1e-6
    assert np.abs(a.camera.K - truth.left.K).max() < 1e-6
    assert np.abs(b.camera.K - truth.right.K).max() < 1e-6
    assert np.abs(pose.R - truth.R_right_left).max() < 1e-9
    assert np.abs(pose.t_mm - truth.t_right_left_mm).max() < 1e-6


def test_scatter_of_the_focal_length_is_that_of_the_knowledge_page():
    """Table 3.4, no distortion, 0.1 px, ten views: sd of alpha 2.6 px."""
    K, rng, found = plain_rig().left.K, np.random.default_rng(5), []
    for trial in range(60):
        angle = np.radians(rng.uniform(8, 35, 10))
        side = rng.uniform(0, 2 * np.pi, 10)
        tilts = np.column_stack([angle * np.cos(side), angle * np.sin(side), np.zeros(10)])
        views = [
            replace(v, px=v.px + 0.1 * rng.standard_normal(v.px.shape))
            for v in seen(K, tilts, seed=trial)
        ]
        found.append(solve_closed(views, SIZE, "left").camera.K[0, 0])
    assert 1.5 < np.std(found) < 4.0
    assert abs(np.mean(found) - 990.0) < 2.0


def test_parallel_boards_have_no_camera():
    views = seen(plain_rig().left.K, np.zeros((5, 3)))
    with pytest.raises(InputError, match="no K exists") as caught:
        solve_closed(views, SIZE, "right")
    assert "right camera" in caught.value.what and "parallel" in caught.value.why


def test_no_positive_definite_conic_is_told_and_not_patched():
    K, B = plain_rig().left.K, np.diag([1.0, 1.0, -0.25])  # B33 < 0 has no real camera
    tilts = rotation_from_vector(np.random.default_rng(1).uniform(-0.5, 0.5, (6, 3)))
    H = np.array([K @ columns_orthonormal_under(B, R) for R in tilts])
    with pytest.raises(InputError, match="no K exists") as caught:
        camera_matrix(H, SIZE, "left")
    assert "not positive definite" in caught.value.why and caught.value.remedy


def columns_orthonormal_under(B, R):
    """A homography whose first two columns are orthonormal under the indefinite conic B."""
    a = R[:, 0] / np.sqrt(R[:, 0] @ B @ R[:, 0])
    c = R[:, 1] - (R[:, 1] @ B @ a) * a
    c = c / np.sqrt(c @ B @ c)
    return np.column_stack([a, c, R[:, 2]])


def test_two_views_are_too_few():
    views = seen(plain_rig().left.K, np.array([[0.3, 0, 0], [0, 0.3, 0]]))
    with pytest.raises(InputError, match="needs 3 views"):
        solve_closed(views, SIZE, "left")


@pytest.mark.parametrize(
    ("pick", "enough"),
    [
        ([0, 1, 5, 6], True),
        ([0, 1, 2, 3, 4, 7], False),  # all but one in a line
        ([0, 1, 2, 5], False),
        ([0, 2, 10], False),
        ([0, 1, 2, 5, 6], True),
    ],
)
def test_which_points_fix_a_homography(pick, enough):
    view = seen(plain_rig().left.K, np.zeros((1, 3)))[0]
    keep = np.isin(np.arange(25), pick)
    assert fixes_homography(view.only(keep)) is enough
