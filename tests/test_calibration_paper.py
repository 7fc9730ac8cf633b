"""The paper's calibration as a whole: the pair, its test on unused frames, what stays unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boards_simulated import SIZE, Recording, camera, record, rig

from olivevib.calibration.paper import calibrate_paper
from olivevib.calibration.views import BoardView
from olivevib.errors import InputError

EXACT = Recording(noise_px=0.0, seconds=12.0, fps=2.0)


def plain_rig():
    return rig(left=camera(990.0, 0.0, 0.0), right=camera(975.0, 0.0, 0.0, 631.0, 366.0))


def codes(result):
    return [caution.code for caution in result.cautions]


def test_exact_points_give_the_pair_and_a_perfect_test():
    truth = plain_rig()
    left, right = record(truth, np.random.default_rng(2), EXACT)
    result = calibrate_paper(left, right, SIZE, SIZE)
    assert result.method == "paper" and "closed form" in result.verdict
    assert np.abs(result.rig.left.K - truth.left.K).max() < 1e-5
    assert np.abs(result.rig.t_right_left_mm - truth.t_right_left_mm).max() < 1e-5
    assert result.rms_left_px < 1e-6 and result.rms_right_px < 1e-6
    assert result.holdout is not None and result.holdout.rms_mm < 1e-6
    assert result.holdout.frames == result.common_frames // 2
    assert codes(result) == ["paper-calibration"]


def test_what_the_closed_form_does_not_know_is_nan():
    left, right = record(plain_rig(), np.random.default_rng(2), EXACT)
    result = calibrate_paper(left, right, SIZE, SIZE)
    assert result.right_offset_s == 0.0 and np.isnan(result.right_offset_sigma_s)
    assert np.isnan(result.row_time_s).all() and np.isnan(result.bow_sigma_mm).all()
    assert np.isnan(result.point_sigma_px).all() and result.rig.covariance is None
    assert np.isnan(result.holdout.rms_z) and result.halves == ()


def noisy(noise_px):
    left, right = record(plain_rig(), np.random.default_rng(2), replace(EXACT, noise_px=noise_px))
    return calibrate_paper(left, right, SIZE, SIZE)


def test_residuals_hold_the_noise_and_grow_with_it():
    result = noisy(0.02)
    floor = 0.02 * np.sqrt(2 * (1 - 8 / 50))  # of a view's own homography: nothing fits better
    assert floor < result.rms_left_px < 2 * floor
    assert result.rms_left_px == pytest.approx(2 * noisy(0.01).rms_left_px, rel=0.05)
    assert result.rms_right_px > floor
    at = result.residuals.camera == 0
    frame = result.residuals.frame[at][0]
    mine = (result.residuals.residual_px[at & (result.residuals.frame == frame)] ** 2).sum(axis=1)
    use = next(v for v in result.views if v.camera == "left" and v.frame == frame)
    assert use.rms_px == pytest.approx(np.sqrt(mine.mean()))


def test_a_late_camera_and_a_bending_lens_are_told_by_the_test():
    bending = rig(left=camera(890.0, -0.33, 0.1), right=camera(880.0, -0.33, 0.1))
    left, right = record(bending, np.random.default_rng(3), replace(EXACT, lag_s=0.1))
    assert "holdout-large" in codes(calibrate_paper(left, right, SIZE, SIZE))


def test_a_view_that_fixes_no_homography_is_left_out_with_its_reason():
    left, right = record(plain_rig(), np.random.default_rng(2), EXACT)
    line = left[3].only(np.isin(left[3].ids, [0, 1, 2, 3, 4, 7]))
    result = calibrate_paper([*left[:3], line, *left[4:]], right, SIZE, SIZE)
    left_out = [view for view in result.views if not view.used]
    assert [(v.camera, v.frame) for v in left_out] == [("left", line.frame)]
    assert "homography" in left_out[0].reason and np.isnan(left_out[0].rms_px)
    assert np.abs(result.rig.left.K - plain_rig().left.K).max() < 1e-5


def test_few_stills_have_no_test_and_say_so():
    left, right = record(plain_rig(), np.random.default_rng(2), replace(EXACT, stills=True))
    result = calibrate_paper(left[:5], right[:5], SIZE, SIZE)
    assert result.holdout is None
    assert codes(result) == ["paper-calibration", "holdout-missing", "few-common-views"]
    assert result.epipolar_rms_px < 1e-6


def test_too_few_views_are_refused():
    left, right = record(plain_rig(), np.random.default_rng(2), EXACT)
    with pytest.raises(InputError, match="left camera shows the board in 2 views"):
        calibrate_paper(left[:2], right, SIZE, SIZE)
    elsewhere = [BoardView(v.frame + 500, v.t_s + 500, v.ids, v.px, v.board_mm, 0.1) for v in right]
    with pytest.raises(InputError, match="together in 0 views"):
        calibrate_paper(left, elsewhere, SIZE, SIZE)
