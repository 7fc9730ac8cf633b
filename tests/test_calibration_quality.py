"""The door: a whole calibration with its proof, every caution both ways, the verdict in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boards_simulated import SIZE, Recording, camera, grid, record, rig, wave

from olivevib.calibration import CalibrationSettings, calibrate
from olivevib.calibration.coverage import cover
from olivevib.calibration.holdout import common_pairs, distance_errors, place_rigidly
from olivevib.calibration.rigid import epipolar_px, triangulate
from olivevib.errors import InputError
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.progress import Cancelled

STILLS = Recording(seconds=24, fps=1, stills=True, noise_px=0.1)
VIDEO = Recording(seconds=12, fps=6, noise_px=0.05, lag_s=-0.03)


def views(seed=1, what=STILLS, true=None, **keys):
    return record(true or rig(), np.random.default_rng(seed), what, **keys)


def run(left, right, **keys):
    return calibrate(left, right, SIZE, SIZE, **keys)


def codes(result):
    return {caution.code for caution in result.cautions}


@pytest.fixture(scope="module")
def stills():
    return run(*views())


@pytest.fixture(scope="module")
def video():
    return run(*views(2, VIDEO))


def test_sound_stills_come_out_right_and_without_a_caution(stills):
    true = rig()
    assert np.allclose(stills.rig.t_right_left_mm, true.t_right_left_mm, atol=1.5)
    assert np.allclose(stills.rig.left.lens[:4], true.left.lens[:4], atol=4)
    assert codes(stills) == set()
    assert stills.right_offset_s == 0 and np.isnan(stills.right_offset_sigma_s)
    assert np.isnan(stills.row_time_s).all()
    assert stills.method == "joint" and len(stills.halves) == 2
    assert abs(stills.rms_left_px / (0.1 * np.sqrt(2)) - 1) < 0.15


def test_the_hold_out_is_an_independent_proof(stills):
    h = stills.holdout
    assert h.frames >= 10 and h.usable == 1.0 and h.pairs == h.errors_mm.size == h.frame.size
    assert 0.02 < h.rms_percent < 0.3
    assert np.isclose(h.rms_mm, np.sqrt((h.errors_mm**2).mean()))
    assert np.isclose(h.median_percent, np.median(np.abs(h.errors_percent)))
    assert abs(h.bias_percent) < 0.1
    assert 0.1 < h.epipolar_rms_px < 0.25
    assert 0.7 < h.rms_z < 1.4


def test_test_frames_are_not_used_for_the_fit_that_is_tested():
    """A blunder in the odd common frames spoils the test, not the fit of the even ones."""
    left, right = views(4)
    common = common_pairs(left, right, 8)
    for k, _ in common[1::2]:
        left[k] = replace(left[k], px=left[k].px * 1.05)
    h = run(left, right).holdout
    assert h.rms_percent > 2


def test_the_rig_carries_a_full_covariance(stills):
    cov = stills.rig.covariance
    assert cov.shape == (18, 18) and np.allclose(cov, cov.T)
    assert np.linalg.eigvalsh(cov / np.sqrt(np.outer(np.diag(cov), np.diag(cov)))).min() > -1e-9
    assert np.allclose(stills.rig.left.covariance, cov[:6, :6])
    assert np.allclose(stills.rig.right.covariance, cov[6:12, 6:12])


def test_every_residual_and_view_is_told(stills):
    r = stills.residuals
    assert set(np.unique(r.camera)) == {0, 1} and (r.weight > 0).all()
    assert np.isclose(
        np.sqrt((r.residual_px[r.camera == 0] ** 2).sum(axis=1).mean()), stills.rms_left_px
    )
    assert len(stills.views) == 48 and sum(v.used for v in stills.views) >= 40
    assert all(v.reason for v in stills.views if not v.used)
    assert stills.common_frames >= 20
    assert stills.poses.R.shape == (stills.poses.frame.size, 3, 3)


def test_an_early_camera_is_corrected_and_said(video):
    assert abs(video.right_offset_s - 0.03) < max(3 * video.right_offset_sigma_s, 3e-4)
    assert codes(video) == {"early-camera"}
    assert "30" in next(c.text for c in video.cautions) and "early" in video.verdict
    assert 0 < video.reference_row < SIZE[1]
    assert np.abs(video.row_time_s * SIZE[1]).max() < 2e-3
    assert (video.row_time_sigma_s > 0).all()
    assert video.rig.left.row_time_s == 0 and video.rig.left.row_time_source == "unknown"


def test_the_same_input_gives_the_same_bytes():
    left, right = views(3)
    a, b = run(left, right), run(left, right)
    assert a.rig.covariance.tobytes() == b.rig.covariance.tobytes()
    assert a.verdict == b.verdict and a.cautions == b.cautions


def test_the_verdict_names_millimetres_and_the_weak_spot(stills, video):
    for result in (stills, video):
        assert "unused frames" in result.verdict and "mm" in result.verdict
        assert "weakest: " in result.verdict and result.verdict.endswith(".")


def test_few_views_are_an_error_or_a_caution():
    left, right = views()
    with pytest.raises(InputError, match="left camera shows the board in 2 views"):
        run(left[:2], right)
    with pytest.raises(InputError, match="together in 0 views"):
        run(left[:8], right[12:])
    few = run(left[:7], right[:7])
    assert "few-common-views" in codes(few)
    four = run(left[:4], right[:4])
    assert {"few-common-views", "holdout-missing"} <= codes(four) and four.holdout is None
    assert "not tested" in four.verdict.lower() and np.isfinite(four.epipolar_rms_px)


def test_frontal_boards_at_one_distance_are_told():
    flat = wave(np.random.default_rng(3))
    amplitude = flat.amplitude.copy()
    amplitude[:2] *= 0.08
    amplitude[5] *= 0.02
    motion = replace(flat, amplitude=amplitude)
    parallel = StereoRig(camera(), camera(975.0), np.eye(3), np.array([-60.0, 0, 0]))
    result = run(*views(5, true=parallel, motion=motion))
    assert "frontal-views" in codes(result)
    assert "focal-uncertain" in codes(result)


def test_a_bent_board_is_modelled_and_told():
    result = run(*views(6, replace(STILLS, bow=(1.2, 0.0, -0.5))))
    assert "bent-board" in codes(result)
    assert np.allclose(
        result.bow_mm, [1.2, 0.0, -0.5], atol=max(0.1, 3 * result.bow_sigma_mm.max())
    )


def test_cameras_that_see_different_things_disagree():
    left, right = views(7)
    other = [replace(v, px=np.array([SIZE[0] - 1, 0]) + v.px * [-1, 1]) for v in right]
    assert "cameras-disagree" in codes(run(left, other))


def test_a_changed_focus_contradicts_itself():
    left, right = views(8, replace(STILLS, seconds=30))
    zoomed = rig(left=camera(1040.0))
    left2, _ = views(8, replace(STILLS, seconds=30), true=zoomed)
    mixed = [a if a.frame < 15 else b for a, b in zip(left, left2, strict=True)]
    assert "halves-contradict" in codes(run(mixed, right))


def test_swapped_and_turned_cameras_are_told():
    left, right = views(9)
    assert "cameras-swapped" in codes(run(right, left))
    true = rig()
    quarter = rotation_from_vector(np.array([0, 0, np.pi / 2]))
    rolled = StereoRig(
        true.left, true.right, quarter @ true.R_right_left, quarter @ true.t_right_left_mm
    )
    assert "camera-turned" in codes(run(*views(9, true=rolled)))


def test_uneven_stamps_are_told():
    result = run(*views(10, replace(VIDEO, jitter_s=0.012, seconds=15)))
    assert "uneven-stamps" in codes(result)
    assert 0.006 < result.jitter_s < 0.02


def test_noise_beyond_all_bounds_is_told():
    result = run(*views(11, replace(STILLS, noise_px=1.5)))
    assert "residual-large" in codes(result) and "holdout-large" in codes(result)


def test_long_videos_are_thinned_but_keep_their_tracks():
    left, right = views(12, Recording(seconds=20, fps=15, noise_px=0.05, lag_s=0.02))
    result = run(left, right, settings=CalibrationSettings(most_views=40))
    assert result.common_frames <= 40
    assert abs(result.right_offset_s + 0.02) < max(3 * result.right_offset_sigma_s, 3e-4)
    assert any("tells less than the views" in v.reason for v in result.views)
    assert "common views solved for" in result.choice


def test_work_can_be_cancelled():
    def stop(done, total, note):
        raise Cancelled

    with pytest.raises(Cancelled):
        run(*views(), tick=stop)


def test_exact_points_triangulate_exactly():
    true, rng = rig(), np.random.default_rng(0)
    points = rng.uniform([-200, -100, 700], [200, 100, 1400], (30, 3))
    left, right = true.left.project(points), true.right.project(true.to_right(points))
    X, residual, by_px = triangulate(true, left, right)
    assert np.abs(X - points).max() < 1e-5 and np.abs(residual).max() < 1e-6
    assert by_px.shape == (30, 3, 4)
    assert epipolar_px(true, left, right).max() < 1e-6
    up = epipolar_px(true, left + np.array([0, 1.0]), right)
    assert np.allclose(up, 1.0, atol=0.1)


def test_rigid_placing_and_distances():
    board, rng = grid(), np.random.default_rng(1)
    R, t = rotation_from_vector(rng.normal(size=3)), np.array([3.0, -7, 900])
    found = place_rigidly(board, board @ R.T + t)
    assert np.allclose(found[0], R) and np.allclose(found[1], t)
    share, mm = distance_errors(board, board * 1.01)
    assert np.allclose(share, 0.01) and len(mm) == 300


def test_coverage_counts_cells_tilts_and_distances(stills):
    assert stills.left_coverage.cells.shape == (5, 8)
    assert 0 < stills.left_coverage.filled <= 1
    true, board = rig(), grid()
    left, _ = views(1)
    rng = np.random.default_rng(1)
    motion = wave(rng)
    R, t = motion.pose(np.array([v.frame for v in left], dtype=float), board)
    assert stills.left_coverage.far_to_near > 1.05
    state = replace(_state(true), R_pose=R, t_pose_mm=t)
    covered = cover(left, SIZE, state, board.mean(axis=0)[:2])
    assert covered.cells.sum() == sum(v.ids.size for v in left)
    assert covered.emptiest().split()[0] in ("upper", "middle", "lower", "centre")


def _state(true):
    from olivevib.calibration.bundle import State

    none = np.zeros(3)
    return State(
        true.left, true.right, true.R_right_left, none, 0.0, none,
        np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(2),
    )  # fmt: skip


def test_paper_mode_has_the_same_shape():
    from olivevib.calibration import calibrate_paper

    plain = rig(left=camera(k1=0, k2=0), right=camera(975.0, 0, 0))
    result = calibrate_paper(*views(3, true=plain), SIZE, SIZE)
    assert result.method == "paper" and result.rig.covariance is None
    assert isinstance(result.rig.left, CameraModel)
    assert abs(result.rig.left.K[0, 0] / 990 - 1) < 0.02
