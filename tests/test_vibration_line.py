"""The dominant line: bound, coverage, neighbours, harmonics, gaps, sway, silence."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.studies.vibration.records import (
    Tone,
    displacement,
    frequency_bound,
    noise_for,
    random_tone,
)
from olivevib.vibration import LineSettings, LineStatus, SamplingFacts, dominant_line
from olivevib.vibration.line import fit_line
from olivevib.vibration.sinefit import Tones, fit_sines
from olivevib.vibration.sway import sway_columns

LOW = SamplingFacts(30.0, stamps_true=True, band_hz=(1.5, 14.0))
PLAIN = LineSettings(harmonics=1, neighbours=0)


def even(seconds=10.0, rate=30.0):
    return np.arange(round(seconds * rate)) / rate


def test_clean_tones_are_exact():
    rng = np.random.default_rng(1)
    for _ in range(20):
        tone, t = random_tone(rng), even()
        line = dominant_line(displacement(t, 3 + tone.at(t)), LOW)
        assert line.status is LineStatus.DIRECT
        assert abs(line.f_hz - tone.f_hz) < 1e-9
        np.testing.assert_allclose(line.amplitude, tone.amplitude, rtol=1e-7)
        back = line.amplitude * np.cos(
            2 * np.pi * line.f_hz * (t[:, None] - line.t_ref_s) + line.phase_rad
        )
        np.testing.assert_allclose(back, tone.at(t), atol=1e-7)


@pytest.mark.parametrize("decibels", [40, 20])
def test_errors_reach_the_bound_and_intervals_cover(decibels):
    rng = np.random.default_rng(decibels)
    t, ratios, covered, amplitudes = even(), [], [], []
    for _ in range(150):
        tone = random_tone(rng)
        s = noise_for(tone, decibels)
        found = fit_line(displacement(t, tone.at(t) + s * rng.normal(size=(300, 3))), LOW, PLAIN)
        error = found.line.f_hz - tone.f_hz
        ratios.append(error / frequency_bound(tone, t, s))
        covered.append(abs(error) <= found.fit.student() * found.line.f_sigma_hz)
        amplitudes += list((found.line.amplitude - tone.amplitude) / found.line.amplitude_sigma)
    # 150 trials know a standard deviation to 6 % and a coverage to 1.8 %
    assert np.sqrt(np.mean(np.square(ratios))) < 1.05 + 0.12
    assert abs(np.mean(ratios)) < 0.25
    assert 0.90 <= np.mean(covered) <= 0.99
    assert np.std(amplitudes) == pytest.approx(1.0, abs=0.12)


def test_axes_are_weighted_by_their_own_noise():
    """Depth is seven times noisier than the picture plane: it must not spoil the frequency."""
    rng = np.random.default_rng(8)
    t, noise = even(), np.array([0.05, 0.05, 0.35])
    tone = Tone(7.31, np.array([1.0, 0.5, 0.5]), np.array([0.0, 1.0, 2.0]))
    errors, sigmas = [], []
    for _ in range(60):
        x = tone.at(t) + noise * rng.normal(size=(300, 3))
        line = dominant_line(displacement(t, x), LOW, PLAIN)
        errors.append(line.f_hz - tone.f_hz)
        sigmas.append(line.f_sigma_hz)
    power = np.sum((tone.amplitude / noise) ** 2)
    bound = np.sqrt(2 / (power * np.sum((t - t.mean()) ** 2))) / (2 * np.pi)
    assert np.std(errors) < 1.25 * bound
    assert np.mean(sigmas) == pytest.approx(bound, rel=0.1)


def test_two_close_tones_are_told_apart():
    rng = np.random.default_rng(2)
    for _ in range(12):
        a = random_tone(rng, 3, 11)
        b = Tone(a.f_hz + 0.15 * rng.choice([-1, 1]), a.amplitude / 10, rng.uniform(0, 6, 3))
        t = even()
        x = a.at(t) + b.at(t) + noise_for(a, 20) * rng.normal(size=(300, 3))
        found = fit_line(displacement(t, x), LOW, LineSettings(harmonics=1))
        assert abs(found.fit.f_hz[0] - a.f_hz) < 0.01
        assert np.abs(found.fit.f_hz[1:] - b.f_hz).min() < 0.01


def test_lost_frames_and_bursts_cost_only_their_information():
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(80):
        tone, t = random_tone(rng), even()
        gap = rng.integers(0, 210)
        keep = rng.random(300) > 0.1
        keep[gap : gap + 90] = False
        t = t[keep] + 1e-3 * rng.normal(size=keep.sum())
        s = noise_for(tone, 20)
        line = dominant_line(
            displacement(t, tone.at(t) + s * rng.normal(size=(t.size, 3))), LOW, PLAIN
        )
        ratios.append((line.f_hz - tone.f_hz) / frequency_bound(tone, t, s))
    assert np.sqrt(np.mean(np.square(ratios))) < 1.1 + 0.18  # 80 trials: 8 % a sigma


def test_harmonics_above_half_the_rate_are_read_where_they_fold():
    t = even()
    tone = Tone(11.3, np.array([2.0, 1.0, 0.5]), np.zeros(3))
    second = Tone(22.6, np.array([0.3, 0.0, 0.1]), np.ones(3))
    line = dominant_line(displacement(t, tone.at(t) + second.at(t)), LOW)
    assert line.f_hz == pytest.approx(11.3, abs=1e-6)
    np.testing.assert_allclose(line.harmonics[0], second.amplitude, atol=1e-6)


def test_a_harmonic_that_falls_on_the_line_itself_is_not_made_up():
    t = even()
    line = dominant_line(displacement(t, Tone(10.0, np.ones(3), np.zeros(3)).at(t)), LOW)
    assert np.isnan(line.harmonics[0]).all()


def test_sway_is_fitted_along():
    rng = np.random.default_rng(4)
    t = even()
    facts = SamplingFacts(30.0, stamps_true=True, band_hz=(5, 14))
    errors = []
    for _ in range(30):
        tone = random_tone(rng, 6, 13)
        sway = 20 * np.sin(2 * np.pi * rng.uniform(0.3, 1.5) * t + rng.uniform(0, 6))[:, None]
        x = tone.at(t) + sway + 0.05 * rng.normal(size=(300, 3))
        line = dominant_line(displacement(t, x), facts)
        errors.append((line.f_hz - tone.f_hz) / line.f_sigma_hz)
        np.testing.assert_allclose(line.amplitude, tone.amplitude, atol=0.03)
    assert np.std(errors) == pytest.approx(1.0, abs=0.4)


def test_straight_motion_is_not_read_at_twice_its_frequency():
    """The resultant of a straight motion has its first line at 2f; the axes have it at f."""
    t = even()
    tone = Tone(6.2, np.array([3.0, 2.0, 1.0]), np.zeros(3))
    assert dominant_line(displacement(t, tone.at(t)), LOW).f_hz == pytest.approx(6.2, abs=1e-6)


def test_white_noise_yields_a_line_no_more_often_than_promised():
    rng = np.random.default_rng(5)
    t, noise = even(), np.array([0.05, 0.05, 0.4])
    settings = LineSettings(false_alarm=0.05, harmonics=1, neighbours=0)
    alarms = sum(
        dominant_line(displacement(t, noise * rng.normal(size=(300, 3))), LOW, settings).status
        is not LineStatus.NONE
        for _ in range(120)
    )
    assert alarms <= 14  # 6 expected, sigma 2.4
    quiet = dominant_line(displacement(t, noise * rng.normal(size=(300, 3))), LOW)
    assert quiet.status is LineStatus.NONE
    assert np.isnan(quiet.f_hz) and np.isnan(quiet.amplitude).all()


def test_drifting_motion_is_no_line():
    rng = np.random.default_rng(6)
    t = even()
    walk = np.cumsum(rng.normal(size=(300, 3)), axis=0)
    assert dominant_line(displacement(t, walk), LOW).status is LineStatus.NONE


def test_a_machine_that_changes_speed_is_a_chirp():
    t = even(8.0)
    facts = SamplingFacts(120.0, stamps_true=True, band_hz=(5, 45))
    t = np.arange(960) / 120
    turn = 2 * np.pi * (10 * t + 1.2 * t**2)
    x = 2 * np.stack([np.cos(turn), np.sin(turn), 0.2 * np.cos(turn)], axis=1)
    line = dominant_line(displacement(t, x), facts)
    assert line.status is LineStatus.CHIRP
    assert np.isnan(line.f_hz)
    assert "speed" in line.reasons[0].lower()


def test_too_few_samples_say_so():
    t = even(0.3)
    line = dominant_line(displacement(t, np.zeros((9, 3))), LOW)
    assert line.status is LineStatus.NONE
    assert "9 samples" in line.reasons[0]


def test_a_motionless_marker_has_no_line():
    t = even()
    assert dominant_line(displacement(t, np.ones((300, 3))), LOW).status is LineStatus.NONE


def test_coloured_noise_widens_the_intervals():
    rng = np.random.default_rng(9)
    t, z = even(20.0), []
    for _ in range(60):
        tone = random_tone(rng, 5, 7)
        noise = rng.normal(size=(600, 3))
        for k in range(1, 600):
            noise[k] += 0.9 * noise[k - 1]  # red: far more noise at 6 Hz than the mean level
        turn = np.cos(2 * np.pi * 6 * t)[:, None]
        x = tone.at(t) + 0.05 * turn * noise
        line = dominant_line(displacement(t, x), LOW, PLAIN)
        z.append((line.f_hz - tone.f_hz) / line.f_sigma_hz)
    assert np.std(z) < 1.5  # 2.2 without the local density


def test_derivatives_of_the_fit_agree_with_differences():
    rng = np.random.default_rng(7)
    t = np.sort(rng.uniform(0, 10, 200))
    tone = Tone(4.3, np.ones(3), np.zeros(3))
    fit = fit_sines(t, tone.at(t), np.array([4.28]), Tones((0, 0), (1, 2)))
    h = 1e-5
    numeric = (fit.motion(t + h) - fit.motion(t - h)) / (2 * h)
    np.testing.assert_allclose(fit.motion(t, 1), numeric, rtol=1e-6, atol=1e-5)


def test_a_joint_fit_refuses_more_unknowns_than_samples():
    with pytest.raises(ValueError, match="unknowns"):
        fit_sines(np.arange(4.0), np.zeros((4, 3)), np.array([0.2]))


def test_sway_columns_are_orthonormal_and_span_slow_motion():
    t = np.sort(np.random.default_rng(1).uniform(0, 10, 300))
    columns = sway_columns(t, 2.5)
    np.testing.assert_allclose(columns.T @ columns, np.eye(columns.shape[1]), atol=1e-10)
    slow = np.sin(2 * np.pi * 0.7 * t)
    assert np.abs(slow - columns @ (columns.T @ slow)).max() < 1e-3
    assert sway_columns(t, 0.0) is None
    assert sway_columns(t[:20], 2.5) is None


def test_dense_records_are_averaged_in_blocks_without_a_trace():
    """A sensor of 2 kHz: block means make it fast, their gain and noise are given back."""
    rng = np.random.default_rng(10)
    facts = SamplingFacts(2000.0, stamps_true=True, band_hz=(5.0, 45.0))
    tone = Tone(24.37, np.array([99.0, 50.0, 10.0]), np.array([0.0, 1.0, 2.0]))
    t = np.arange(12_000) / 2000
    clean = fit_line(displacement(t, tone.at(t)), facts, LineSettings(sway=False))
    assert abs(clean.line.f_hz - tone.f_hz) < 1e-9
    np.testing.assert_allclose(clean.line.amplitude, tone.amplitude, rtol=1e-8)
    x = tone.at(t) + 2.0 * rng.normal(size=(t.size, 3))
    noisy = fit_line(displacement(t, x), facts, LineSettings(sway=False))
    np.testing.assert_allclose(noisy.fit.noise, 2.0, rtol=0.06)
    np.testing.assert_allclose(noisy.line.amplitude_sigma, 2.0 * np.sqrt(2 / t.size), rtol=0.1)
    assert noisy.line.f_sigma_hz == pytest.approx(frequency_bound(tone, t, 2.0), rel=0.1)
