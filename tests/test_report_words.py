"""Numbers, keys and metadata as a person reads them."""

from __future__ import annotations

import math
import unicodedata

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.lines import candidates_text
from olivevib.report.verdict import verdict
from olivevib.report.words import count, fact, label, measure, number, percent, seconds, triple


def said(text: str) -> str:
    return text.replace("\u00a0", " ").replace("\u2212", "-")


@pytest.mark.parametrize(
    ("value", "unit", "sigma", "words"),
    [
        (12.003123, "Hz", 0.00163, "12.0031 ± 0.0016 Hz"),
        (12.0, "mm", None, "12.00 mm"),
        (1234.5, "mm", 150.0, "1230 ± 150 mm"),
        (-0.2, "", 0.02, "-0.200 ± 0.020"),
        (16.06, "°", 0.4, "(16.06 ± 0.40)°"),
        (99.0, "m/s2", 1.2, "99.0 ± 1.2 m/s²"),
        (None, "mm", 0.1, "not known"),
        (math.nan, "mm", None, "not known"),
        (30.0, "frames/s", 1e-14, "30 frames/s"),
        (0.0, "mm", None, "0 mm"),
        (-0.00001, "mm", 0.5, "0.00 ± 0.50 mm"),
    ],
)
def test_a_measure_shows_two_digits_of_its_sigma(value, unit, sigma, words):
    assert said(measure(value, unit, sigma)) == words


@settings(deadline=None, max_examples=60)
@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e3))
def test_a_printed_measure_lies_within_a_tenth_of_sigma(value, sigma):
    printed = said(measure(value, "", sigma)).split(" ± ")
    if len(printed) == 2:
        assert abs(float(printed[0]) - value) <= 0.06 * sigma
        assert abs(float(printed[1]) - sigma) <= 0.06 * sigma


@pytest.mark.parametrize(
    ("value", "sigma", "words"),
    [
        (27.8e-6, 4e-7, "27.80 ± 0.40 µs"),
        (0.00912, 5e-5, "9.120 ± 0.050 ms"),
        (1.5, None, "1.500 s"),
        (0.0, None, "0 s"),
        (None, None, "not known"),
    ],
)
def test_times_choose_a_unit_that_reads_well(value, sigma, words):
    assert said(seconds(value, sigma)) == words


def test_fractions_triples_and_counts():
    assert said(percent(0.98765)) == "98.8 %"
    assert said(percent(1.0)) == "100 %"
    assert said(triple([0.05, 0.05, 0.31], "mm")) == "0.050 / 0.050 / 0.31 mm"
    assert triple([0.05, math.nan, 1], "mm") == "not known"
    assert said(count(1, "marker")) == "1 marker"
    assert said(count(0, "marker")) == "0 markers"
    assert number(0.000123456) == "0.0001235"


def test_settings_keys_become_words_with_units():
    assert label("trunk_diameter_mm") == ("trunk diameter", "mm")
    assert label("acceleration_rms_m_s2") == ("acceleration rms", "m/s²")
    assert label("notes") == ("notes", "")
    assert said(" ".join(fact("clamp_height_mm", 760.0))) == "clamp height 760 mm"
    nested = [{"name": "odd", "largest_z": 1.23456}, {"usable": True}]
    assert fact("halves", nested, 4) == ("halves", "name odd, largest z 1.235; usable yes")
    assert fact("damage", "") == ("damage", "not known")
    assert fact("simulated", False) == ("simulated", "no")
    assert said(fact("lever_mm", [0.0, 1.5, -2.0])[1]) == "0, 1.5, -2 mm"


@settings(deadline=None, max_examples=200)
@given(st.text(max_size=400))
def test_clean_text_is_one_printable_line(text):
    out = clean(text)
    assert len(out) <= 300
    assert out == " ".join(out.split())
    assert not any(unicodedata.category(c) in {"Cc", "Cf", "Cs", "Co", "Cn"} for c in out)
    assert clean(out) == out


def test_clean_keeps_languages_and_cuts_the_rest():
    assert (
        clean("Olivo «Coratina» – più, Ελιά, 橄欖 20 µm")
        == "Olivo «Coratina» – più, Ελιά, 橄欖 20 µm"
    )
    assert clean("a\x1b[31mb\u202ec\r\n\td") == "a[31mbc d"
    assert clean("x" * 5000).endswith("…")
    assert len(clean("e" + "\u0301" * 500)) == 3


def test_what_failed_is_said_in_the_first_sentence():
    stages = {"calibrate": {"state": "done"}, "track": {"state": "failed", "reason": "no stamps"},
              "reconstruct": {"state": "blocked", "reason": "track has failed"}}  # fmt: skip
    told = verdict(ReportContent("T1", summary={"stages": stages}))
    assert told[0].startswith("Mind this first: track failed (no stamps); reconstruct could not")
    assert "no warning was raised" not in told[-1]
    sound = verdict(ReportContent("T1", summary={"stages": {"track": {"state": "done"}}}))
    assert len(sound) == 3
    assert "no warning was raised" in sound[-1]


def test_candidates_carry_their_probabilities_where_they_are_known():
    assert (
        candidates_text((5.0, 25.0), (0.12, 0.88))
        == "5.00 (12\u00a0%) or 25.00 (88\u00a0%)\u00a0Hz"
    )
    assert candidates_text((5.0, 25.0)) == "5.00 or 25.00\u00a0Hz"
