"""What a recording will tell, against the hand-calculated numbers of the timing page."""

import json
import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.cli import main
from olivevib.planning import Setup, advice, outlook, zone_of, zones
from olivevib.planning.words import one_words, table_words

STANDARD = Setup(readout_s=0.020, offset_s=0.0, marker_mm=50.0)


def test_contrast_is_that_of_the_standard_case():
    """2 pi 30/s x 2.036 px x 33.93 px x 27.78 us = 0.3617 px."""
    assert STANDARD.contrast_px(3.0) == pytest.approx(0.3617, abs=2e-4)
    assert STANDARD.marker_px == pytest.approx(33.93, abs=0.01)


@pytest.mark.parametrize(("readout_ms", "contrast", "least"), [(10, 0.06, 1.33), (20, 0.12, 0.66)])
def test_least_amplitudes(readout_ms, contrast, least):
    setup = Setup(readout_s=readout_ms * 1e-3, offset_s=0.0, marker_mm=50.0)
    assert setup.contrast_px(1.0) == pytest.approx(contrast, abs=0.003)
    assert outlook(setup, 25.0).least_amplitude_mm == pytest.approx(least, abs=0.01)


@pytest.mark.parametrize(
    ("skew_ms", "depth"), [(0.1, 0.157), (0.5, 0.785), (1.0, 1.569), (5.0, 7.654), (16.7, 19.3)]
)
def test_false_depth(skew_ms, depth):
    """(1400/420) 2 x 3 mm sin(pi 25/s d)."""
    found = outlook(Setup(readout_s=0.02, offset_s=skew_ms * 1e-3), 25.0, 3.0)
    assert found.false_depth_mm == pytest.approx(depth, rel=5e-3)
    assert found.false_depth_per_ms_mm == pytest.approx(1.569, rel=1e-3)


def test_accelerations_true_and_naive():
    found = outlook(STANDARD, 25.0, 3.0)
    assert found.acceleration_m_s2 == pytest.approx(74.02, abs=0.01)
    assert found.seen_hz == pytest.approx(5.0)
    assert found.seen_acceleration_m_s2 == pytest.approx(2.96, abs=0.01)
    assert found.aliases_hz == pytest.approx((5.0, 25.0, 35.0))


@pytest.mark.parametrize(
    ("f", "small", "large"), [(18, 0.45, 5.0), (25, 0.375, 1.5), (35, 0.30, 0.75)]
)
def test_row_time_margins(f, small, large):
    got = outlook(STANDARD, f).row_time_margin
    assert got == pytest.approx((small, large), abs=0.006)


def test_prototype_evidence():
    """In step, 20 ms: least dL of the prototype 4055; the estimate is its lower end."""
    assert 2000 < outlook(STANDARD, 25.0).evidence < 6000


def test_zones_in_step_and_apart():
    in_step = {z.centre_hz: z for z in zones(30.0, False)}
    assert set(in_step) == {7.5, 10.0, 15.0, 20.0, 22.5, 30.0, 37.5, 40.0, 45.0}
    assert (in_step[30.0].half_hz, in_step[10.0].half_hz) == (2.5, 0.3)
    assert in_step[30.0].blind
    apart = {z.centre_hz: z for z in zones(30.0, True)}
    assert apart[30.0].half_hz == 0.3
    assert [z for z in apart.values() if z.doubtful] == [apart[30.0]]


@pytest.mark.parametrize(
    ("f", "offset_ms", "status"),
    [
        (25.0, 0.0, "confirmable"),
        (28.0, 0.0, "blind"),
        (28.0, 10.0, "confirmable"),
        (30.1, 10.0, "blind"),
        (20.0, 0.0, "ambiguous"),
        (20.0, 9.0, "confirmable"),
        (20.0, 16.7, "ambiguous"),
        (22.5, 0.0, "confirmable"),
    ],
)
def test_status(f, offset_ms, status):
    found = outlook(Setup(readout_s=0.02, offset_s=offset_ms * 1e-3), f)
    assert found.status == status
    assert found.reasons


def test_nothing_is_promised_without_an_anchor():
    for setup in (Setup(), Setup(offset_s=0.0), Setup(readout_s=0.0, offset_s=0.0)):
        found = outlook(setup, 25.0)
        assert (found.status, found.least_amplitude_mm) == ("ambiguous", math.inf)
    assert outlook(Setup(readout_s=0.0, offset_s=0.010), 25.0).status == "confirmable"
    assert math.isnan(outlook(Setup(readout_s=0.02), 25.0).false_depth_mm)


def test_direct_only_by_a_declared_band():
    assert outlook(Setup(fps=120.0), 25.0).status != "direct"
    assert outlook(Setup(fps=120.0, band_hz=(5.0, 45.0)), 25.0).status == "direct"


def test_advice_names_what_is_wrong():
    setup = Setup(readout_s=0.02, offset_s=0.0, exposure_s=0.006, marker_mm=40.0)
    words = " ".join(advice(setup, outlook(setup, 22.0)))
    for needed in ("Expose at most 2.0 ms", "50 mm", "8-13 ms apart", "rest", "start-up"):
        assert needed in words, needed
    good = Setup(readout_s=0.02, offset_s=0.010)
    assert len(advice(good, outlook(good, 24.0))) == 1


@settings(deadline=None, max_examples=60)
@given(
    f=st.floats(4.0, 46.0),
    fps=st.floats(10.0, 120.0),
    offset_ms=st.floats(-40.0, 40.0),
    readout=st.floats(0.0, 0.9),
)
def test_any_setup_has_an_outlook(f, fps, offset_ms, readout):
    setup = Setup(fps=fps, readout_s=readout / fps, offset_s=offset_ms * 1e-3)
    found = outlook(setup, f)
    assert found.status in ("confirmable", "ambiguous", "blind")
    assert any(abs(f - g) < 1e-6 for g in found.aliases_hz)
    # also of a zone whose middle lies outside the band: 44 Hz looks like sway at 23 frames/s
    zone = zone_of(f, zones(fps, setup.apart, 10.0, (min(5.0, f) - 2.5, max(45.0, f) + 2.5)))
    assert (found.zone is None) == (zone is None)
    assert found.sigma_depth_mm >= found.sigma_plane_mm > 0


def test_verb(capsys):
    asked = "plan --fps 30 --readout 20 --offset 10 --marker 60 --distance 1400 --frequency 25"
    assert main(asked.split()) == 0
    text = capsys.readouterr().out
    assert "confirmable" in text and "14.14 mm" in text and "30 ± 0.3 (blind)" in text
    assert main([*asked.split(), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["frequencies"][0]["status"] == "confirmable"
    assert main(["plan", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frequencies"][0]["false_depth_mm"] is None
    assert main(["plan", "--fps", "0"]) == 2


def told(setup: Setup, f_hz: float) -> str:
    found = outlook(setup, f_hz)
    return one_words(setup, found, advice(setup, found))


def test_an_offset_that_was_given_is_not_called_in_step():
    words = told(Setup(fps=60.0, readout_s=0.02, offset_s=0.010), 25.0)
    assert "in step" not in words
    assert "10 ms is 0.40 of a frame period, too much to take away every zone" in words
    assert "Start the cameras 4-6.5 ms apart" in words
    assert "too little" in told(Setup(readout_s=0.02, offset_s=0.005), 25.0)
    assert "in step, several" in told(Setup(readout_s=0.02, offset_s=0.0), 25.0)
    assert "--offset MS" in told(Setup(readout_s=0.02), 25.0)
    assert "half a frame apart" in told(Setup(readout_s=0.02, offset_s=0.0166), 25.0)
    assert "Start the cameras" not in told(Setup(readout_s=0.02, offset_s=0.010), 25.0)


def test_a_direct_frequency_has_no_contrast_and_no_least_amplitude():
    setup = Setup(fps=120.0, readout_s=0.008, band_hz=(5.0, 45.0))
    words = told(setup, 25.0)
    assert "nothing else in the band: nothing to decide" in words
    for word in ("contrast", "evidence", "least amplitude", "row time that still"):
        assert word not in words
    line = table_words(setup, [outlook(setup, 25.0)]).splitlines()[-1]
    assert line.split()[3] == "-"


def test_evidence_is_rounded_and_the_margin_of_the_row_time_is_told_in_words():
    words = told(STANDARD, 25.0)
    exact = outlook(STANDARD, 25.0).evidence
    rounded = re.search(r"evidence about ([0-9,]+), where 25 confirm", words)
    assert rounded
    assert float(rounded[1].replace(",", "")) == pytest.approx(exact, rel=0.05)
    assert len(rounded[1].replace(",", "").rstrip("0")) <= 2
    assert "38 % shorter to 150 % longer than the true one" in words
    assert "50 % shorter than the true one, or longer" in told(STANDARD, 15.0)


def test_what_tells_aliases_apart_without_row_times_is_the_offset_or_nothing():
    assert "the offset between the cameras" in told(Setup(readout_s=0.0, offset_s=0.010), 25.0)
    words = told(Setup(readout_s=0.0, offset_s=0.0), 25.0)
    assert "what tells these apart         nothing: all rows are seen at once" in words
    assert "0.000 px" not in words
