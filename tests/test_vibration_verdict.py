"""Status of a line: candidates, blind zones, never a bare frequency, never confirmed here."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.studies.vibration.records import Tone, displacement
from olivevib.vibration import LineStatus, SamplingFacts, dominant_line
from olivevib.vibration.verdict import candidates, fold, judge

DEFAULT = (5.0, 45.0)


def facts(**changes):
    known = {
        "frame_rate_hz": 30.0,
        "stamps_true": True,
        "row_time_known": True,
        "row_time_s": 2.78e-5,
        "right_offset_known": True,
        "right_offset_s": 0.0,
    }
    return SamplingFacts(**(known | changes))


def test_the_example_of_the_rules_page():
    finding = judge(5.0, facts(), 3.0)
    assert finding.status is LineStatus.AMBIGUOUS
    assert finding.candidates_hz == (5.0, 25.0, 35.0)
    assert "5.00, 25.00 or 35.00 Hz" in finding.reasons[0]
    assert "74" in finding.reasons[0]  # m/s2 of 3 mm at 25 Hz


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({}, LineStatus.AMBIGUOUS),
        ({"stamps_true": False}, LineStatus.ALIASED),
        ({"row_time_known": False, "row_time_s": None}, LineStatus.ALIASED),
        ({"row_time_s": 0.0}, LineStatus.ALIASED),  # global shutter in step: nothing decides
        ({"row_time_s": 0.0, "right_offset_s": 0.010}, LineStatus.AMBIGUOUS),
        ({"row_time_s": 0.0, "right_offset_s": 1 / 30}, LineStatus.ALIASED),  # a whole frame
        ({"frame_rate_hz": 91.0}, LineStatus.DIRECT),
        ({"frame_rate_hz": 90.0}, LineStatus.AMBIGUOUS),  # exceeds, not reaches
        ({"band_hz": (5.0, 14.0), "band_declared": True}, LineStatus.DIRECT),
        ({"band_hz": (18.0, 28.0), "band_declared": True}, LineStatus.SUPPORTED),
        ({"band_hz": (18.0, 28.0)}, LineStatus.AMBIGUOUS),  # nobody declared it
    ],
)
def test_status_follows_from_the_facts(changes, status):
    known = facts(**changes)
    finding = judge(6.1, known, 2.0, 10.0)
    assert finding.status is status
    assert finding.reasons
    if status in (LineStatus.AMBIGUOUS, LineStatus.ALIASED):
        assert len(finding.candidates_hz) > 1 or known.frame_rate_hz == 90.0


def test_one_candidate_in_a_declared_band_says_what_it_rests_on():
    finding = judge(5.0, facts(band_hz=(18.0, 28.0), band_declared=True), 3.0)
    assert finding.candidates_hz == (25.0,)
    assert "declared band" in finding.reasons[0]
    assert "35.00 Hz" in finding.reasons[0]


@pytest.mark.parametrize(
    ("seen", "word"), [(0.4, "sway"), (2.4, "sway"), (14.9, "mirror"), (10.1, "harmonic")]
)
def test_blind_zones(seen, word):
    finding = judge(seen, facts(), 3.0, 10.0)
    assert finding.status is LineStatus.BLIND
    assert word in finding.reasons[0]


@given(
    f=st.floats(5, 45),
    rate=st.floats(6, 240),
    low=st.floats(0.5, 20),
    width=st.floats(1, 60),
)
@settings(deadline=None, max_examples=200)
def test_candidates_are_all_frequencies_of_the_band_that_look_alike(f, rate, low, width):
    seen, band = fold(f, rate), (low, low + width)
    found = candidates(seen, rate, band)
    assert list(found) == sorted(found)
    assert all(band[0] - 1e-6 <= c <= band[1] + 1e-6 for c in found)
    assert all(abs(fold(c, rate) - seen) < 1e-6 for c in found)
    if band[0] + 1e-3 < f < band[1] - 1e-3:
        assert min(abs(c - f) for c in found) < 1e-6
    n = np.arange(40)
    for c in found:  # they do look alike
        np.testing.assert_allclose(
            np.cos(2 * np.pi * c * n / rate), np.cos(2 * np.pi * f * n / rate), atol=1e-4
        )


@given(
    seen=st.floats(0.1, 15),
    stamps=st.booleans(),
    row=st.booleans(),
    offset=st.booleans(),
    declared=st.booleans(),
    low=st.floats(1, 20),
    high=st.floats(21, 60),
)
@settings(deadline=None, max_examples=200)
def test_nothing_here_is_ever_confirmed(seen, stamps, row, offset, declared, low, high):
    known = SamplingFacts(30.0, row, offset, stamps, (low, high), declared)
    finding = judge(seen, known, 1.0, 10.0)
    assert finding.status is not LineStatus.CONFIRMED
    assert finding.status is not LineStatus.DIRECT  # high >= 21 at 30 frames/s
    assert all(reason.strip() for reason in finding.reasons)


def test_a_fast_shaker_seen_slow_is_told_with_all_its_candidates():
    t = np.arange(300) / 30
    tone = Tone(25.07, np.array([3.0, 1.0, 0.5]), np.array([0.3, 1.0, 2.0]))
    line = dominant_line(displacement(t, tone.at(t)), facts())
    assert line.status is LineStatus.AMBIGUOUS
    np.testing.assert_allclose(line.candidates_hz, [25.07, 34.93], atol=1e-6)
    assert line.f_hz == line.candidates_hz[0]
    np.testing.assert_allclose(line.amplitude, tone.amplitude, atol=1e-6)
    turn = 2 * np.pi * line.f_hz * (t[:, None] - line.t_ref_s) + line.phase_rad
    np.testing.assert_allclose(line.amplitude * np.cos(turn), tone.at(t), atol=1e-5)


def test_a_blind_line_gives_no_amplitude():
    t = np.arange(300) / 30
    line = dominant_line(displacement(t, Tone(29.0, np.ones(3), np.zeros(3)).at(t)), facts())
    assert line.status is LineStatus.BLIND
    assert np.isnan(line.amplitude).all()


def test_a_line_that_the_band_cannot_produce_is_none():
    t = np.arange(300) / 30
    x = Tone(9.0, np.ones(3), np.zeros(3)).at(t)
    line = dominant_line(displacement(t, x), facts(band_hz=(23.0, 26.0), band_declared=True))
    assert line.status is LineStatus.NONE


@pytest.mark.parametrize("band", [(5.0, 5.0), (-1.0, 4.0), (5.0, float("inf"))])
def test_impossible_bands_are_refused(band):
    with pytest.raises(ValueError, match="band_hz"):
        SamplingFacts(30.0, band_hz=band)
