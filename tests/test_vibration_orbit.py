"""Orbits: axes, sense, straight motion within noise, precession."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.studies.vibration.records import Tone, displacement, rotation
from olivevib.vibration import LineSettings, SamplingFacts, dominant_line
from olivevib.vibration.orbit import orbit, precession

T = np.arange(300) / 30
FACTS = SamplingFacts(30.0, band_hz=(2.0, 14.0))
PLAIN = LineSettings(harmonics=1, neighbours=0)


def line_of(path, settings=PLAIN):
    return dominant_line(displacement(T, path), FACTS, settings)


@pytest.mark.parametrize("sense", [1, -1])
def test_an_ellipse_in_space_is_found_with_its_sense(sense):
    rng = np.random.default_rng(1)
    for _ in range(5):
        R, turn = rotation(rng), 2 * np.pi * 7.3 * T + rng.uniform(0, 6)
        flat = np.stack([3 * np.cos(turn), sense * 1.2 * np.sin(turn), 0 * T], axis=1)
        found = orbit(line_of(flat @ R.T))
        assert found.major == pytest.approx(3.0, abs=1e-6)
        assert found.minor == pytest.approx(1.2, abs=1e-6)
        assert abs(found.major_axis @ R[:, 0]) == pytest.approx(1.0, abs=1e-6)
        np.testing.assert_allclose(found.normal, sense * R[:, 2], atol=1e-6)
        assert not found.straight
        assert not found.folded


def test_noise_gives_straight_motion_the_minor_axis_that_is_predicted():
    rng = np.random.default_rng(2)
    tone = Tone(6.1, np.array([3.0, 2.0, 1.0]), np.zeros(3))
    found = [orbit(line_of(tone.at(T) + 0.2 * rng.normal(size=(300, 3)))) for _ in range(60)]
    minor = np.mean([o.minor for o in found])
    assert minor == pytest.approx(1.24 * 0.2 * np.sqrt(2 / 300), rel=0.15)
    assert minor == pytest.approx(np.mean([o.minor_noise for o in found]), rel=0.15)
    assert all(o.straight for o in found)
    assert np.isnan(found[0].normal).all()


def test_without_a_line_there_is_no_orbit():
    rng = np.random.default_rng(3)
    assert np.isnan(orbit(line_of(rng.normal(size=(300, 3)))).major)


def test_an_aliased_orbit_says_that_its_sense_is_open():
    facts = SamplingFacts(30.0)
    tone = Tone(25.2, np.array([3.0, 1.0, 0.5]), np.array([0.0, 1.5, 0.3]))
    assert orbit(dominant_line(displacement(T, tone.at(T)), facts)).folded


def test_precession_is_the_turning_of_the_long_axis():
    rng = np.random.default_rng(4)
    turn, lean = 2 * np.pi * 9.3 * T, np.radians(12.0) * T
    main, side = 3 * np.cos(turn), 0.5 * np.sin(turn)
    x = np.stack(
        [main * np.cos(lean) - side * np.sin(lean), main * np.sin(lean) + side * np.cos(lean)],
        axis=1,
    )
    path = np.hstack([x, 0.1 * rng.normal(size=(300, 1))]) + 0.02 * rng.normal(size=(300, 3))
    found = precession(displacement(T, path), line_of(path))
    assert found.rate_deg_s == pytest.approx(12.0, abs=max(0.3, 4 * found.rate_sigma_deg_s))
    assert found.axes == ("x", "y")


def test_precession_needs_enough_samples():
    path = Tone(6.1, np.ones(3), np.zeros(3)).at(T)
    line = line_of(path)
    assert precession(displacement(T[:10], path[:10]), line) is None
    assert precession(displacement(T[::5], path[::5]), line) is None
