"""Motions against calculus: phases, orbits, free decay, laps, acceleration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.signals import GRAVITY_M_S2
from olivevib.simulation import (
    Body,
    Decay,
    Lap,
    Motion,
    Phases,
    Release,
    Sensor,
    Shake,
    Sway,
    marker_planar,
)
from olivevib.simulation.accelerometer import record
from olivevib.simulation.motion import acceleration_m_s2, smooth, smooth_integral

PHASES = Phases(start_s=1.0, rise_s=0.8, stop_s=6.0, fall_s=0.4)
ZERO = np.zeros(6)


def shake(f_hz=12.0, **more):
    cos = np.array([3.0, 0.5, -0.4, 0.001, 0.002, 0.0])
    sin = np.array([0.2, 1.0, 1.5, 0.0, -0.001, 0.003])
    return Shake(f_hz, PHASES, cos, sin, more.get("cos2", ZERO), more.get("sin2", ZERO))


def test_smooth_step_and_its_integral():
    u = np.linspace(-0.5, 2.0, 5001)
    slope = np.gradient(smooth_integral(u), u)
    assert np.abs(slope - smooth(u))[1:-1].max() < 1e-6
    assert smooth(np.array([-1.0, 0.0, 0.5, 1.0, 3.0])).tolist() == [0, 0, 0.5, 1, 1]


def test_speed_runs_from_rest_to_steady_and_back():
    t = np.linspace(0, 8, 80001)
    rate = np.gradient(PHASES.turns(t), t)
    steady = (t > PHASES.steady_s[0]) & (t < PHASES.steady_s[1])
    assert np.abs(rate[steady] - 1).max() < 1e-6
    assert np.abs(rate[(t < 1.0) | (t > 6.4)]).max() < 1e-9
    assert (np.diff(rate[(t > 1.0) & (t < 1.8)]) > -1e-9).all()


def test_shaking_is_the_stated_orbit_in_the_steady_phase_and_zero_outside():
    term = shake()
    t = 2.0 + np.arange(3600) / 1200  # whole periods
    angle = 2 * np.pi * 12.0 * t
    basis = np.column_stack([np.cos(angle), np.sin(angle)])
    fit = np.linalg.lstsq(basis, term(t), rcond=None)[0]
    assert np.allclose(np.hypot(*fit), term.amplitude, atol=1e-9)
    assert np.abs(basis @ fit - term(t)).max() < 1e-9
    assert not term(np.array([0.0, 0.99, 6.41, 8.0])).any()


def test_second_harmonic_is_there_only_when_asked_for():
    t = 2.0 + np.arange(3600) / 1200
    size = np.abs(np.fft.rfft(shake(cos2=np.full(6, 0.3))(t)[:, 0])) / 1800
    assert size[72] == pytest.approx(0.3, abs=1e-6)  # 24 Hz in 3 s
    assert np.abs(np.fft.rfft(shake()(t)[:, 0])[72]) / 1800 < 1e-9


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_motion_is_smooth_everywhere(seed):
    rng = np.random.default_rng(seed)
    terms = (
        shake(rng.uniform(5, 30)),
        Sway(rng.uniform(0.2, 1.5), rng.normal(0, 5, 6), rng.uniform(0, 6, 6)),
        Decay(rng.uniform(2, 6), rng.uniform(0.01, 0.1), 6.0, rng.normal(0, 5, 6)),
    )
    t = np.linspace(0, 9, 180001)
    speed = np.diff(Motion(terms)(t), axis=0) / (t[1] - t[0])
    assert np.abs(np.diff(speed, axis=0)).max() < 0.02 * np.abs(speed).max() + 0.05


def test_release_obeys_the_equation_of_free_decay():
    term = Release(3.0, 0.05, 1.0, np.array([20.0, -5.0, 8.0, 0.01, 0.0, -0.02]))
    assert np.allclose(term(np.array([0.0, 0.5, 1.0])), term.held)
    t, h, w = np.linspace(1.1, 3.0, 50), 1e-4, 2 * np.pi * 3.0
    x, before, after = term(t), term(t - h), term(t + h)
    rest = (after - 2 * x + before) / h**2 + 2 * 0.05 * w * (after - before) / (2 * h) + w**2 * x
    assert np.abs(rest).max() < 1e-3 * w**2 * 20
    assert term.damped_hz == pytest.approx(3.0 * np.sqrt(1 - 0.05**2))


def test_a_car_stays_on_its_oval_and_heads_along_it():
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]])
    lap = Lap(axes, np.array([300.0, 180.0]), 7.0, 0.2, 0.25)
    t = np.linspace(0, 14, 2001)
    moved = lap(t)
    inside = moved[:, :3] @ axes.T / [300.0, 180.0]
    assert np.abs(np.hypot(*inside.T) - 1).max() < 1e-12
    speed = (lap(t + 1e-5) - lap(t - 1e-5))[:, :3] @ axes.T
    heading = moved[:, 3:] @ np.cross(*axes)
    assert np.abs(np.sin(np.arctan2(speed[:, 1], speed[:, 0]) - heading)).max() < 1e-6
    assert (np.diff(heading) > 0).all()
    assert np.abs(lap(t + 7.0)[:, :3] - moved[:, :3]).max() < 1e-9  # closed


def test_acceleration_is_the_second_derivative():
    w = 2 * np.pi * 25.0

    def orbit(t):
        return np.column_stack(
            [3 * np.cos(w * t), 2 * np.sin(w * t), 0 * t, *np.zeros((3, t.size))]
        )

    t = np.linspace(0, 0.2, 400)
    found = acceleration_m_s2(orbit, t)
    assert np.abs(found + orbit(t)[:, :3] * w**2 / 1000).max() < 1e-4 * 3e-3 * w**2


def body_with(motion, R0=None):
    planar = marker_planar("aruco:DICT_4X4_50", 1, 70.0)
    return Body(planar, np.eye(3) if R0 is None else R0, np.array([0.0, 0.0, 1400.0]), motion)


def test_a_sensor_at_rest_reads_one_g_upwards_in_its_own_axes():
    down = np.array([0.0, 0.6, 0.8])
    sensor = Sensor(1, turn_rad=(0.1, 0.2, -0.4), noise_m_s2=0.0, bias_m_s2=(0, 0, 0))
    _, g = record(sensor, body_with(Motion()), down, 1.0, np.random.default_rng(0))
    assert np.abs(g - -(sensor.R_sensor_marker @ down)).max() <= sensor.step_g / 2 + 1e-12


def test_a_shaken_sensor_feels_motion_lever_turn_and_its_own_clock():
    term = shake()
    motion = Motion((term,))
    sensor = Sensor(
        1,
        clock_offset_s=3.0,
        drift_ppm=200.0,
        noise_m_s2=0.0,
        bias_m_s2=(0, 0, 0),
        lever_mm=(40, 0, 0),
    )
    body, down = body_with(motion), np.array([0.0, 1.0, 0.0])
    stamps, g = record(sensor, body, down, 5.0, np.random.default_rng(0))
    t = (stamps - 3.0) / (1 + 200e-6)
    assert t[0] == pytest.approx(-sensor.before_s)
    steady = (t > 2) & (t < 4.5)
    R, _ = body.pose(t)
    h = 2e-4
    at = [p + r @ [40, 0, 0] for r, p in (body.pose(t + d) for d in (-h, 0, h))]
    moved = (at[0] - 2 * at[1] + at[2]) / h**2 / 1000
    felt = np.stack(
        [
            sensor.R_sensor_marker @ r.T @ f
            for r, f in zip(R, moved - GRAVITY_M_S2 * down, strict=True)
        ]
    )
    assert np.abs(g * GRAVITY_M_S2 - felt)[steady].max() < 0.01


def test_phases_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match="out of order"):
        Phases(1.0, 2.0, 2.5, 0.5)
    with pytest.raises(ValueError, match="damping"):
        Motion((Decay(3.0, 1.2, 0.0, np.ones(6)),))(np.zeros(3))
