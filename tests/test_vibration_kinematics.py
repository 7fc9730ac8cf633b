"""Displacement, velocity, acceleration: exact where they can be, silent where they cannot."""

from __future__ import annotations

import numpy as np
import pytest

from olivevib.studies.vibration.records import Tone, displacement
from olivevib.vibration import LineSettings, SamplingFacts
from olivevib.vibration.figures import NO_LINE, figures
from olivevib.vibration.kinematics import (
    derive,
    derived_noise,
    line_motion,
    spectral_derivative,
    to_displacement,
)
from olivevib.vibration.line import fit_line

T = np.arange(300) / 30


@pytest.mark.parametrize("f_hz", [2.013, 5.0, 9.21, 13.49])
@pytest.mark.parametrize("lost", [0, 30])
def test_acceleration_of_a_tone_is_exact_to_the_ends(f_hz, lost):
    """Goal: 0.05 % up to 0.45 of the sampling rate; also with frames missing."""
    tone = Tone(f_hz, np.array([1.0, 0.5, 0.2]), np.array([0.0, 1.0, 2.0]))
    t = np.delete(T, np.random.default_rng(1).choice(300, lost, replace=False))
    samples = displacement(t, tone.at(t) + 4)
    facts = SamplingFacts(30.0, band_hz=(1.0, 14.0))
    found = fit_line(samples, facts, LineSettings())
    for n in (1, 2):
        wanted = tone.at(t, n)
        error = np.abs(derive(found, samples, n, 14.0) - wanted).max() / np.abs(wanted).max()
        assert error < 5e-4
        np.testing.assert_allclose(
            line_motion(found.line, n).amplitude,
            (2 * np.pi * f_hz) ** n * tone.amplitude * (1e-3 if n == 2 else 1),
            rtol=5e-4,
        )


def test_sway_under_the_line_keeps_its_own_velocity():
    tone = Tone(8.3, np.array([1.0, 0.5, 0.2]), np.zeros(3))
    slow = Tone(0.7, np.array([10.0, 5.0, 2.0]), np.ones(3))
    samples = displacement(T, tone.at(T) + slow.at(T))
    found = fit_line(samples, SamplingFacts(30.0, band_hz=(5.0, 14.0)), LineSettings())
    wanted = tone.at(T, 1) + slow.at(T, 1)
    assert np.abs(derive(found, samples, 1, 14.0) - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_uneven_times_without_a_line_make_nothing_up():
    t = np.delete(T, np.arange(100, 130))
    samples = displacement(t, np.random.default_rng(2).normal(size=(270, 3)))
    found = fit_line(samples, SamplingFacts(30.0, band_hz=(1.0, 14.0)), LineSettings())
    assert derive(found, samples, 2, 14.0) is None


def test_spectral_derivative_of_whole_periods_is_exact():
    tone = Tone(4.0, np.ones(3), np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(spectral_derivative(tone.at(T), 30.0, 2), tone.at(T, 2), atol=1e-8)


def test_noise_after_two_derivatives_is_as_predicted():
    rng = np.random.default_rng(3)
    x = 0.06 * rng.normal(size=(4000, 3))
    for top in (6.0, 15.0):
        got = spectral_derivative(x, 30.0, 2, top).std(axis=0)
        np.testing.assert_allclose(got, derived_noise(np.full(3, 0.06), 30.0, 2, top), rtol=0.1)
    # the page's figure: 0.06 mm gives 0.24 m/s2 at 30 frames/s
    assert derived_noise(np.array([0.06]), 30.0, 2, 15.0)[0] * 1e-3 == pytest.approx(0.24, abs=0.01)


def test_relative_variance_of_acceleration_counts_the_frequency_twice():
    rng = np.random.default_rng(4)
    tone = Tone(7.7, np.ones(3), np.zeros(3))
    facts = SamplingFacts(30.0, band_hz=(1.0, 14.0))
    got, sigma = [], []
    for _ in range(80):
        samples = displacement(T, tone.at(T) + 0.5 * rng.normal(size=(300, 3)))
        line = fit_line(samples, facts, LineSettings(harmonics=1, neighbours=0)).line
        a = line_motion(line, 2)
        got.append(a.amplitude)
        sigma.append(a.sigma)
    np.testing.assert_allclose(np.std(got, axis=0), np.mean(sigma, axis=0), rtol=0.25)


@pytest.mark.parametrize("rate", [500.0, 2000.0, 5000.0])
def test_displacement_from_acceleration_neither_drifts_nor_shrinks(rate):
    """Goal: 0.01 % in amplitude and 0.06 mm of drift with a bias of 0.5 m/s2."""
    t = np.arange(round(20 * rate)) / rate
    omega = 2 * np.pi * 25.0
    a = 99.0 * np.sin(omega * t)[:, None] * np.ones(3) + 0.5
    x = to_displacement(a, rate, 5.0)
    middle = (t > 0.5) & (t < 19.5)
    columns = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=1)[middle]
    coefficients = np.linalg.lstsq(columns, x[middle], rcond=None)[0]
    wanted = 99e3 / omega**2
    assert np.abs(np.hypot(*coefficients) / wanted - 1).max() < 1e-4
    assert np.abs(x[middle] - columns @ coefficients).max() < 0.06


def test_finer_output_lies_on_the_same_curve():
    t = np.arange(2000) / 200
    a = np.sin(2 * np.pi * 20 * t)[:, None]
    coarse, fine = to_displacement(a, 200.0, 3.0), to_displacement(a, 200.0, 3.0, finer=5)
    np.testing.assert_allclose(fine[::5], coarse, atol=1e-9)


def test_figures_of_a_sine():
    t = np.arange(3000) / 300
    x = np.stack([3 * np.sin(2 * np.pi * 5 * t), 0 * t, 0 * t], axis=1) + 7
    f = figures(x, "acceleration", "m/s2", 10.0, np.zeros(3), NO_LINE)
    assert f.rms[0] == pytest.approx(3 / np.sqrt(2), rel=1e-3)
    assert f.crest[0] == pytest.approx(np.sqrt(2), rel=1e-3)
    assert f.kurtosis[0] == pytest.approx(1.5, rel=1e-3)
    assert f.peak_to_peak[0] == pytest.approx(6.0, rel=1e-3)
    assert f.extent == pytest.approx(6.0, rel=1e-3)
    assert np.isnan(f.crest[1])
    # straight shake of peak A: mean resultant 63.7 %, RMS 70.7 % of A
    assert f.resultant_mean == pytest.approx(3 * 2 / np.pi, rel=1e-3)
    assert f.resultant_rms == pytest.approx(3 / np.sqrt(2), rel=1e-3)
    assert f.energy_m2_s3 == pytest.approx(4.5 * 10, rel=1e-3)
    assert f.dose_m_s175 == pytest.approx((81 * 3 / 8 * 10) ** 0.25, rel=1e-3)
    assert f.class_percent[0] == 100.0


def test_figures_of_a_circle():
    t = np.arange(3000) / 300
    turn = 2 * np.pi * 5 * t
    x = 150 * np.stack([np.cos(turn), np.sin(turn), 0 * t], axis=1)
    f = figures(x, "acceleration", "m/s2", 10.0, np.zeros(3), NO_LINE)
    assert f.resultant_mean == pytest.approx(150, rel=1e-6)
    assert f.class_percent[2] == 100.0  # between 100 and 200 m/s2
