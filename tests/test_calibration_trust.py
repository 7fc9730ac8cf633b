"""A rig at work: bumps, a changed focus and a wrong size are told; a sound rig is left in peace."""

from __future__ import annotations

from dataclasses import replace

import boards_simulated as bs
import numpy as np
import pytest

from olivevib.calibration import calibrate
from olivevib.calibration.trust import cautions_of, exchanged, judge_rig, sides_mm
from olivevib.calibration.uncertainty import point_sigma
from olivevib.geometry import rotation_from_vector

CORNERS = 30.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


@pytest.fixture(scope="module")
def rig():
    left, right = bs.record(bs.rig(), np.random.default_rng(5), bs.Recording(stills=True))
    return calibrate(left[::3], right[::3], bs.SIZE, bs.SIZE).rig


def markers(count=8, seed=1):
    """Corners (M, 4, 3) of markers spread over the pictures."""
    rng = np.random.default_rng(seed)
    places = rng.uniform([-300, -180, 900], [300, 180, 1200], (count, 3))
    turns = rotation_from_vector(rng.uniform(-0.4, 0.4, (count, 3)))
    return np.einsum("mij,kj->mki", turns, CORNERS) + places[:, None]


def seen(true, xyz, noise_px=0.02):
    rng = np.random.default_rng(2)
    flat = xyz.reshape(-1, 3)
    images = [true.left.project(flat), true.right.project(true.to_right(flat))]
    return [(px + noise_px * rng.standard_normal(px.shape)).reshape(-1, 4, 2) for px in images]


def judged(rig, true, scale=1.0):
    xyz = markers()
    return judge_rig(rig, *seen(true, xyz), scale * sides_mm(xyz))


def codes(trust):
    return [c.code for c in cautions_of(trust)]


def test_a_sound_rig_is_left_in_peace(rig):
    trust = judged(rig, bs.rig())
    assert codes(trust) == [] and trust.epipolar_px < 3 * trust.expected_px


@pytest.mark.parametrize("turn", [[0.004, 0, 0], [0.003, 0.002, -0.004]])
def test_a_bumped_tripod_is_named_with_its_angle(rig, turn):
    true = bs.rig()
    bumped = replace(true, R_right_left=rotation_from_vector(turn) @ true.R_right_left)
    trust = judged(rig, bumped)
    assert codes(trust)[0] == "rig-moved" and trust.likely == "turned"
    across = np.degrees(np.hypot(turn[0], turn[2]))
    assert trust.turned_deg == pytest.approx(across, rel=0.5)


def test_a_changed_focus_is_told_from_a_bump(rig):
    true = bs.rig()
    lens = true.right.lens * np.array([1.03, 1.03, 1, 1, 1, 1])
    trust = judged(rig, replace(true, right=true.right.with_lens(lens)))
    assert codes(trust)[0] == "focus-changed"
    assert trust.stretched_percent == pytest.approx(3.0, abs=1.0)


def test_a_wrong_marker_size_is_told(rig):
    trust = judged(rig, bs.rig(), scale=1.03)
    assert codes(trust) == ["marker-size-contradicts"]
    assert trust.size_percent == pytest.approx(-2.9, abs=0.3)


@pytest.mark.parametrize("parallel", [False, True])
def test_swapped_recordings_are_told_from_a_bump(rig, parallel):
    true = bs.rig()
    if parallel:  # no epipolar line is missed then: the points come to lie behind the cameras
        true = replace(true, right=true.left, R_right_left=np.eye(3),
                       t_right_left_mm=np.array([-300.0, 0, 0]))  # fmt: skip
        rig = replace(true, covariance=rig.covariance)
    xyz = markers()
    right, left = seen(true, xyz)
    told = judge_rig(rig, left, right, sides_mm(xyz))
    assert told.likely == "swapped" and codes(told) == ["recordings-swapped"]
    assert told.exchanged_px < 0.5
    assert codes(judge_rig(rig, right, left, sides_mm(xyz))) == []


def test_a_pair_is_exchanged_with_its_covariance(rig):
    back = exchanged(exchanged(rig))
    assert np.allclose(back.t_right_left_mm, rig.t_right_left_mm)
    assert np.allclose(back.covariance, rig.covariance, rtol=1e-3, atol=1e-12)
    point = np.array([[50.0, -30, 1000]])
    sigma = point_sigma(rig, point, (0.1, 0.1)).common_mm[0]
    there = point_sigma(exchanged(rig), rig.to_right(point), (0.1, 0.1)).common
    here = rig.R_right_left.T @ there[0] @ rig.R_right_left
    assert np.linalg.norm(sigma) > 0 and np.trace(here) > 0


def test_nothing_to_judge(rig):
    none = np.zeros((0, 4, 2))
    assert judge_rig(rig, none, none, np.zeros((0, 4))) is None and cautions_of(None) == ()
