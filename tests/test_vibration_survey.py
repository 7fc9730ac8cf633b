"""Rotation, points of a body, relative motion, transmissibility on true times, and the survey."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from olivevib.studies.vibration.records import acceleration, displacement
from olivevib.vibration import (
    Attitude,
    LineSettings,
    Phase,
    SamplingFacts,
    analyse,
    analyse_sensor,
    marker_response,
    point_motion,
    relative_motion,
    survey,
)
from olivevib.vibration.body import turning

FACTS = SamplingFacts(30.0, stamps_true=True, band_hz=(2.0, 12.0))
T = np.arange(300) / 30
F = 7.3
WHOLE = Phase("steady", 0.0, 10.0)


def rocking(t, mrad=(4.0, 0.0, 1.0), noise=0.0, rng=None):
    """Rotation vectors of a marker that rocks about a mean attitude of 40 degrees."""
    small = 1e-3 * np.cos(2 * np.pi * F * t)[:, None] * np.array(mrad)
    if noise:
        small = small + noise * rng.normal(size=small.shape)
    mean = Rotation.from_rotvec([0.0, 0.7, 0.1])
    return (Rotation.from_rotvec(small) * mean).as_rotvec()


def wave(t, amplitude, phase=0.0, f=F):
    return np.outer(np.cos(2 * np.pi * f * t + phase), amplitude)


def test_a_rocking_marker_turns_by_what_it_was_given():
    rng = np.random.default_rng(1)
    found = turning(Attitude(T, rocking(T, noise=3e-4, rng=rng)), WHOLE, FACTS)
    line = found.line
    assert abs(line.f_hz - F) < 4 * line.f_sigma_hz
    assert (np.abs(line.amplitude - [4.0, 0.0, 1.0]) < 4 * line.amplitude_sigma + 0.05).all()
    assert found.acceleration_rad_s2[0] == pytest.approx((2 * np.pi * F) ** 2 * 4e-3, rel=0.02)


def test_an_attitude_that_is_not_known_gives_no_turning():
    assert turning(Attitude(T, np.full((300, 3), np.nan)), WHOLE, FACTS) is None


def test_a_point_of_the_body_moves_with_centre_and_lever():
    """A lever of 100 mm in marker axes, at 40 degrees, against R p worked out one by one."""
    centre = displacement(T, wave(T, [3.0, 1.0, 0.5]))
    vectors = rocking(T)
    got = point_motion(centre, Attitude(T, vectors), np.array([20.0, 100.0, -30.0]))
    arm = np.array([Rotation.from_rotvec(v).as_matrix() @ [20.0, 100.0, -30.0] for v in vectors])
    np.testing.assert_allclose(got.values, centre.values + arm - arm.mean(axis=0), atol=1e-12)
    assert point_motion(centre, Attitude(T, vectors), np.zeros(3)) is centre
    with pytest.raises(ValueError, match="different times"):
        point_motion(centre, Attitude(T + 0.01, vectors), np.array([1.0, 0, 0]))


def test_relative_motion_of_markers_seen_at_different_rows_is_exact():
    """The other marker is seen 1 ms later: plain subtraction would leave 4.6 % of its motion."""
    later = T + 1e-3
    first = displacement(T, wave(T, [3.0, 1.0, 0.5]) + wave(T, [0.5, 0.2, 0.1], 0.8))
    other = displacement(later, wave(later, [3.0, 1.0, 0.5]))
    left = relative_motion(first, other, FACTS, LineSettings())
    np.testing.assert_allclose(left.values, wave(T, [0.5, 0.2, 0.1], 0.8), atol=0.005)


def test_relative_motion_leaves_out_what_the_other_marker_was_not_seen_in():
    first, seen = displacement(T, wave(T, [1.0, 1, 1])), np.ones(300, bool)
    seen[100:150] = False
    other = displacement(T[seen], wave(T[seen], [1.0, 1, 1]))
    left = relative_motion(first, other, FACTS, LineSettings())
    assert left.t_s.size == 250
    assert np.abs(left.values).max() < 1e-6


def test_response_of_a_marker_seen_at_other_rows_and_with_gaps():
    """Noise through a gain of 1.5 and 2 ms of delay: gain and phase come out on true times."""
    rng = np.random.default_rng(3)
    t = np.arange(3600) / 120
    f, phase = np.arange(1, 20, 0.05), rng.uniform(0, 6, (380, 3))

    def shake(at):
        turn = 2 * np.pi * f * at[:, None]
        return 0.1 * np.stack([np.cos(turn + phase[:, k]).sum(axis=1) for k in range(3)], axis=1)

    seen = rng.random(t.size) > 0.02
    rows = t + 3e-3
    x = displacement(t, shake(t))
    y = displacement(rows[seen], 1.5 * shake(rows[seen] - 2e-3))
    found = marker_response(x, y, 2.0)
    band = (found.f_hz > 3) & (found.f_hz < 17)
    assert found.segments >= 14
    assert np.median(found.coherence[band]) > 0.95
    assert np.median(np.abs(found.h1[band])) == pytest.approx(1.5, rel=0.03)
    delay = np.angle(found.h1[band]) / (-2 * np.pi * found.f_hz[band][:, None])
    assert np.median(delay) == pytest.approx(2e-3, abs=2e-4)


def test_noise_alone_has_the_coherence_of_chance():
    rng = np.random.default_rng(4)
    x, y = (displacement(T, rng.normal(size=(300, 3))) for _ in range(2))
    found = marker_response(x, y, 1.0)
    assert np.median(found.coherence) < 3 / found.segments


def test_the_survey_of_two_markers_finds_ratio_phase_shape_and_decay():
    rng = np.random.default_rng(5)
    t = np.arange(420) / 30
    since = np.maximum(t - 10, 0)
    shaking = (t <= 10)[:, None]
    fading = (np.exp(-0.05 * 2 * np.pi * 4 * since) * np.sin(2 * np.pi * 4 * since))[:, None]
    one = shaking * wave(t, [2.0, 1.0, 0.1]) + fading * [2.0, 0, 0]
    two = shaking * wave(t, [4.0, 2.0, 0.2], 0.5) + fading * [3.0, 1.0, 0]
    motion = {
        3: displacement(t, one + 0.01 * rng.normal(size=one.shape)),
        7: displacement(t, two + 0.01 * rng.normal(size=two.shape)),
    }
    phases = [Phase("steady", 0.0, 9.9), Phase("decay", 10.1, 14.0)]
    result = analyse(motion, FACTS, phases=phases)
    lines = {r.id: r.line for r in result.table if r.phase == "steady"}
    found = survey(motion, {}, lines, phases, phases[0], FACTS)
    ratio = found.transmissions[0].ratio
    assert (found.transmissions[0].response, found.transmissions[0].reference) == (7, 3)
    assert ratio.ratio_total == pytest.approx(2.0, abs=4 * ratio.ratio_total_sigma)
    assert np.radians(ratio.phase_deg[0]) == pytest.approx(0.5, abs=0.02)
    assert (found.transmissions[0].coherence > 0.95)[:2].all()
    assert found.deflection.ids == (3, 7)
    assert abs(found.deflection.shape[1, 0]) == pytest.approx(4.0, rel=0.01)
    for marker in found.markers:
        assert marker.decay_f_hz == pytest.approx(4.0, abs=4 * marker.decay_f_sigma_hz + 0.01)
        assert marker.decay_damping == pytest.approx(0.05, abs=0.006)
        assert marker.turning is None
        middle = (marker.ridge_t_s > 2) & (marker.ridge_t_s < 8)
        np.testing.assert_allclose(marker.ridge_true_hz[middle], F, atol=0.1)


def test_figures_of_a_sensors_own_record_on_one_transform():
    """99 m/s2 at 25 Hz with gravity: 630 mm/s, 4.01 mm; what the ends disturb is left out."""
    t = np.arange(20_000) / 1000
    a = 99 * np.cos(2 * np.pi * 25 * t[:, None] + np.arange(3)) + [0.0, 0.0, 9.8]
    found = analyse_sensor(acceleration(t, a))
    omega = 2 * np.pi * 25
    assert found.line.f_hz == pytest.approx(25, abs=1e-6)
    np.testing.assert_allclose(found.velocity.line_amplitude, 99e3 / omega, rtol=1e-4)
    np.testing.assert_allclose(found.displacement.peak, 99e3 / omega**2, rtol=2e-3)
    np.testing.assert_allclose(found.acceleration.rms, 99 / np.sqrt(2), rtol=1e-3)
    assert found.acceleration.dose_m_s175 > 0
    variance = found.psd.sum(axis=0) * found.f_hz[1]
    np.testing.assert_allclose(variance, 99**2 / 2, rtol=1e-3)
