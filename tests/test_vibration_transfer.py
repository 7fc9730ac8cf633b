"""Transmissibility, frequency response, coherence: known systems, predicted scatter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from olivevib.studies.vibration.records import Tone, displacement
from olivevib.vibration import LineSettings, SamplingFacts, dominant_line
from olivevib.vibration.transfer import frequency_response, line_ratio

T = np.arange(300) / 30
FACTS = SamplingFacts(30.0, band_hz=(2.0, 14.0))
PLAIN = LineSettings(harmonics=1, neighbours=0)


def test_ratio_and_phase_of_a_line_are_exact():
    trunk = Tone(7.7, np.array([2.0, 1.0, 0.5]), np.array([0.1, 0.2, 0.3]))
    branch = Tone(7.7, np.array([2.8, 0.7, 1.0]), np.array([1.1, 0.2, -0.7]))
    t = T + 0.004  # another marker is seen at other times
    lines = [dominant_line(displacement(x, y.at(x)), FACTS, PLAIN) for x, y in
             ((t, branch), (T, trunk))]  # fmt: skip
    found = line_ratio(*lines)
    np.testing.assert_allclose(found.ratio, [1.4, 0.7, 2.0], rtol=1e-6)
    np.testing.assert_allclose(found.phase_deg, np.degrees([1.0, 0.0, -1.0]), atol=1e-4)
    total = np.linalg.norm(branch.amplitude) / np.linalg.norm(trunk.amplitude)
    assert found.ratio_total == pytest.approx(total, rel=1e-6)
    assert found.decibels == pytest.approx(20 * np.log10(total), abs=1e-5)


def test_scatter_of_the_ratio_is_as_predicted():
    rng = np.random.default_rng(1)
    trunk, branch = (Tone(7.7, a * np.ones(3), np.zeros(3)) for a in (2.0, 3.0))
    got, sigma, phase, phase_sigma = [], [], [], []
    for _ in range(80):
        lines = [
            dominant_line(displacement(T, x.at(T) + 0.3 * rng.normal(size=(300, 3))), FACTS, PLAIN)
            for x in (branch, trunk)
        ]
        found = line_ratio(*lines)
        if found is None:  # frequencies of two noisy fits may differ by more than three sigma
            continue
        got.append(found.ratio)
        sigma.append(found.ratio_sigma)
        phase.append(found.phase_deg)
        phase_sigma.append(found.phase_sigma_deg)
    assert len(got) > 75
    np.testing.assert_allclose(np.std(got, axis=0), np.mean(sigma, axis=0), rtol=0.3)
    assert np.std(phase) < 1.5 * np.mean(phase_sigma)


def test_markers_with_different_lines_have_no_ratio():
    a, b = (
        dominant_line(displacement(T, Tone(f, np.ones(3), np.zeros(3)).at(T)), FACTS, PLAIN)
        for f in (6.0, 7.0)
    )
    assert line_ratio(a, b) is None


def test_response_of_a_known_filter_and_its_scatter():
    rng = np.random.default_rng(2)
    b, a = signal.butter(2, 0.2)
    x = rng.normal(size=40_000)
    y = signal.lfilter(b, a, x) + 0.1 * rng.normal(size=x.size)
    found = frequency_response(x, y, 1000.0, 512)
    _, wanted = signal.freqz(b, a, worN=found.f_hz, fs=1000.0)
    band = (found.f_hz > 10) & (found.f_hz < 120)
    error = np.abs(found.h1[band] - wanted[band]) / np.abs(wanted[band])
    assert np.sqrt(np.mean(error**2)) < 2.5 * np.median(found.relative_sigma[band])
    assert np.median(found.coherence[band]) > 0.95
    _, g2 = signal.coherence(x, y, 1000.0, nperseg=512)
    np.testing.assert_allclose(found.coherence[1:-1], g2[1:-1], atol=1e-6)


def test_noise_alone_has_the_coherence_of_its_segments():
    rng = np.random.default_rng(3)
    found = frequency_response(*rng.normal(size=(2, 16 * 256)), 1000.0, 256, overlap=0.0)
    assert found.segments == 16
    assert found.coherence.mean() == pytest.approx(1 / 16, rel=0.3)


def test_h2_is_right_where_the_reference_is_noisy():
    rng = np.random.default_rng(4)
    x = rng.normal(size=60_000)
    found = frequency_response(x + 0.7 * rng.normal(size=x.size), 3 * x, 1000.0, 256)
    middle = slice(5, -5)
    assert np.median(np.abs(found.h2[middle])) == pytest.approx(3.0, rel=0.03)
    assert np.median(np.abs(found.h1[middle])) < 2.5


def test_a_record_of_one_segment_is_refused():
    with pytest.raises(ValueError, match="segments"):
        frequency_response(np.zeros(100), np.zeros(100), 1.0, 80)
