"""Triangulation against truth and sampling; pairing in time; the naive path kept as the paper's."""

from dataclasses import replace

import numpy as np
import pytest

from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.reconstruction import (
    ReconstructionSettings,
    TrialClock,
    clock_from_motion,
    linear_eigen,
    reconstruct,
    triangulate,
)
from olivevib.signals import State
from olivevib.tracking import Track

SIGMA = 0.1
CORNERS = np.array([[-30, -30, 0], [30, -30, 0], [30, 30, 0], [-30, 30, 0.0]])


def rig() -> StereoRig:
    K = np.array([[990.0, 0, 645], [0, 988.0, 352], [0, 0, 1]])
    left = CameraModel((1280, 720), K, np.array([-0.2, 0.05, 0, 0, 0]))
    right = CameraModel((1280, 720), K, np.array([-0.18, 0.04, 0, 0, 0]))
    return StereoRig(left, right, rotation_from_vector([0, 0.3, 0]), np.array([-420, 0, 60.0]))


def images(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    one = rig()
    return one.left.project(points), one.right.project(one.to_right(points))


def cov(n: int, k: int = 2) -> np.ndarray:
    return np.broadcast_to(np.eye(k) * SIGMA**2, (n, k, k)).copy()


def test_exact_images_give_exact_points():
    points = np.random.default_rng(1).uniform([-200, -150, 1000], [300, 150, 1700], (30, 3))
    left, right = images(points)
    assert np.abs(linear_eigen(rig(), left, right) - points).max() < 1e-6
    found = triangulate(rig(), left, cov(30), right, cov(30))
    assert np.abs(found.xyz_mm - points).max() < 1e-7
    assert np.abs(found.epipolar_px).max() < 1e-7


def test_covariance_matches_sampling():
    rng = np.random.default_rng(2)
    point = np.tile([120.0, 40.0, 1400.0], (4000, 1))
    left, right = (px + rng.normal(0, SIGMA, px.shape) for px in images(point))
    found = triangulate(rig(), left, cov(4000), right, cov(4000))
    sampled = np.cov(found.xyz_mm.T)
    predicted = found.covariance_mm2.mean(axis=0)
    assert np.abs(np.diag(sampled) / np.diag(predicted) - 1).max() < 0.08
    assert np.sqrt(np.mean(found.epipolar_z**2)) == pytest.approx(1.0, abs=0.05)
    assert predicted[2, 2] > 4 * predicted[0, 0]  # depth is the weak axis


def test_the_optimum_is_no_worse_than_linear_eigen_with_unequal_noise():
    rng = np.random.default_rng(3)
    point = np.tile([-250.0, 150.0, 1100.0], (1500, 1))
    left, right = images(point)
    left, right = left + rng.normal(0, 0.05, left.shape), right + rng.normal(0, 0.8, left.shape)
    weak = cov(1500) * 64
    best = triangulate(rig(), left, cov(1500) / 4, right, weak).xyz_mm - point
    linear = linear_eigen(rig(), left, right) - point
    assert np.sqrt(np.mean(best**2)) < np.sqrt(np.mean(linear**2))


def test_a_missing_image_is_nan_not_a_number():
    left, right = images(np.tile([0.0, 0, 1200], (3, 1)))
    left[1] = np.nan
    found = triangulate(rig(), left, cov(3), right, cov(3))
    assert np.isnan(found.xyz_mm[1]).all()
    assert np.isfinite(found.xyz_mm[[0, 2]]).all()


def track(side: str, t_s: np.ndarray, motion, row_time_s: float = 0.0, noise=0.0) -> Track:
    """A marker that moves by motion(t) (mm), as one camera saw it at its own times."""
    rng = np.random.default_rng(5 if side == "left" else 6)
    one = rig()
    n = t_s.size
    shape = CORNERS @ rotation_from_vector([0.1, 0.2, 0.3]).T
    pixels = np.empty((n, 5, 2))
    seen_s = t_s.copy()
    for k in range(n):
        for _ in range(3):  # the row decides the time, the time decides the row
            where = motion(seen_s[k]) + np.vstack([np.zeros(3), shape])
            if side == "left":
                pixels[k] = one.left.project(where)
            else:
                pixels[k] = one.right.project(one.to_right(where))
            seen_s[k] = t_s[k] + row_time_s * pixels[k, 0, 1]
    pixels += rng.normal(0, noise, pixels.shape) if noise else 0.0
    return Track(
        camera=side,
        id=4,
        frame=np.arange(n),
        t_s=t_s + row_time_s * pixels[:, 0, 1],
        raw_row=pixels[:, 0, 1],
        corners_px=pixels[:, 1:],
        corners_cov_px2=cov(n, 8),
        centre_px=pixels[:, 0],
        centre_cov_px2=cov(n),
        exposure_s=np.full(n, np.nan),
        state=np.zeros(n, np.int64),
    )


def slow(t: float) -> np.ndarray:
    return np.array([100 + 8 * np.sin(2 * np.pi * 1.1 * t), 20, 1400 + 5 * np.cos(2.2 * t)])


def depth_error(clock: TrialClock, late_s: float, settings=None) -> float:
    t = np.arange(60) / 30
    left, right = track("left", t, slow), track("right", t + late_s, slow)
    # the right camera stamps its frames as if it were in step
    stamped = Track(**{**right.__dict__, "t_s": t})
    found = reconstruct([left], [stamped], rig(), clock, {4: CORNERS}, settings).trajectory
    truth = np.array([slow(s) for s in found.sample_t_s[:, 0]])
    good = found.seen[:, 0]
    return float(np.sqrt(np.mean((found.xyz_mm[good, 0] - truth[good])[:, 2] ** 2)))


def test_a_known_offset_removes_the_false_depth():
    known = TrialClock(right_offset_s=0.009, right_offset_sigma_s=1e-5, source="declared")
    assert depth_error(TrialClock(), 0.009) > 0.5
    assert depth_error(known, 0.009) < 0.01
    naive = depth_error(known, 0.009, ReconstructionSettings(paper=True))
    assert naive > 0.5  # the paper's synchronous pairs keep it


def test_row_times_of_both_cameras_are_used():
    t = np.arange(60) / 30
    left, right = track("left", t, slow, 25e-6), track("right", t, slow, -25e-6)
    clock = TrialClock(0.0, 1e-5, 0.0, "declared", 25e-6, -25e-6)
    found = reconstruct([left], [right], rig(), clock, {4: CORNERS}).trajectory
    truth = np.array([slow(s) for s in found.sample_t_s[:, 0]])
    good = found.seen[:, 0]
    assert good.sum() >= 57
    assert np.abs(found.xyz_mm[good, 0] - truth[good]).max() < 0.02


def test_rotation_and_its_sigma():
    t = np.arange(400) / 30
    still = lambda s: np.array([50.0, 10.0, 1300.0])  # noqa: E731
    pair = [track(s, t, still, noise=SIGMA) for s in ("left", "right")]
    found = reconstruct([pair[0]], [pair[1]], rig(), TrialClock(), {4: CORNERS}).trajectory
    error = found.rotation_rad[:, 0] - [0.1, 0.2, 0.3]
    z = error.std(axis=0) / found.sigma_rotation_rad[:, 0].mean(axis=0)
    assert np.abs(error.mean(axis=0)).max() < 0.002
    assert (z > 0.85).all()
    assert (z < 1.15).all()


def test_gaps_keep_their_reason_and_are_not_bridged():
    t = np.arange(40) / 30
    left, right = track("left", t, slow), track("right", t + 0.002, slow)
    values = {**right.__dict__}
    state, centre = right.state.copy(), right.centre_px.copy()
    state[10:16], centre[10:16] = State.HIDDEN, np.nan
    values |= {"state": state, "centre_px": centre}
    found = reconstruct([left], [Track(**values)], rig(), TrialClock(), {4: CORNERS}).trajectory
    assert np.isnan(found.xyz_mm[11:15, 0]).all()
    assert (found.state[11:15, 0] == State.HIDDEN).all()
    assert found.seen[20, 0]


def test_a_wrong_rig_is_told_by_the_epipolar_residual():
    t = np.arange(40) / 30
    left, right = track("left", t, slow), track("right", t, slow)
    bumped = StereoRig(
        rig().left,
        rig().right,
        rotation_from_vector([0.01, 0, 0]) @ rig().R_right_left,
        rig().t_right_left_mm,
    )
    result = reconstruct([left], [right], bumped, TrialClock(), {4: CORNERS})
    assert result.epipolar_rms_px > 1.0
    assert "epipolar-residual" in {c.code for c in result.cautions}
    assert result.sigma_scale > 10


def test_the_dataframe_has_the_columns_of_the_export():
    t = np.arange(5) / 30
    pair = [track(s, t, slow) for s in ("left", "right")]
    frame = reconstruct([pair[0]], [pair[1]], rig(), TrialClock(), {4: CORNERS}).trajectory
    table = frame.to_dataframe()
    assert list(table.columns) == [
        *("time_s", "marker", "x_mm", "y_mm", "z_mm"),
        *("sigma_x_mm", "sigma_y_mm", "sigma_z_mm", "state"),
    ]
    assert len(table) == 5
    assert table["state"].tolist() == ["seen"] * 5


def hand_pushed(t: float) -> np.ndarray:
    a = 2 * np.pi * t / 7.0 + 0.3 * np.sin(0.9 * t)
    return np.array([300 * np.cos(a), 120 * np.sin(a), 1400 + 90 * np.sin(a)])


def late_tracks(motion, late_s: float, row_time_s: float, noise: float) -> tuple[Track, Track]:
    """Both cameras at 30 frames/s, the right one late by that much at row 0, unknown to it."""
    t = np.arange(240) / 30
    left = track("left", t, motion, row_time_s, noise)
    right = track("right", t + late_s, motion, row_time_s, noise)
    return left, replace(right, t_s=right.t_s - late_s)


@pytest.mark.parametrize("late_s", [0.002, -0.011, 0.140])
def test_slow_motion_tells_the_offset_between_the_cameras(late_s):
    left, right = late_tracks(hand_pushed, late_s, 2.8e-5, 0.05)
    clock = clock_from_motion(
        [left], [right], rig(), TrialClock(left_row_time_s=2.8e-5, right_row_time_s=2.8e-5)
    )
    assert clock.source == "slow motion"
    assert clock.right_offset_s == pytest.approx(late_s, abs=4 * clock.right_offset_sigma_s)
    assert clock.right_offset_sigma_s < 3e-4


def test_motion_that_the_frames_do_not_follow_tells_no_offset():
    def fast(t: float) -> np.ndarray:
        return hand_pushed(t) + np.array([0, 4 * np.sin(2 * np.pi * 24.0 * t), 0])

    left, right = late_tracks(fast, 0.004, 0.0, 0.05)
    assert clock_from_motion([left], [right], rig(), TrialClock()).source == "unknown"


def test_an_alias_that_looks_slow_tells_no_offset(monkeypatch):
    """25 Hz look like 5 Hz: 8.7 ms apart, the cameras meet best 50 ms beside that, but not well."""

    def shaken(t: float) -> np.ndarray:
        turn, sway = 2 * np.pi * 25.0 * t, 2 * np.pi * 0.5 * t
        return np.array([3 * np.cos(turn), 1.5 * np.sin(turn) + 2 * np.sin(sway), 1400])

    pairs = [late_tracks(shaken, 0.0087, 0.0, 0.01) for _ in range(2)]
    left, right = (
        [replace(p[k], id=4 + m, centre_cov_px2=p[k].centre_cov_px2 * (0.01 / SIGMA) ** 2)
         for m, p in enumerate(pairs)]
        for k in (0, 1)
    )  # fmt: skip
    assert clock_from_motion(left, right, rig(), TrialClock()).source == "unknown"
    monkeypatch.setattr("olivevib.reconstruction.trial_offset.MISSED", 1e9)
    wrong = clock_from_motion(left, right, rig(), TrialClock())
    assert wrong.source == "slow motion"
    assert abs(wrong.right_offset_s - 0.0087) > 20 * wrong.right_offset_sigma_s


def test_a_marker_at_rest_tells_no_offset():
    left, right = late_tracks(lambda _: np.array([50.0, 20, 1400]), 0.004, 0.0, 0.05)
    assert clock_from_motion([left], [right], rig(), TrialClock()).source == "unknown"


def test_frame_times_stand_where_a_marker_was_hardly_seen():
    """Frames before and after the only sight of a marker keep their own times."""
    t = np.arange(12) / 6
    left, right = (track(side, t, slow, 2.5e-5) for side in ("left", "right"))
    height = rig().left.size_px[1]
    hidden = np.arange(12) != 5
    rare = []
    for one in (left, right):
        row = np.where(hidden, np.nan, one.raw_row)
        raw = one.t_s - 2.5e-5 * one.raw_row
        blank = {
            name: np.where(hidden.reshape(-1, *[1] * (getattr(one, name).ndim - 1)), np.nan,
                           getattr(one, name))
            for name in ("corners_px", "corners_cov_px2", "centre_px", "centre_cov_px2")
        }  # fmt: skip
        state = np.where(hidden, int(State.LOST), one.state)
        seen_s = raw + 2.5e-5 * np.where(hidden, height / 2, one.raw_row)
        rare.append(replace(one, raw_row=row, t_s=seen_s, state=state, **blank))
    clock = TrialClock(left_row_time_s=2.5e-5, right_row_time_s=2.5e-5)
    found = reconstruct([rare[0]], [rare[1]], rig(), clock, {left.id: CORNERS}).trajectory
    assert np.abs(found.t_s - t).max() < 1e-9
