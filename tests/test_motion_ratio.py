"""Ratios of fitted motions: their sigma against draws, and what stands in survey and figure."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from test_motion_results import F_HZ, fit, marker

from olivevib.pipeline.fitted_camera import without_cameras
from olivevib.pipeline.fitted_response import with_fitted_responses
from olivevib.reconstruction.motion import MarkerMotion, fitted_ratio
from olivevib.report import figures
from olivevib.vibration import LineRatio, MarkerResponse, Survey, Transmission

TIMES = np.array([1e-3, 2e-5, 1e-6, 3e-8, 0.0])  # sigmas of what both share; the last: not fitted
HARMONICS = slice(72, 84)  # of the first harmonic, behind 12 knots


def pair(rng) -> tuple[MarkerMotion, MarkerMotion, list[np.ndarray]]:
    """Two markers whose errors come from the times in part, and how (12, 5) each."""
    leans = [rng.normal(0, 0.03, (12, 5)) / np.where(TIMES > 0, TIMES, 1.0) for _ in range(2)]
    out = []
    for number, lean in zip((3, 7), leans, strict=True):
        one = marker(number)
        C = np.diag(np.full(len(one.covariance), 0.02**2))
        C[HARMONICS, HARMONICS] += lean @ np.diag(TIMES**2) @ lean.T
        C[-5:, -5:] = np.diag(TIMES**2)
        C[HARMONICS, -5:] = lean @ np.diag(TIMES**2)
        C[-5:, HARMONICS] = C[HARMONICS, -5:].T
        more = {"cosine": one.cosine + 0.4 * number, "sine": one.sine - 0.1 * number}
        out.append(replace(one, covariance=C, **more))
    return out[0], out[1], leans


def test_sigmas_of_size_phase_and_total_are_those_of_draws_with_common_times():
    rng = np.random.default_rng(5)
    first, second, leans = pair(rng)
    found = fitted_ratio(first, second)
    times = rng.normal(0, 1, (20_000, 5)) * TIMES
    drawn, totals = [], []
    for one, lean in zip((first, second), leans, strict=True):
        error = times @ lean.T + rng.normal(0, 0.02, (len(times), 12))
        P = one.cosine[0, :3] + error[:, :3] - 1j * (one.sine[0, :3] + error[:, 6:9])
        drawn.append(P)
        totals.append(np.sqrt(np.sum(np.abs(P) ** 2, axis=1)))
    quotient = drawn[0] / drawn[1] / found.ratio[0]
    assert found.size_sigma[0] == pytest.approx(np.log(np.abs(quotient)).std(axis=0), rel=0.03)
    assert found.phase_sigma[0] == pytest.approx(np.angle(quotient).std(axis=0), rel=0.03)
    assert found.total_sigma[0] == pytest.approx(np.log(totals[0] / totals[1]).std(), rel=0.03)
    alone = np.hypot(*(m.amplitude_sigma()[0, :3] / np.abs(m.cosine[0, :3] - 1j * m.sine[0, :3])
                       for m in (first, second)))  # fmt: skip
    assert np.abs(found.size_sigma[0] / alone - 1).max() > 0.1  # as if nothing were shared


def test_what_lies_in_the_noise_or_may_be_something_else_has_no_ratio():
    still = marker(7)
    cosine = still.cosine.copy()
    cosine[0, 1], sine = 0.0, still.sine.copy()
    sine[0, 1] = 0.02  # two sigma
    found = fitted_ratio(marker(3), replace(still, cosine=cosine, sine=sine, blind=(False, False)))
    assert np.isnan(found.ratio[0, 1]) and np.isfinite(found.ratio[0, [0, 2]]).all()
    assert np.isnan(found.ratio[1]).all()  # the response's second harmonic is blind


def surveyed() -> Survey:
    each = np.ones(3)
    ratio = LineRatio(F_HZ, each, 9 * each, 1.0, 9.0, 0 * each, 9 * each)
    curve = MarkerResponse(np.array([1.0]), np.ones((1, 3)) + 0j, *[np.ones((1, 3))] * 2, 9)
    one = Transmission(3, 7, ratio, each, curve)
    return Survey("steady", (), (one, replace(one, response=9, ratio=None)))


def test_a_fitted_response_stands_at_the_lines_and_coheres_with_nothing():
    open_ = {"blind": (False, False)}
    one = fit(markers=(replace(marker(3), **open_), replace(marker(7), **open_)))
    found, unfitted = with_fitted_responses(surveyed(), one).transmissions
    assert found.curve.f_hz.tolist() == [F_HZ, 2 * F_HZ]
    assert found.curve.h1[:, 0] == pytest.approx(1)  # both markers move alike
    assert (found.curve.segments, unfitted.curve.f_hz.size) == (0, 0)
    assert np.isnan([found.coherence, unfitted.coherence]).all()
    assert 0 < found.ratio.ratio_total_sigma < 0.02
    assert (found.ratio.phase_sigma_deg < 5).all()
    refused = replace(one, amplitude_refused="too long an exposure")
    assert not with_fitted_responses(surveyed(), refused).transmissions[0].curve.f_hz.size


def test_the_figure_shows_lines_only_and_no_unsure_phase():
    one = fit(markers=(marker(3), marker(7)))
    found = figures.at_lines(with_fitted_responses(surveyed(), one).transmissions)
    assert [t.response for t in found] == [3]
    assert not figures.at_lines(surveyed().transmissions)  # these have a curve over frequency
    svg = figures.line_responses(found, {3: "3 branch"})
    ET.fromstring(svg)
    for words in ("25.00 Hz", "size, %", "phase", "3 branch"):
        assert words in svg
    curve = found[0].curve
    unsure = replace(found[0], curve=replace(curve, sigma=curve.sigma + 2.0))
    assert figures.line_responses([unsure], {3: "3"}).count("<use") < svg.count("<use")


def test_the_motion_of_markers_that_stand_still_is_the_cameras_and_leaves_the_others():
    one = fit(markers=(marker(3), replace(marker(7), cosine=3 * marker(7).cosine)))
    still, other = without_cameras(one, [3]).markers
    assert other.cosine[:, :3] == pytest.approx(2 * marker(7).cosine[:, :3])
    assert other.sine[:, :3] == pytest.approx(0)
    assert (other.cosine[:, 3:] == 3 * marker(7).cosine[:, 3:]).all()  # shifts only
    assert still.blind == (True, True) and other.blind == marker(7).blind
    before, after = (m.amplitude_sigma()[0, 0] for m in (one.markers[1], other))
    assert after == pytest.approx(np.sqrt(2) * before)  # both were as sure
    assert without_cameras(one, [9]) is one
