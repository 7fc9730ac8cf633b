"""The joint problem: derivatives, exact data, tracks in time, covariance against sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boards_simulated import SIZE, Recording, blank, camera, grid, record, rig, wave
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.calibration.bundle import LAG, ROW_OF, THETA, huber_cost, huber_weights, linearise
from olivevib.calibration.joint import fit_joint, fit_single, make_pair
from olivevib.calibration.lens import better_poses, fit_lens, frontal_pose, mono_prior, planar_pose
from olivevib.calibration.outliers import drop_outliers
from olivevib.calibration.rigid import triangulate
from olivevib.calibration.settings import CalibrationSettings, LensPrior, Shutter
from olivevib.calibration.solve import cost as cost_of
from olivevib.calibration.solve import grams, reduce, solve, values
from olivevib.calibration.tracks import motion_at, polynomial, shifted, speeds, tabulate
from olivevib.calibration.uncertainty import (
    length_sigma,
    point_sigma,
    rig_covariance,
    rig_sensitivity,
    uncertainty,
    vector_jacobian,
    widen,
)
from olivevib.calibration.views import BoardView, pair_views
from olivevib.geometry import StereoRig, rotation_from_vector, vector_from_rotation

SETTINGS = CalibrationSettings()


def joint(seed, what, true=None, given=SETTINGS):
    true = true or rig()
    left, right = record(true, np.random.default_rng(seed), what)
    pair = make_pair(left, right, (blank(), blank()), given)
    return fit_joint(pair, given, fit_single(pair, given)), true


@pytest.fixture(scope="module")
def moving():
    """A small fit with lag, jitter and rolling shutter: every kind of unknown is alive."""
    what = Recording(seconds=8, lag_s=0.02, jitter_s=0.004, readout_s=0.02, missing=0.2)
    return joint(3, what)[0]


def test_every_derivative_is_the_difference_quotient(moving):
    obs = moving.problem.observations
    rng = np.random.default_rng(0)
    lens = [5.0] * 4 + [0.01] * 2
    spread = [*lens, *lens, *[0.01] * 3, *[5] * 3, 0.005, *[0.5] * 3, *[1e-6] * 2]
    poses = [0.01] * 3 + [2] * 3 + [0.002]
    state = moving.state.moved(
        rng.normal(size=len(THETA)) * np.array(spread),
        rng.normal(size=(len(moving.state.R_pose), 7)) * np.array(poses),
    )
    linear = linearise(obs, state)
    nothing = np.zeros(len(THETA)), np.zeros((len(state.R_pose), 7))
    steps = [1e-3] * 4 + [1e-6] * 2 + [1e-3] * 4 + [1e-6] * 2 + [1e-7] * 3 + [1e-4] * 3
    steps += [1e-6] + [1e-4] * 3 + [1e-9] * 2
    for k, h in enumerate(steps):
        move = nothing[0].copy()
        move[k] = h
        up = linearise(obs, state.moved(move, nothing[1])).residual
        down = linearise(obs, state.moved(-move, nothing[1])).residual
        numeric = (up - down) / (2 * h)
        assert np.allclose(
            linear.by_theta[:, :, k], numeric, rtol=1e-4, atol=1e-4 * max(1, abs(numeric).max())
        ), THETA[k]
    for k, h in enumerate([1e-7] * 3 + [1e-4] * 3 + [1e-6]):
        move = nothing[1].copy()
        move[:, k] = h
        up = linearise(obs, state.moved(nothing[0], move)).residual
        down = linearise(obs, state.moved(nothing[0], -move)).residual
        numeric = (up - down) / (2 * h)
        assert np.allclose(
            linear.by_pose[:, :, k], numeric, rtol=1e-4, atol=1e-4 * max(1, abs(numeric).max())
        )


def test_the_prior_knows_its_slope(moving):
    prior, state = moving.problem.prior, moving.state
    cost, gradient, matrix = prior.at(state)
    for k in (0, 1, 2, 5, 7, 10, LAG, 20, ROW_OF[1]):
        move = np.zeros(len(THETA))
        move[k] = 1e-5 * max(1.0, abs(values(state)[k]))
        none = np.zeros((len(state.R_pose), 7))
        up, down = (prior.at(state.moved(s * move, none))[0] for s in (1, -1))
        assert np.isclose((up - down) / (2 * move[k]), gradient[k], rtol=1e-4, atol=1e-6)
    assert np.allclose(matrix, matrix.T) and cost >= 0


def test_eliminating_poses_changes_nothing(moving):
    """The reduced step is the step of the full system."""
    none = np.zeros((len(moving.state.R_pose), 7))
    problem, state = moving.problem, moving.state.moved(np.array([4.0, -3] + [0.0] * 22), none)
    gram, _ = grams(problem, state)
    reduced = reduce(problem, state, gram)
    v, p = len(gram), int(problem.free.sum())
    full, right = np.zeros((7 * v + p, 7 * v + p)), np.zeros(7 * v + p)
    for k, g in enumerate(gram):
        at = slice(7 * k, 7 * k + 7)
        full[at, at], full[at, 7 * v :], full[7 * v :, at] = g[:7, :7], g[:7, 7:-1], g[7:-1, :7]
        full[7 * v :, 7 * v :] += g[7:-1, 7:-1]
        right[at], right[7 * v :] = g[:7, -1], right[7 * v :] + g[7:-1, -1]
    full[7 * v :, 7 * v :] += reduced.prior_matrix
    right[7 * v :] += reduced.prior_gradient
    seen = np.concatenate([np.repeat(gram[:, 0, 0] > 0, 7), np.ones(p, bool)])
    scale = 1 / np.sqrt(np.diag(full)[seen])
    whole = full[np.ix_(seen, seen)] * np.outer(scale, scale)
    want = scale * np.linalg.solve(whole, scale * right[seen])
    got = np.linalg.solve(reduced.total_H, reduced.total_g)
    assert np.allclose(got, want[-p:], rtol=1e-4, atol=1e-9 + 1e-5 * np.abs(want[-p:]).max())
    C = np.linalg.inv(whole) * np.outer(scale, scale)
    assert np.allclose(np.diag(np.linalg.inv(reduced.total_H)), np.diag(C)[-p:], rtol=1e-4)


def test_exact_stills_give_the_truth_back():
    what = Recording(noise_px=1e-4, seconds=15, fps=1, stills=True, bow=(0.6, -0.3, 0.2))
    weak = CalibrationSettings(lens=LensPrior(1.0, 1.0, 10.0, 100.0))
    fit, true = joint(1, what, given=weak)
    s = fit.state
    assert np.allclose(s.left.lens, true.left.lens, rtol=1e-4, atol=0.02)
    assert np.allclose(s.right.lens, true.right.lens, rtol=1e-4, atol=0.02)
    assert np.allclose(s.t_mm, true.t_right_left_mm, atol=0.02)
    assert np.abs(vector_from_rotation(s.R @ true.R_right_left.T)).max() < 2e-5
    assert np.allclose(s.bow_mm, [0.6, -0.3, 0.2], atol=0.005)
    assert fit.solution.converged and not fit.lag_free


@pytest.mark.parametrize("lag", [0.0, 0.037, -0.13])
def test_the_lag_is_found_at_any_size(lag):
    fit, true = joint(5, Recording(noise_px=0.05, seconds=7, fps=12, lag_s=lag))
    assert abs(fit.state.lag_s - lag) < 2e-4
    assert np.allclose(fit.state.t_mm, true.t_right_left_mm, atol=1.5)


def test_row_times_are_found_and_known_ones_are_kept():
    what = Recording(noise_px=0.05, seconds=7, fps=12, lag_s=0.01, readout_s=0.025)
    fit, _ = joint(6, what)
    assert np.allclose(fit.state.row_time_s * SIZE[1], 0.025, atol=5e-4)
    known = Shutter(0.025 / SIZE[1], "led")
    told = CalibrationSettings(left_shutter=known, right_shutter=known)
    fit, _ = joint(6, what, given=told)
    assert np.all(fit.state.row_time_s == 0.025 / SIZE[1])
    assert not fit.problem.free[list(ROW_OF)].any()
    assert abs(fit.state.lag_s - 0.01) < 2e-4


def test_a_lag_beyond_the_range_is_still_found():
    what = Recording(noise_px=0.05, seconds=8, fps=10, lag_s=0.41)
    fit, _ = joint(7, what)
    assert abs(fit.state.lag_s - 0.41) < 1e-3


def test_a_still_board_leaves_the_lag_open():
    what = Recording(noise_px=0.05, seconds=9, fps=6, hold=(10.0, 1.0))
    left, right = record(rig(), np.random.default_rng(2), what)
    more_left, more_right = record(rig(), np.random.default_rng(9), what)
    late = [replace(v, frame=v.frame + 100, t_s=v.t_s + 60) for v in more_left]
    late_right = [replace(v, frame=v.frame + 100, t_s=v.t_s + 60) for v in more_right]
    third_l, third_r = record(rig(), np.random.default_rng(12), what)
    left += late + [replace(v, frame=v.frame + 200, t_s=v.t_s + 120) for v in third_l]
    right += late_right + [replace(v, frame=v.frame + 200, t_s=v.t_s + 120) for v in third_r]
    pair = make_pair(left, right, (blank(), blank()), SETTINGS)
    fit = fit_joint(pair, SETTINGS, fit_single(pair, SETTINGS))
    sure = uncertainty(fit.problem, fit.solution)
    assert np.sqrt(sure.published[LAG, LAG]) > 0.02


@pytest.mark.parametrize(
    ("f", "k1", "k2"),
    [(500.0, -0.3, 0.08), (835.0, 0.0, 0.0), (1500.0, 0.1, -0.2), (2400.0, 0.0, 0.0)],
)
def test_one_lens_finds_no_false_minimum(f, k1, k2):
    one = camera(f, k1, k2)
    what = Recording(noise_px=0.1, seconds=8, fps=1, stills=True)
    motion = wave(np.random.default_rng(1), distance=f * 1.1)
    true = StereoRig(one, one, np.eye(3), np.array([-1.0, 0, 0]))
    views, _ = record(true, np.random.default_rng(4), what, motion=motion)
    pair = make_pair(views, views, (blank(), blank()), SETTINGS)
    fit = fit_lens(pair.left, pair.shape, mono_prior(LensPrior(), pair.left, None, 0.0))
    assert np.abs(fit.camera.lens[:2] / f - 1).max() < 0.02
    assert 0.6 < fit.scale < 1.6


def test_both_planar_poses_are_tried():
    true = rig()
    what = Recording(noise_px=0.05, seconds=10, fps=1, stills=True)
    left, right = record(true, np.random.default_rng(8), what)
    pair = make_pair(left, right, (blank(), blank()), SETTINGS)
    fit = fit_lens(pair.left, pair.shape, mono_prior(LensPrior(), pair.left, None, 0.0))
    good = fit.solution.state
    centre = np.append(pair.shape.centre_mm, 0.0)
    middle = good.R_pose @ centre + good.t_pose_mm
    d = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    mirror = np.eye(3) - 2 * d[:, :, None] * d[:, None, :]
    R = good.R_pose.copy()
    R[::2] = (mirror @ R @ np.diag([1.0, 1, -1]))[::2]
    wrong = replace(good, R_pose=R, t_pose_mm=middle - R @ centre)
    fixed = better_poses(fit.problem, wrong)
    assert fixed is not None
    assert np.abs(fixed.R_pose - good.R_pose).max() < 1e-2
    assert better_poses(fit.problem, good) is None


def test_planar_pose_of_exact_rays():
    rng = np.random.default_rng(3)
    board = grid()
    R, t = rotation_from_vector(rng.normal(size=3) * 0.4), np.array([30.0, -20, 800])
    X = board @ R.T + t
    found = planar_pose(board, X / X[:, 2:])
    assert np.allclose(found[0], R, atol=1e-8) and np.allclose(found[1], t, atol=1e-5)
    turn = rotation_from_vector(np.array([0, 0, 0.7]))
    flat = board @ turn.T + t
    R2, t2 = frontal_pose(board, flat / flat[:, 2:])
    assert np.allclose(R2, turn, atol=1e-9) and np.allclose(t2, t, atol=1e-6)


def test_blunders_and_bad_views_are_dropped():
    true = rig()
    left, right = record(true, np.random.default_rng(2), Recording(seconds=20, fps=1, stills=True))
    px = left[3].px.copy()
    px[7] += [9.0, -6.0]
    left[3] = replace(left[3], px=px)
    right[11] = replace(
        right[11], px=right[11].px + np.random.default_rng(0).normal(size=right[11].px.shape) * 4
    )
    pair = make_pair(left, right, (blank(), blank()), SETTINGS)
    cleaned = drop_outliers(fit_joint(pair, SETTINGS, fit_single(pair, SETTINGS)), SETTINGS)
    assert [d.frame for d in cleaned.dropped] == [11] and "times" in cleaned.dropped[0].reason
    assert cleaned.points >= 1 and not cleaned.too_many
    assert np.allclose(cleaned.fit.state.t_mm, true.t_right_left_mm, atol=1.5)


def test_solver_says_when_it_did_not_arrive(moving):
    far = moving.state.moved(
        np.array([60.0, 60] + [0] * 22), np.zeros((len(moving.state.R_pose), 7))
    )
    assert not solve(moving.problem, far, limit=2).converged
    assert solve(moving.problem, far, limit=80).converged
    assert cost_of(moving.problem, far) > cost_of(moving.problem, moving.state)


def test_huber_is_continuous_and_infinite_behind_the_camera():
    sigma = np.ones(1)
    at = [huber_cost(np.array([[r, 0.0]]), sigma, 2.0) for r in (1.9999999, 2.0000001)]
    assert np.isclose(*at, atol=1e-6)
    assert huber_weights(np.array([[4.0, 0.0]]), sigma, 2.0)[0] == 0.5
    assert huber_cost(np.array([[np.nan, 0.0]]), sigma, 2.0) == np.inf


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.05, 0.05), st.integers(0, 10_000))
def test_shifted_polynomials_are_the_same_curve(by, seed):
    rng = np.random.default_rng(seed)
    c, dt = rng.normal(size=(7, 6, 2)), rng.normal(size=7)
    value, slope = polynomial(shifted(c, np.full(7, by)), dt)
    assert np.allclose(value, polynomial(c, dt - by)[0], atol=1e-9)
    h = 1e-6
    numeric = (polynomial(shifted(c, np.full(7, by)), dt + h)[0] - value) / h
    assert np.allclose(slope, numeric, rtol=1e-3, atol=1e-3)


def track_views(curve, stamps, ids=(2, 5)):
    n = len(ids)
    board = np.zeros((n, 3))
    return [
        BoardView(k, t, np.array(ids), np.array([curve(t) + 10 * j for j in range(n)]), board, 0.1)
        for k, t in enumerate(stamps)
    ]


def test_tracks_follow_a_smooth_hand():
    def curve(t):
        return np.array([300 + 80 * np.sin(3 * t), 200 + 60 * np.cos(2.5 * t)])

    stamps = np.arange(0, 4, 1 / 6)
    table = tabulate(track_views(curve, stamps))
    ask = np.linspace(0.6, 3.2, 40)
    local = motion_at(table, np.full(40, 5), ask)
    assert local.ok.all()
    truth = np.array([curve(t) + 10 for t in ask])
    assert np.abs(local.coefficients[:, 0] - truth).max() < 0.02
    speed = np.column_stack([240 * np.cos(3 * ask), -150 * np.sin(2.5 * ask)])
    assert np.abs(local.velocity - speed).max() < 2.0
    middle = np.array([np.hypot(240 * np.cos(3 * t), 150 * np.sin(2.5 * t)) for t in stamps])
    assert np.allclose(speeds(track_views(curve, stamps))[3:-3], middle[3:-3], rtol=0.05, atol=3)


def test_tracks_do_not_bridge_gaps_nor_guess_ids():
    def curve(t):
        return np.array([100 * t, 50 * t])

    stamps = np.concatenate([np.arange(0, 1, 1 / 6), np.arange(3, 4, 1 / 6)])
    table = tabulate(track_views(curve, stamps))
    local = motion_at(
        table, np.array([2, 2, 2, 7, 2, 2]), np.array([0.45, 2.0, -0.05, 0.5, -0.3, 3.9])
    )
    assert local.ok.tolist() == [True, False, True, False, False, True]
    assert np.allclose(local.coefficients[[0, 2, 5], 0], [curve(t) for t in (0.45, -0.05, 3.9)])
    assert (local.sigma_px[local.ok] >= 0.05).all()


def test_at_its_own_stamp_a_track_is_the_sample_itself():
    rng = np.random.default_rng(0)
    stamps = np.arange(25) / 6 + rng.uniform(-0.04, 0.04, 25)
    views = track_views(lambda t: np.array([200 * t, 30 * t * t]), stamps)
    local = motion_at(tabulate(views), np.full(25, 2), stamps)
    px = np.array([v.px[0] for v in views])
    assert local.ok.sum() >= 20
    assert np.allclose(local.coefficients[local.ok, 0], px[local.ok])
    assert np.allclose(local.sigma_px[local.ok], 0.1)


def test_pairs_by_stamp_and_by_frame():
    def views(stamps, frames):
        ids, px = np.arange(4), np.zeros((4, 2))
        return [
            BoardView(f, t, ids, px, np.zeros((4, 3)), 1.0)
            for f, t in zip(frames, stamps, strict=True)
        ]

    nan = float("nan")
    by_frame = pair_views(views([nan] * 3, [1, 2, 5]), views([nan] * 3, [5, 2, 9]))
    assert by_frame == [(1, 1), (2, 0)]
    left = views(np.arange(5) / 6, range(5))
    right = views(np.arange(1, 6) / 6 + 0.03, range(10, 15))
    assert pair_views(left, right) == [(1, 0), (2, 1), (3, 2), (4, 3)]
    assert pair_views([], right) == []


def test_views_check_themselves():
    ids, px, mm = np.arange(3), np.zeros((3, 2)), np.zeros((3, 3))
    view = BoardView(0, 0.0, ids, px, mm, 0.2)
    assert view.sigma_px.tolist() == [0.2] * 3
    assert view.only(np.array([True, False, True])).ids.tolist() == [0, 2]
    for broken in (
        {"ids": ids[::-1]},
        {"px": np.zeros((2, 2))},
        {"px": np.full((3, 2), np.nan)},
        {"sigma_px": 0.0},
        {"ids": np.array([0, 0, 1])},
    ):
        with pytest.raises(ValueError):
            replace(view, **broken)


def test_small_turns_and_rotation_vectors():
    for v in ([0.3, -0.8, 0.5], [1e-9, 0, 0], [0.0, 1.9, -0.2]):
        R = rotation_from_vector(np.array(v))
        J = vector_jacobian(R)
        for k in range(3):
            w = np.zeros(3)
            w[k] = 1e-6
            up, down = (vector_from_rotation(rotation_from_vector(s * w) @ R) for s in (1, -1))
            assert np.allclose((up - down) / 2e-6, J[:, k], atol=1e-6)
    theta = np.eye(len(THETA))
    assert rig_covariance(theta, R).shape == (18, 18)


def test_point_sensitivities_are_difference_quotients():
    true = rig()
    points = np.array([[30.0, -40, 900], [-100, 60, 1200]])
    by_rig, by_px = rig_sensitivity(true, points)
    left, right = true.left.project(points), true.right.project(true.to_right(points))

    def seen(parameters):
        R = rotation_from_vector(parameters[12:15])
        one = true.left.with_lens(parameters[:6])
        other = true.right.with_lens(parameters[6:12])
        return triangulate(StereoRig(one, other, R, parameters[15:18]), left, right)[0]

    turn = vector_from_rotation(true.R_right_left)
    start = np.concatenate([true.left.lens, true.right.lens, turn, true.t_right_left_mm])
    for k, h in enumerate(
        [1e-2] * 4 + [1e-5] * 2 + [1e-2] * 4 + [1e-5] * 2 + [1e-5] * 3 + [1e-2] * 3
    ):
        move = np.zeros(18)
        move[k] = h
        numeric = (seen(start + move) - seen(start - move)) / (2 * h)
        assert np.allclose(by_rig[:, :, k], numeric, rtol=2e-3, atol=1e-3 * np.abs(numeric).max())
    h = np.array([1e-3, 0])
    up = triangulate(true, left + h, right)[0] - triangulate(true, left - h, right)[0]
    assert np.allclose(by_px[:, :, 0], up / 2e-3, rtol=1e-3, atol=1e-5)


def test_sigmas_of_points_and_lengths():
    covariance = np.diag([1.0] * 4 + [1e-4] * 2 + [1.0] * 4 + [1e-4] * 2 + [1e-7] * 3 + [0.01] * 3)
    true = replace(rig(), covariance=covariance)
    points = np.array([[0.0, 0, 1000], [100, 0, 1000]])
    sigma = point_sigma(true, points, (0.1, 0.1))
    near = point_sigma(true, points * [1, 1, 0.5], (0.1, 0.1))
    assert (sigma.frame_mm[:, 2] > near.frame_mm[:, 2]).all()
    f, base, z = true.left.K[0, 0], true.baseline_mm, 1000.0
    assert np.isclose(sigma.frame_mm[0, 2], np.sqrt(2) * 0.1 * z**2 / (f * base), rtol=0.1)
    length = length_sigma(true, points[:1], points[1:])[0]
    assert 0 < length < np.hypot(*sigma.common_mm.max(axis=0)[:2])


def test_widening_never_narrows():
    rng = np.random.default_rng(4)
    prior = 0.1 * np.eye(6)
    for count, size in ((30, 0.2), (30, 3.0), (4, 1.0)):
        A = rng.normal(size=(count, 9, 6))
        H = A.transpose(0, 2, 1) @ A
        g = size * (A.transpose(0, 2, 1) @ rng.normal(size=(count, 9, 1)))[:, :, 0]
        model = np.linalg.inv(H.sum(axis=0) + prior)
        wide = widen(model, H, g, prior)
        assert np.linalg.eigvalsh(wide - model).min() > -1e-9
        assert np.allclose(wide, wide.T)
        if size == 3.0:
            assert 4 < np.trace(wide) / np.trace(model) < 16


def spread(count, what):
    """Errors of the rig over their published sigma (n, 18), and of one length (n,)."""
    z, lengths = [], []
    ends = np.array([[-100.0, 20, 950], [100.0, -30, 1050]])
    for seed in range(count):
        fit, true = joint(seed, what)
        sure = uncertainty(fit.problem, fit.solution)
        s = fit.state
        off = np.concatenate([
            s.left.lens - true.left.lens,
            s.right.lens - true.right.lens,
            vector_from_rotation(s.R @ true.R_right_left.T),
            s.t_mm - true.t_right_left_mm,
        ])  # fmt: skip
        z.append(off / np.sqrt(np.diag(sure.published)[:18]))
        found = StereoRig(s.left, s.right, s.R, s.t_mm, rig_covariance(sure.published, s.R))
        px = true.left.project(ends), true.right.project(true.to_right(ends))
        X, _, _ = triangulate(found, *px)
        error = np.linalg.norm(X[0] - X[1]) - np.linalg.norm(ends[0] - ends[1])
        lengths.append(error / length_sigma(found, ends[:1], ends[1:])[0])
    return np.array(z), np.array(lengths)


def test_covariance_against_a_few_draws():
    z, lengths = spread(14, Recording(seconds=14, fps=1, stills=True, noise_px=0.1))
    assert (np.abs(z) < 2).mean() > 0.9
    assert 0.6 < np.sqrt((z**2).mean()) < 1.3
    assert np.sqrt((lengths**2).mean()) < 1.6


@pytest.mark.slow
@pytest.mark.parametrize(
    "what",
    [
        Recording(seconds=14, fps=1, stills=True, noise_px=0.1),
        Recording(seconds=15, fps=6, lag_s=-0.03, readout_s=0.025),
        Recording(seconds=15, fps=6, lag_s=0.05, jitter_s=0.005),
    ],
    ids=["stills", "rolling", "jitter"],
)
def test_covariance_against_sampling(what):
    """The spread of every parameter and of a length over many recordings is what is published."""
    z, lengths = spread(100, what)
    assert 0.93 <= (np.abs(z) < 2).mean() <= 0.995
    assert 0.65 < np.sqrt((z**2).mean()) < 1.2
    assert 0.5 < np.sqrt((lengths**2).mean()) < 1.3


def test_known_lenses_hold_where_views_are_few():
    true = rig()
    covariance = np.diag([1.0, 1.0, 0.5, 0.5, 1e-4, 1e-4])
    known = CalibrationSettings(
        known_left=replace(true.left, covariance=covariance),
        known_right=replace(true.right, covariance=covariance),
    )
    left, right = record(true, np.random.default_rng(5), Recording(seconds=4, fps=1, stills=True))
    pair = make_pair(left, right, (blank(), blank()), known)
    fit = fit_joint(pair, known, fit_single(pair, known))
    assert np.abs(fit.state.left.lens[:2] - true.left.lens[:2]).max() < 6
    assert np.abs(fit.state.left.lens[2:4] - true.left.lens[2:4]).max() < 2
