"""Phases of a trial, found from the camera alone and from an accelerometer."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from olivevib.studies.vibration.records import (
    Logger,
    Shaker,
    camera,
    displacement,
    rotation,
    sensor,
    truth,
)
from olivevib.vibration import Phase, find_phases, find_sensor_phases


def trials(count, **changes):
    """Camera record, sensor record and true limits of shakers of 20-28 Hz."""
    for seed in range(count):
        rng = np.random.default_rng(seed)
        shaker = Shaker(
            f_hz=rng.uniform(20, 27),
            start_up_s=rng.uniform(0.6, 1.2),
            precession_hz=0.3,
            decay_hz=rng.uniform(3.2, 6),
            **changes,
        )
        t, path = truth(shaker, rng, rate_hz=5000.0)
        times = np.arange(0, shaker.limits[-1], 1 / 30)
        seen = camera(t, path, rng, times, 0.06, 0.004, shaker)
        logger = Logger(rate_hz=1000.0, offset_s=0.0, drift=0.0)
        yield seen, sensor(t, path, rng, logger, rotation(rng)), shaker.limits


def named(phases, name):
    return next(p for p in phases if p.name == name)


def test_sensor_finds_the_steady_phase_to_30_ms():
    errors = []
    for _, accelerometer, limits in trials(12):
        steady = named(find_sensor_phases(accelerometer), "steady")
        errors += [steady.start_s - limits[1], steady.end_s - limits[2]]
    assert np.percentile(np.abs(errors), 90) < 0.030
    assert abs(np.median(errors)) < 0.010


def test_camera_finds_onset_and_steady_phase_although_the_line_is_aliased():
    onset, steady, decays = [], [], []
    for seen, _, limits in trials(8):
        phases = find_phases({1: seen}, 2.5)
        assert [p.name for p in phases][:3] == ["rest", "start-up", "steady"]
        visible = limits[0] + np.sqrt(0.05) * (limits[1] - limits[0])  # 5 % of the amplitude
        onset.append(phases[1].start_s - visible)
        middle = named(phases, "steady")
        steady += [middle.start_s - limits[1], middle.end_s - limits[2]]
        decays += [p.start_s - limits[3] for p in phases if p.name == "decay"]
    assert np.median(np.abs(onset)) < 0.11
    assert np.median(np.abs(steady)) < 0.2
    assert np.percentile(np.abs(steady), 90) < 0.6
    assert len(decays) >= 6
    assert np.median(np.abs(decays)) < 0.3


def test_phases_follow_one_another_without_holes():
    for seen, accelerometer, _ in trials(3):
        for phases in (find_phases({1: seen}, 2.5), find_sensor_phases(accelerometer)):
            for before, after in itertools.pairwise(phases):
                assert before.end_s == after.start_s


def test_a_record_that_shakes_throughout_is_one_steady_phase():
    rng = np.random.default_rng(1)
    t = np.arange(90) / 30
    turn = 2 * np.pi * 11.7 * t
    x = 2 * np.stack([np.cos(turn), np.sin(turn), 0 * t], axis=1)
    phases = find_phases({1: displacement(t, x + 0.05 * rng.normal(size=x.shape))}, 2.5)
    assert [p.name for p in phases] == ["steady"]
    assert phases[0].start_s == t[0]
    assert phases[0].end_s == t[-1]


def test_several_markers_share_their_phases_and_gaps_do_no_harm():
    rng = np.random.default_rng(2)
    seen, _, limits = next(trials(1))
    motion = {}
    for marker in range(3):
        keep = rng.random(seen.t_s.size) > 0.15
        motion[marker] = displacement(seen.t_s[keep] + 0.004 * marker, seen.values[keep])
    steady = named(find_phases(motion, 2.5), "steady")
    assert abs(steady.start_s - limits[1]) < 0.5
    assert abs(steady.end_s - limits[2]) < 0.6


def test_no_motion_and_no_markers():
    assert find_phases({}, 2.5) == ()
    assert find_phases({1: displacement([], np.empty((0, 3)))}, 2.5) == ()


def test_impossible_phases_are_refused():
    with pytest.raises(ValueError, match="no phase"):
        Phase("begin", 0, 1)
    with pytest.raises(ValueError, match="ends"):
        Phase("steady", 2, 1)
