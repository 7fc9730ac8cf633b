"""Splines, projections and shared columns of the continuous-time fit, against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from olivevib.geometry import rotation_from_vector
from olivevib.reconstruction.motion import Anchor, MotionSettings, observe
from olivevib.reconstruction.motion.decide import in_step, keeps_branch
from olivevib.reconstruction.motion.exposure import blur_gains
from olivevib.reconstruction.motion.pixels import look
from olivevib.reconstruction.motion.prepare import layout, model_of, sway_precision, time_prior
from olivevib.reconstruction.motion.problem import Pose, harmonic_columns, project
from olivevib.reconstruction.motion.solve import Coefficients, shared_columns
from olivevib.reconstruction.motion.spline import knots_over
from olivevib.reconstruction.motion.start import about_sway
from olivevib.studies.blind_scenes import Scene, orbit, rig, sight
from olivevib.tracking import Track


def scene(f_hz: float = 25.0, mm: float = 3.0, **changes) -> Scene:
    draws = np.random.default_rng(3)
    plain = Scene(
        f_hz=f_hz,
        span_s=4.0,
        readout_s=(0.020, 0.024),
        offset_s=0.009,
        drift=2e-5,
        amplitude=np.array([[orbit(draws, mm, 5e-3), 0.12 * orbit(draws, mm, 5e-3)]]),
        sway=((0.7, orbit(draws, 5.0, 0.01)),),
        noise_px=0.05,
        common_px=0.02,
        drops=0.05,
    )
    return replace(plain, **changes)


def anchor_of(s: Scene, share: float = 0.02, offset_sigma_s: float = 5e-4) -> Anchor:
    left, right = (r / 720 for r in s.readout_s)
    return Anchor(
        left * (1 + share / 2),
        share * left,
        right * (1 - share / 2),
        share * right,
        "led",
        s.offset_s + 0.5 * offset_sigma_s,
        offset_sigma_s,
        0.0,
        "calibration",
    )


def test_spline_adds_to_one_and_its_derivatives_are_those_of_differences():
    knots = knots_over(0.3, 4.1, 0.17)
    t = np.linspace(0.35, 4.05, 200)
    assert np.allclose(knots.matrix(t).sum(axis=1), 1.0, atol=1e-13)
    c = np.random.default_rng(0).normal(size=(knots.count, 2))
    e = 1e-5
    for d in (1, 2):
        difference = (knots.values(c, t + e, d - 1) - knots.values(c, t - e, d - 1)) / (2 * e)
        assert np.allclose(knots.values(c, t, d), difference, rtol=1e-6, atol=1e-4)


def test_spline_reproduces_a_quintic_exactly():
    knots = knots_over(0.0, 2.0, 0.2)
    t = np.linspace(0, 2, 300)
    y = t**5 - 3 * t**3 + 1
    c = np.linalg.lstsq(knots.matrix(t), y, rcond=None)[0]
    assert np.abs(knots.matrix(t) @ c - y).max() < 1e-9


@pytest.mark.parametrize("side", ["left", "right"])
def test_projection_by_motion_against_differences(side):
    pair = rig()
    points = np.array([[-27.0, -27, 0], [27, -27, 0], [27, 27, 0], [-27, 27, 0]])
    pose = Pose(rotation_from_vector(np.array([0.3, -0.2, 0.1])), np.array([50.0, 30, 1400]))
    xi = np.random.default_rng(1).normal(size=(3, 4, 6)) * [5, 5, 5, 0.05, 0.05, 0.05]
    other = None if side == "left" else pair
    camera = pair.left if side == "left" else pair.right
    _, J = project(camera, other, pose, points, xi)
    for a in range(6):
        e = np.zeros(6)
        e[a] = 1e-4 if a < 3 else 1e-6
        up = project(camera, other, pose, points, xi + e)[0]
        down = project(camera, other, pose, points, xi - e)[0]
        assert np.allclose(J[..., a], (up - down) / (2 * e[a]), rtol=1e-4, atol=1e-4)


def test_shared_columns_against_differences():
    s = scene()
    seen, anchor, settings = sight(s, rig(), np.random.default_rng(4)), anchor_of(s), None
    settings = MotionSettings()
    pixels = look(seen, 0.2, 2)
    clock, knots, _, _ = layout(seen, anchor, settings, 0.2)
    _, problems, _ = about_sway(seen, rig(), pixels, clock, knots, sway_precision(settings))
    model = model_of(problems, seen, anchor, settings, knots, clock.mid_s)
    draws = np.random.default_rng(5)
    own = Coefficients(draws.normal(size=(knots.count, 6)), draws.normal(size=(2, 2, 6)))
    theta = model.theta0.copy()
    theta[0], theta[2] = 24.7, 3e-5

    def data(at):
        t = problems[0].times(model.clock(at))
        phi, _ = model.phase(at, t)
        sway = np.einsum("npdk,npk->nd", problems[0].V, knots.values(own.sway, t))
        return sway + harmonic_columns(problems[0], phi, 2) @ own.harmonic.ravel()

    t = problems[0].times(model.clock(theta))
    columns = shared_columns(model, problems[0], theta, t, own)
    for k, size in enumerate((1e-5, 1e-8, 1e-8, 1e-10, 1e-10)):
        e = np.zeros(5)
        e[k] = size
        difference = (data(theta + e) - data(theta - e)) / (2 * size)
        scale = np.abs(difference).max()
        assert np.abs(columns[:, :, k] - difference).max() < 1e-3 * scale, k


def test_offset_prior_moves_to_the_markers_row_with_its_covariance():
    anchor = Anchor(2.8e-5, 3e-7, 3.3e-5, 4e-7, "led", 4e-3, 1e-4, 100.0, "calibration")
    theta0, precision, active = time_prior(anchor, 400.0, 1e-4)
    assert theta0[1] == pytest.approx(4e-3 + 300 * 5e-6)
    on = np.ix_([1, 3, 4], [1, 3, 4])
    covariance = np.linalg.inv(precision[on])
    assert np.sqrt(covariance[0, 0]) == pytest.approx(np.hypot(1e-4, 300 * 5e-7), rel=1e-6)
    assert active.all()


def test_tracks_become_sightings_at_the_time_of_row_zero():
    n, row_time = 60, 2.5e-5
    zero = np.arange(n) / 30 + 0.5
    centre = np.column_stack([np.full(n, 600.0), 300 + 5 * np.sin(np.arange(n))])
    square = np.array([[-20.0, -20], [20, -20], [20, 20], [-20, 20]])
    state = np.zeros(n, dtype=np.int64)
    state[7] = 1
    track = Track(
        "left", 4, np.arange(n), zero + row_time * centre[:, 1], centre[:, 1],
        centre[:, None] + square, np.broadcast_to(np.eye(8), (n, 8, 8)) * 0.01, centre,
        np.broadcast_to(np.eye(2), (n, 2, 2)) * 0.01, np.full(n, 2e-3), state,
    )  # fmt: skip
    corners = {4: np.column_stack([square, np.zeros(4)])}
    seen = observe([track], [replace(track, camera="right")], corners, (row_time, row_time))
    view = seen.markers[0].left
    assert view.frame.size == n - 1
    assert 7 not in view.frame
    assert np.allclose(view.row_zero_s, np.delete(zero, 7), atol=1e-12)
    assert np.allclose(view.row, view.px[..., 1])
    assert seen.frame_rate_hz == pytest.approx(30.0)
    with pytest.raises(ValueError, match="both cameras"):
        observe([track], [], corners)


def test_blur_is_free_corrected_or_refused():
    s = scene()
    seen = sight(s, rig(), np.random.default_rng(1))

    def exposed(ms):
        markers = tuple(
            replace(
                m,
                left=replace(m.left, exposure_s=np.full(m.left.frame.size, ms * 1e-3)),
                right=replace(m.right, exposure_s=np.full(m.right.frame.size, ms * 1e-3)),
            )
            for m in seen.markers
        )
        return replace(seen, markers=markers)

    known = MotionSettings(gain=lambda f, e, px: (0.95, 0.01))
    assert blur_gains(exposed(2), MotionSettings(), 25.0, 2.0) == (
        pytest.approx(np.ones((2, 2))),
        "",
    )
    assert "blur" in blur_gains(exposed(6), MotionSettings(), 22.0, 2.0)[1]
    gain, why = blur_gains(exposed(6), known, 22.0, 2.0)
    assert not why
    assert gain[0, 0] == 0.95
    assert "blur" in blur_gains(exposed(20), known, 22.0, 2.0)[1]


def test_branch_interval_and_step():
    low, high = keeps_branch(25.0, 30.0)
    assert (low, high) == (pytest.approx(1 - 30 / 80), pytest.approx(1 + 30 / 20))
    assert in_step(1 / 30 + 1e-3, 30.0)
    assert not in_step(0.010, 30.0)
