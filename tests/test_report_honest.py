"""The page says no more than is known: of a fitted motion, its comparison, what moves most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import report_scene as scene
from test_report_page import Reader

from olivevib.comparison import LineDifference
from olivevib.report.page import page_facts, render_page
from olivevib.report.plates import ranked
from olivevib.report.tables import comparison_lines, comparison_pairs
from olivevib.report.verdict import verdict
from olivevib.report.words import number
from olivevib.vibration import LineStatus


def fitted_content(**changes):
    """A trial whose paths are those of a fitted motion at 12.003 Hz with one harmonic."""
    content = scene.content([1, 2, 17], seconds=5.0)
    path = replace(content.trajectory, method="continuous")
    return replace(content, trajectory=path, **changes)


def test_captions_of_a_fitted_motion_do_not_speak_of_folding_or_noise():
    facts = page_facts(fitted_content())
    told = " ".join(p.caption for plates in facts["plates"].values() for p in plates)
    assert "No noise floor is drawn" in told and "they do not fold" in told
    assert "Dotted: noise floor" not in told and "frame rate they fold" not in told
    assert "the fitted motion does not hold" in told  # why what lies outside is flagged
    samples = page_facts(scene.content([1, 2, 17], seconds=5.0))
    told = " ".join(p.caption for plates in samples["plates"].values() for p in plates)
    assert "Dotted: noise floor" in told and "frame rate they fold" in told
    assert "No noise floor" not in told and "fitted motion" not in told


def test_lines_that_a_fitted_path_cannot_hold_are_left_out_of_the_comparison_and_named():
    beside = LineDifference(12.9, 0.0005, 0.0055, 0.1402, 0.0022, 0.0, 90.0)
    third = LineDifference(36.01, 0.0001, 0.046, 0.0606, 0.0021, 0.0, 40.0)
    compared = scene.comparison()
    compared = replace(compared, lines=(*compared.lines, beside, third))
    fitted = fitted_content(comparisons=(compared,))
    rows, left = comparison_lines(fitted, compared)
    assert [row[0] for row in rows] == ["12.00\u00a0Hz"]
    assert "12.90\u00a0Hz (0.1402" in left and "36.01\u00a0Hz" in left
    assert " ".join(left.split()) in " ".join(Reader(render_page(fitted)).visible.split())
    of_both = np.hypot(np.hypot(0.05, 0.0018 * 11.52), 0.02)  # noise, gain, sensor
    assert rows[0][3].replace("\u00a0", " ") == f"0.030 ± {of_both:.3f} m/s²"
    rows, left = comparison_lines(scene.content([1, 2, 17], seconds=5.0), compared)
    assert len(rows) == 3 and left == ""


def test_the_correlation_of_the_table_is_that_of_the_verdict():
    content = scene.content([1, 2], seconds=4.0)
    pairs = dict(comparison_pairs(content, replace(scene.comparison(), coherence=0.99)))
    assert pairs["correlation of what both see"] == number(0.99**0.5)
    assert "(0.26 ± 0.18" in pairs["gain, camera / sensor"].replace("\u00a0", " ")


def test_advice_stands_apart_and_only_where_it_would_change_something():
    advice = "Start the cameras 8-13 ms apart."
    for status, said in ((LineStatus.DIRECT, False), (LineStatus.SUPPORTED, True)):
        content = scene.content([1, 2], status, seconds=4.0, next_time=(advice,))
        spectrum = content.displacement
        lines = tuple(replace(x, reasons=("A reason.", advice)) for x in spectrum.lines)
        spectra = content.vibration.spectra | {"displacement": replace(spectrum, lines=lines)}
        vibration = replace(content.vibration, spectra=spectra)
        text = Reader(render_page(replace(content, vibration=vibration))).visible
        assert "A reason." in text
        assert (f"Next time, to be surer: {advice}" in text) is said
        assert text.count(advice) == int(said)


def test_the_marker_that_moves_most_is_that_of_the_longest_half_axis():
    """Marker 4 is larger along x, marker 1 in its own direction."""
    content = scene.content([1, 4, 17], seconds=4.0)
    spectrum = content.displacement
    sizes = {1: [4.953, 1.793, 3.050], 4: [5.328, 1.136, 1.457], 17: [0.1, 0.1, 0.1]}
    lines = tuple(
        replace(scene.line(LineStatus.DIRECT, 12.0), amplitude=np.array(sizes[int(i)]),
                phase_rad=np.zeros(3))
        for i in spectrum.ids
    )  # fmt: skip
    spectra = content.vibration.spectra | {"displacement": replace(spectrum, lines=lines)}
    content = replace(content, vibration=replace(content.vibration, spectra=spectra))
    said = verdict(content)[1].replace("\u00a0", " ")
    assert said.startswith("Marker 1 · trunk, clamp height moves most, by 6.0")
    assert ranked(content, [1, 4, 17]) == [1, 4, 17]


def test_a_figure_of_spectra_ends_at_four_times_the_highest_line():
    content = scene.content([1, 2], seconds=4.0)
    assert content.shown_hz == content.half_rate_hz == pytest.approx(15.0)
    slow = scene.content([1, 2], seconds=4.0)
    lines = tuple(replace(x, f_hz=3.0) for x in slow.displacement.lines)
    spectra = slow.vibration.spectra | {"displacement": replace(slow.displacement, lines=lines)}
    slow = replace(slow, vibration=replace(slow.vibration, spectra=spectra))
    assert slow.shown_hz == pytest.approx(12.0)
    told = " ".join(p.caption for p in page_facts(slow)["plates"]["spectra"])
    assert "drawn up to 12.0\u00a0Hz" in told.replace("12.0 Hz", "12.0\u00a0Hz")
