"""Figures: pure, deterministic, themable, and true to the numbers they are drawn from."""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import report_scene as scene

from olivevib.report import figures
from olivevib.report.figures import canvas
from olivevib.report.figures.boxes import boxes
from olivevib.report.figures.distances import _square
from olivevib.report.figures.scene import _oblique
from olivevib.report.figures.sensor import overlay_window
from olivevib.report.figures.spectra import Band, _limits, noise_floor
from olivevib.report.lines import folded_hz
from olivevib.vibration import Deflection, LineStatus, MarkerResponse, Transmission

IDS = [1, 4, 17]
NAMES = {i: f"{i}" for i in IDS}


@pytest.fixture(scope="module")
def path():
    return scene.trajectory(IDS, seconds=4.0)


@pytest.fixture(scope="module")
def every(path) -> dict[str, str]:
    spectrum = scene.spectrum(path, [LineStatus.DIRECT, LineStatus.AMBIGUOUS, LineStatus.NONE])
    view = scene.calibration()
    sizes = {"left": (1280, 720), "right": (1280, 720)}
    strips = figures.strips(scene.tracks(path), path, NAMES)
    return {
        "motion": figures.time_series(path, NAMES, IDS, figures.whole(path)),
        "close": figures.time_series(path, NAMES, IDS, figures.Window(1.0, 2.0, close=True)),
        "amplitude": figures.amplitude_spectra(spectrum, NAMES, IDS, Band(15.0, 15.0)),
        "psd": figures.power_spectra(spectrum, NAMES, IDS, Band(15.0, 15.0)),
        "frequency": figures.frequencies(spectrum, NAMES, 15.0),
        "orbits": figures.orbits(path, NAMES, IDS, 5.0),
        "scene": figures.scene(scene.rig(), path, NAMES),
        "distances": figures.distances(path, figures.pair_distances(path), NAMES),
        "visibility": figures.visibility(strips),
        "sigma": figures.sigmas(path, NAMES),
        "residuals": figures.residual_map(view, sizes),
        "holdout": figures.holdout(view),
        "sensor": figures.overlay(scene.comparison()),
        "boxes": boxes("b", "displacement, mm", {"Coratina": [1, 2, 3, 4, 5], "Leccino": [2]}),
    }


def test_every_figure_is_sound_xml_with_a_title_and_no_date(every):
    for name, svg in every.items():
        root = ET.fromstring(svg)
        assert root.get("aria-label"), name
        assert "<metadata" not in svg
        assert not re.search(r"20\d\d-\d\d-\d\dT", svg)
        assert not re.search(r"\bnan\b", svg, flags=re.I)


def test_colours_are_variables_with_a_fallback_and_the_ground_is_open(every):
    for name, svg in every.items():
        colours = set(re.findall(r"(?<!,)#[0-9a-f]{6}\b", svg))
        assert not colours, (name, colours)
        assert re.search(r"var\(--\w+,#[0-9a-f]{6}\)", svg), name


def test_figures_stay_inside_their_frame(every):
    """No text starts outside the drawing (the width of a text is checked by eye)."""
    for name, svg in every.items():
        width, height = (float(v) for v in re.search(r'viewBox="0 0 (\S+) (\S+)"', svg).groups())
        for x, y in re.findall(r'<text[^>]* x="([-\d.]+)" y="([-\d.]+)"', svg):
            assert -1 <= float(x) <= width + 1, name
            assert -1 <= float(y) <= height + 1, name


def test_drawing_twice_gives_the_same_bytes(path, every):
    assert figures.scene(scene.rig(), path, NAMES) == every["scene"]
    assert figures.overlay(scene.comparison()) == every["sensor"]


def test_drawing_leaves_no_trace_in_matplotlib(every):
    import matplotlib as mpl

    assert mpl.rcParams["svg.fonttype"] == "path"
    assert "matplotlib.pyplot" not in sys.modules


def test_mathematics_and_markup_in_names_are_drawn_as_text(path):
    names = dict.fromkeys(IDS, r"$\foo$ <b>&[/nope]")
    svg = figures.time_series(path, names, IDS, figures.whole(path))
    ET.fromstring(svg)
    assert "$\\foo$ &lt;b&gt;&amp;[/nope]" in svg


def test_thinning_keeps_the_extremes_and_the_gaps():
    t = np.arange(100_000) / 1000.0
    values = np.sin(t)
    values[40_000:50_000] = np.nan
    values[77_777] = 9.0
    values[12_345] = -7.0
    thin_t, thin_values = canvas.thin(t, values, 1000)
    assert thin_t.size <= 1000
    assert np.nanmax(thin_values) == 9.0
    assert np.nanmin(thin_values) == -7.0
    inside = (thin_t > 40.5) & (thin_t < 49.5)
    assert inside.any()
    assert np.isnan(thin_values[inside]).all()
    assert (np.diff(thin_t) >= 0).all()


def test_runs_cover_exactly_what_is_true():
    flags = np.array([True, True, False, True, False, False, True])
    assert canvas.runs(flags) == [(0, 2), (3, 4), (6, 7)]
    assert canvas.runs(np.zeros(3, bool)) == []


@pytest.mark.parametrize(("true_hz", "seen_hz"), [(12, 12), (25, 5), (35, 5), (31, 1), (15, 15)])
def test_a_line_is_marked_where_the_frame_rate_folds_it(true_hz, seen_hz):
    assert folded_hz(float(true_hz), 15.0) == pytest.approx(seen_hz)
    assert np.isnan(folded_hz(np.nan, 15.0))


def test_noise_floor_is_that_of_the_noise_not_of_the_line():
    rng = np.random.default_rng(1)
    f = np.arange(300) * 0.05
    values = np.abs(rng.normal(0, 1, 300)) * 0.01
    expected = float(np.median(values[3:]))
    values[198:203] = 5.0
    assert noise_floor(f, values, 10.0, 0.05) == pytest.approx(expected, rel=0.1)


def spectrum_of_a_fit(path):
    """A spectrum that falls to rounding beside its line, as that of a fitted motion does."""
    spectrum = scene.spectrum(path, [LineStatus.DIRECT] * 3)
    beside = np.abs(spectrum.f_hz - 12.003) > 1.0
    amplitude = np.where(beside[:, None, None], 1e-7, spectrum.amplitude)
    return replace(spectrum, amplitude=amplitude, psd=amplitude**2)


@pytest.mark.parametrize("draw", [figures.amplitude_spectra, figures.power_spectra])
def test_a_fitted_motion_has_no_noise_floor_and_no_axis_below_its_sigma(path, draw):
    """What the fitted curve leaves beside its line is rounding: it is no noise of a measurement."""
    spectrum = spectrum_of_a_fit(path)
    dotted = "stroke-dasharray:0.7,1.4"
    samples = draw(spectrum, NAMES, IDS, Band(15.0, 15.0))
    fitted = draw(spectrum, NAMES, IDS, Band(15.0, 15.0, fitted=True))
    assert dotted in samples.replace(" ", "")
    assert dotted not in fitted.replace(" ", "")
    least = min(line.amplitude_sigma.min() for line in spectrum.lines)
    drawn = _limits(spectrum, spectrum.amplitude, IDS, Band(15.0, 15.0, fitted=True), least)
    assert drawn[0] == pytest.approx(0.1 * least)
    assert _limits(spectrum, spectrum.amplitude, IDS, Band(15.0, 15.0), least)[0] < 1e-6


def test_distances_of_a_rigid_pair_have_no_spread(path):
    xyz = path.xyz_mm.copy()
    xyz[:, 1] = xyz[:, 0] + [3.0, 4.0, 12.0]
    pairs = figures.pair_distances(replace(path, xyz_mm=xyz))
    rigid = next(p for p in pairs if (p.first, p.second) == (1, 4))
    assert rigid.mean_mm == pytest.approx(13.0)
    assert rigid.sd_mm < 1e-9
    assert rigid.frames == int(path.seen[:, 0].sum())
    assert len(pairs) == 3


def test_every_square_of_the_map_holds_its_number_and_darkens_with_the_spread():
    """Squares of one size (a number fits); opacity rises with the standard deviation."""
    squares = [_square(0, 0, share) for share in (0.0, 0.3, 1.0)]
    assert {square.get_width() for square in squares} == {0.94}
    shades = [square.get_alpha() for square in squares]
    assert shades == sorted(shades) and shades[0] < shades[-1]


def test_pairs_that_hardly_met_are_left_out(path):
    xyz = path.xyz_mm.copy()
    xyz[4:, 2] = np.nan
    pairs = figures.pair_distances(replace(path, xyz_mm=xyz))
    assert [(p.first, p.second) for p in pairs] == [(1, 4)]


def test_the_oblique_view_is_a_rotation_with_depth_to_the_upper_right():
    view = _oblique()
    assert view.right @ view.up == pytest.approx(0)
    assert np.linalg.norm(view.up) == pytest.approx(1)
    z = view.flat(np.array([[0.0, 0, 1]]))[0]
    y = view.flat(np.array([[0.0, 1, 0]]))[0]
    assert (z > 0).all()
    assert y[1] < 0


def test_the_overlay_shows_where_most_happens():
    comparison = scene.comparison()
    louder = comparison.optical_mm * (1 + 9 * (comparison.overlay_t_s > 7.2))[:, None]
    start, end = overlay_window(replace(comparison, optical_mm=louder))
    assert start >= 7.0
    assert end - start == pytest.approx(1.5)


def test_states_of_both_cameras_stand_above_space(path):
    rows = figures.strips(scene.tracks(path), path, NAMES)
    assert [label for label, _, _ in rows[:3]] == ["1 — left", "right", "3-D"]
    assert len(rows) == 3 * len(IDS)


def response(coherence: float) -> Transmission:
    """A flat response of marker 2 to marker 1, 1.5 on every axis."""
    f_hz = np.linspace(1, 14, 14)
    each = np.ones((14, 3))
    curve = MarkerResponse(f_hz, 1.5 * each.astype(complex), coherence * each, 0.1 * each, 9)
    return Transmission(2, 1, None, np.full(3, coherence), curve)


def test_a_response_is_drawn_in_full_only_where_it_is_coherent():
    sure, unsure = (figures.responses([response(c)], {1: "1", 2: "2"}) for c in (0.95, 0.3))
    assert sure.count("<use") == unsure.count("<use") + 2 * 3 * 14  # a dot a trusted value
    for svg in (sure, unsure):
        ET.fromstring(svg)
        assert "coherence" in svg and "phase" in svg and "|H1|" in svg
    assert figures.shown_responses([response(0.9)])
    empty = MarkerResponse(np.empty(0), np.empty((0, 3), complex), *[np.empty((0, 3))] * 2, 0)
    assert not figures.shown_responses([replace(response(0.9), curve=empty)])


def test_the_deflection_shape_says_how_much_it_is_enlarged(path):
    shape = Deflection(tuple(IDS), 12.0, np.full((len(IDS), 3), 2.0 + 1.0j), "mm")
    svg = figures.deflection(shape, path, NAMES)
    ET.fromstring(svg)
    factor = float(re.search(r"motion drawn ([0-9.]+) times", svg)[1])
    extent = np.ptp(np.nanmean(path.xyz_mm, axis=0), axis=0).max()
    assert 0.05 * extent < factor * np.linalg.norm([2, 2, 2]) < 0.2 * extent
