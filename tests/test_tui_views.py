"""The views of the app as pure functions: known values in, text out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tui_scene as scene
from rich.cells import cell_len
from tui_app import lines

from olivevib.pipeline.export_preview import ExportPreview, Gap
from olivevib.tui.loader import Results, shades
from olivevib.tui.views.axes import Frame
from olivevib.tui.views.cells import Cells, braille_values, polyline, scatter
from olivevib.tui.views.motion import MotionPlot, motion_plot, window
from olivevib.tui.views.of_results import (
    comparison_of,
    ellipse_mm,
    marks_of,
    motion_of,
    orbits_of,
    path_mm,
    spectrum_of,
)
from olivevib.tui.views.orbits import PLANES, Orbit, mm_per_dot, orbit_at, orbits_plot, page_of
from olivevib.tui.views.outputs import Output, gap_words, preview_text
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.picture import Outline, Window, fitting, picture
from olivevib.tui.views.progress import ESCAPE, Progress, progress_line
from olivevib.tui.views.spectrum import SpectrumPlot, folded, frame_of, next_peak, spectrum_plot
from olivevib.tui.views.tables import comparison_text, facts_text, warnings_text
from olivevib.tui.views.ticks import label, linear, nice
from olivevib.tui.views.words import frequency, marker_frequency, number, seconds_left
from olivevib.vibration import LineStatus, Phase

PLAIN = Palette()
SIZES = [(57, 22), (78, 21), (30, 10), (16, 6), (4, 2), (0, 0)]


# -- cells ----------------------------------------------------------------------------------------


def test_braille_dots_stand_where_the_standard_puts_them():
    bitmap = np.zeros((4, 2), bool)
    bitmap[0, 0] = True
    assert braille_values(bitmap)[0, 0] == 0x01
    bitmap[3, 1] = True
    assert braille_values(bitmap)[0, 0] == 0x81
    cells = Cells(1, 1)
    cells.dots(0, 0, np.ones((4, 2), bool))
    assert cells.text().plain == "⣿"


def test_text_is_cut_at_the_edges_and_wide_characters_take_two_cells():
    cells = Cells(6, 2)
    cells.put(-2, 0, "abcdefghij")
    cells.put(1, 1, "橄榄树")
    assert [cell_len(line) for line in lines(cells.text())] == [6, 6]
    assert lines(cells.text())[0] == "cdefgh"
    assert lines(cells.text())[1] == " 橄榄 "


def test_a_polyline_is_whole_and_broken_by_nan():
    whole = polyline((20, 20), np.array([0.0, 19]), np.array([0.0, 19]))
    assert whole.sum() == 20
    gap = polyline((20, 20), np.array([0.0, np.nan, 19]), np.array([0.0, np.nan, 19]))
    assert gap.sum() == 2
    assert not scatter((4, 4), np.array([-1.0, 4, np.nan]), np.zeros(3)).any()


def test_ticks_are_round_and_few():
    assert [nice(v) for v in (1.0, 1.9, 2.0, 4.99, 0.051, 700)] == [1, 1, 2, 2, 0.05, 500]
    np.testing.assert_allclose(linear(0, 15, 5), [0, 5, 10, 15])
    np.testing.assert_allclose(linear(-0.3, 0.3, 3), [-0.2, 0, 0.2])
    assert linear(1, 1, 5).size == 0
    for high in (0.37, 1.0, 14.9, 1e-4, 3e5):
        for most in range(1, 12):
            assert 0 < linear(0, high, most).size <= most + 1
    assert label(0.5) == "0.5"
    assert label(20.0) == "20"


# -- orbits ---------------------------------------------------------------------------------------


def circle(marker: int, radius: float) -> Orbit:
    angle = np.linspace(0, 2 * np.pi, 200)
    path = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(200)], axis=1)
    return Orbit(marker, f"{2 * radius:.1f} mm", path, np.empty((0, 3)))


def extent(rows: list[str]) -> tuple[int, int]:
    """Columns and rows of cells that hold dots."""
    dots = np.array([[0x2800 < ord(c) < 0x2900 for c in row] for row in rows])
    return int(dots.any(axis=0).sum()), int(dots.any(axis=1).sum())


def test_all_orbits_share_one_scale():
    orbits = [circle(1, 4.0), circle(2, 8.0)]
    size = (60, 16)
    page = page_of(orbits, PLANES[0], 0, size)
    drawn = lines(orbits_plot(orbits, PLANES[0], 0, size, PLAIN))
    small, large = (
        extent([row[t.x : t.x + t.columns].ljust(t.columns) for row in drawn[t.y : t.y + t.rows]])
        for t in page.tiles
    )
    scale = mm_per_dot(orbits, PLANES[0], page)
    for (columns, rows), mm in ((small, 8.0), (large, 16.0)):
        assert 2 * (columns - 1) <= mm / scale + 1 <= 2 * (columns + 1)
        assert 4 * (rows - 1) <= mm / scale + 1 <= 4 * (rows + 1)


def test_the_scale_bar_is_true():
    orbits = [circle(1, 8.0)]
    size = (60, 16)
    bar = lines(orbits_plot(orbits, PLANES[0], 0, size, PLAIN))[-1]
    length, mm = bar.index("┤") - bar.index("├") + 1, float(bar.split("┤ ")[1].split(" mm")[0])
    scale = mm_per_dot(orbits, PLANES[0], page_of(orbits, PLANES[0], 0, size))
    assert 2 * length * scale == pytest.approx(mm, abs=2.1 * scale)


def test_planes_look_from_front_above_and_side():
    tall = Orbit(1, "", np.array([[0, -5.0, 0], [0, 5.0, 1.0]]), np.empty((0, 3)))
    deep = Orbit(1, "", np.array([[0, 0, -5.0], [1.0, 0, 5.0]]), np.empty((0, 3)))
    for plane, orbit, upright in ((0, tall, True), (1, deep, True), (2, deep, False)):
        drawn = lines(orbits_plot([orbit], PLANES[plane], 0, (40, 14), PLAIN))[1:-1]
        dots = np.array([[0x2800 < ord(c) < 0x2900 for c in row] for row in drawn])
        rows, columns = np.nonzero(dots)
        assert (np.ptp(rows) > np.ptp(columns)) == upright


def test_many_markers_are_paged_and_a_click_finds_its_own():
    orbits = [circle(k, 1 + k / 10) for k in range(40)]
    size = (60, 20)
    page = page_of(orbits, PLANES[0], 25, size)
    assert page.first <= 25 < page.first + len(page.tiles)
    for k, tile in enumerate(page.tiles):
        assert orbit_at(page, tile.x + 1, tile.y + 1) == page.first + k
    assert orbit_at(page, 59, 19) is None
    drawn = orbits_plot(orbits, PLANES[0], 25, size, PLAIN).plain
    assert "▶25 7.0 mm" in drawn
    assert "of 40" in drawn


@pytest.mark.parametrize("size", SIZES)
def test_every_plot_fits_its_pane(size):
    orbits = orbits_of(scene.trajectory(), scene.vibration(LineStatus.DIRECT), {"markers": []})
    spectrum = spectrum_of(scene.vibration(LineStatus.DIRECT), 9, "displacement", "x", 30.0, "9")
    motion = motion_of(scene.trajectory(), scene.vibration(LineStatus.DIRECT), 9, "9 twig")
    for text in (
        orbits_plot(orbits, PLANES[1], 3, size, PLAIN),
        spectrum_plot(spectrum, 11.0, size, PLAIN),
        motion_plot(motion, (0.0, 8.0), size, PLAIN),
    ):
        assert len(lines(text)) == max(1, size[1])
        assert {cell_len(line) for line in lines(text)} == {size[0]}


def test_an_orbit_without_a_sample_says_so():
    nothing = Orbit(7, "twig", np.full((3, 3), np.nan), np.empty((0, 3)))
    drawn = orbits_plot([nothing], PLANES[0], 0, (40, 10), PLAIN).plain
    assert "not seen" in drawn
    assert "no marker has a path yet" in drawn


# -- from results ---------------------------------------------------------------------------------


def test_the_ellipse_lies_on_the_path():
    path = path_mm(scene.trajectory(), 0, Phase("steady", 1.6, 7.9))
    curve = ellipse_mm(scene.line(0, LineStatus.DIRECT))
    nearest = np.linalg.norm(path[:, None] - curve[None], axis=2).min(axis=1)
    assert np.nanmax(nearest) < 0.15
    assert ellipse_mm(scene.line(0, LineStatus.NONE)).size == 0
    assert ellipse_mm(scene.line(0, LineStatus.BLIND)).size == 0


def test_gaps_stay_gaps():
    path = path_mm(scene.trajectory(), 3, None)
    assert np.isnan(path[100:112]).all()
    assert np.isfinite(path[:100]).all()


def test_a_line_above_half_the_rate_is_marked_where_it_shows():
    assert folded(25.0, 30.0) == pytest.approx(5.0)
    assert folded(12.0, 30.0) == pytest.approx(12.0)
    assert folded(42.0, 30.0) == pytest.approx(12.0)
    line = scene.line(0, LineStatus.AMBIGUOUS)
    (mark,) = marks_of(line, 30.0)
    assert mark.seen_hz == pytest.approx(5.0)
    assert not mark.decided
    assert mark.words == "ambiguous: 5.00, 12.00, 18.00, 25.00, 42.00 Hz"
    assert marks_of(scene.line(0, LineStatus.NONE), 30.0) == ()


def test_three_axes_together_are_the_root_of_the_squares():
    vibration = scene.vibration(LineStatus.DIRECT)
    together = spectrum_of(vibration, 9, "displacement", "all", 30.0, "9")
    axes = [spectrum_of(vibration, 9, "displacement", a, 30.0, "9").amplitude for a in "xyz"]
    np.testing.assert_allclose(together.amplitude, np.sqrt(sum(a**2 for a in axes)))
    assert spectrum_of(vibration, 77, "displacement", "all", 30.0, "77") is None


# -- spectrum -------------------------------------------------------------------------------------


def spectrum(status=LineStatus.DIRECT) -> SpectrumPlot:
    return spectrum_of(scene.vibration(status), 1, "displacement", "all", 30.0, "1 trunk")


def test_the_line_is_marked_with_its_status_at_its_frequency():
    drawn = lines(spectrum_plot(spectrum(), None, (78, 21), PLAIN))
    arrow = drawn[1].index("▾")
    frame = frame_of(spectrum(), 78, 21)
    assert frame.value_at(arrow) == pytest.approx(12.0, abs=0.15)
    assert "12.0000 ± 0.0013 Hz, direct" in drawn[1]  # 1.2 mHz of the fit, 0.6 of the clock
    top = next(k for k, row in enumerate(drawn) if k > 1 and 0x2800 < ord(row[arrow]) < 0x2900)
    assert top <= 4


def test_undecided_lines_list_their_candidates_and_no_single_frequency():
    drawn = spectrum_plot(spectrum(LineStatus.AMBIGUOUS), None, (78, 21), PLAIN).plain
    assert "ambiguous: 5.00, 12.00, 18.00, 25.00, 42.00 Hz" in drawn
    assert "±" not in drawn


def test_the_axis_is_logarithmic_with_units():
    plot = SpectrumPlot("", np.linspace(0, 15, 121), np.full(121, 0.001), "mm", ())
    values = plot.amplitude.copy()
    values[40], values[80] = 1.0, 0.1
    plot = SpectrumPlot("", plot.f_hz, values, "mm", ())
    frame = frame_of(plot, 78, 21)
    rows = [float(frame.dot_y(v)) for v in (1.0, 0.1, 0.01)]
    assert rows[1] - rows[0] == pytest.approx(rows[2] - rows[1])
    drawn = spectrum_plot(plot, None, (78, 21), PLAIN).plain
    for words in ("0.1┤", "0.01┤", "mm│", "Hz"):
        assert words in drawn


def test_the_cursor_reads_the_nearest_bin_and_hops_between_peaks():
    drawn = spectrum_plot(spectrum(), 11.97, (78, 21), PLAIN).plain
    assert "12.000 Hz" in drawn
    assert next_peak(spectrum(), None, 1) == pytest.approx(12.0)
    assert next_peak(spectrum(), 14.0, -1) == pytest.approx(12.0)
    assert next_peak(spectrum(), 12.0, 1) == pytest.approx(12.0)


def test_what_is_not_known_is_not_drawn():
    plot = spectrum_of(scene.vibration(LineStatus.AMBIGUOUS), 1, "velocity", "all", 30.0, "1")
    assert "no spectrum" in spectrum_plot(plot, 3.0, (78, 21), PLAIN).plain


# -- motion ---------------------------------------------------------------------------------------


def test_zoom_halves_about_the_centre_and_stays_inside():
    plot = MotionPlot("", np.linspace(0, 8, 241), (("camera", np.zeros((241, 3))),), "mm")
    assert window(plot, 0, None) == (0.0, 8.0)
    assert window(plot, 2, 4.0) == (3.0, 5.0)
    assert window(plot, 2, 100.0) == (6.0, 8.0)


def test_phases_stand_above_their_stretch():
    plot = motion_of(scene.trajectory(), scene.vibration(LineStatus.DIRECT), 1, "1 trunk")
    drawn = lines(motion_plot(plot, (0.0, 7.97), (108, 30), PLAIN))
    frame = Frame(8, 1, 99, 1, 0.0, 7.97, 0.0, 1.0)
    assert frame.value_at(drawn[1].index("steady")) > 1.5
    assert "rest" in drawn[1]
    for axis in ("x mm", "y mm", "z mm"):
        assert axis in "\n".join(drawn)


def test_the_residual_is_camera_less_sensor():
    plot = comparison_of(scene.comparison(), residual=True)
    expected = scene.comparison().optical_mm - scene.comparison().sensor_mm
    np.testing.assert_allclose(plot.curves[0][1], expected)
    assert len(comparison_of(scene.comparison(), residual=False).curves) == 2


# -- picture --------------------------------------------------------------------------------------


def test_quadrants_draw_what_is_bright():
    grey = np.zeros((4, 8), np.uint8)
    grey[:2, 2:4] = 255  # upper right quadrant of the first cell
    grey[2:, 4:6] = 255  # lower left quadrant of the second
    (strip,) = picture(grey, Window(0, 0, 8, 4), (2, 1))
    assert strip.text == "▝▖"
    assert "color rgb(255,255,255) on rgb(0,0,0)" in [
        f"color rgb{tuple(s.style.color.triplet)} on rgb{tuple(s.style.bgcolor.triplet)}".replace(
            " ", ""
        ).replace("color", "color ").replace("on", " on ")
        for s in strip
    ]  # fmt: skip


def test_a_picture_keeps_its_proportions():
    assert fitting(Window(0, 0, 1280, 720), 120, 38) == (120, 33)
    assert fitting(Window(0, 0, 1280, 720), 60, 38) == (60, 16)
    assert fitting(Window(0, 0, 640, 480), 0, 10) == (0, 0)


def test_brackets_and_ids_stand_in_cells_about_the_marker():
    grey = np.full((480, 640), 90, np.uint8)
    square = np.array([[200.0, 160], [280, 160], [280, 240], [200, 240]])
    rows = [s.text for s in picture(grey, Window(0, 0, 640, 480), (80, 30), [
        Outline(17, square, "17"),
    ])]  # fmt: skip
    assert rows[10][25:36] == "┌17       ┐"
    assert rows[15][25] == "└"
    assert rows[15][35] == "┘"
    outside = [s.text for s in picture(grey, Window(400, 0, 200, 150), (80, 30), [
        Outline(17, square, "17"),
    ])]  # fmt: skip
    assert "17" not in "".join(outside)


def test_a_window_past_the_border_is_drawn_all_the_same():
    grey = np.arange(64, dtype=np.uint8).reshape(8, 8)
    for where in (Window(-4, -4, 8, 8), Window(6, 6, 8, 8), Window(0, 0, 1, 1)):
        strips = picture(grey, where, (10, 5))
        assert [s.cell_length for s in strips] == [10] * 5


# -- words ----------------------------------------------------------------------------------------


def test_a_frequency_never_stands_alone():
    assert frequency(12.0, 0.0012, "direct", ()) == "12.0000 ± 0.0012 Hz, direct"
    assert frequency(12.0, 4.3e-5, "direct", ()) == "12.000000 ± 0.000043 Hz, direct"
    assert frequency(12.0, None, "confirmed", ()) == "12.0000 Hz, confirmed"
    assert frequency(5.0, 0.1, "ambiguous", (5.0, 25.0)) == "ambiguous: 5.00, 25.00 Hz"
    assert frequency(5.0, 0.1, "aliased", tuple(range(9))).endswith("4.00, … Hz")
    assert frequency(None, None, "none", ()) == "none"
    assert frequency(None, None, None, ()) == "not analysed"
    for status in LineStatus:
        words = frequency(12.0, 0.1, str(status), (12.0, 18.0))
        assert str(status) in words


def test_what_is_not_known_is_said():
    assert number(None, 2, "mm") == "not known"
    assert number(float("nan"), 2) == "not known"
    marker = {
        "frequency_hz": None, "frequency_sigma_hz": None,
        "frequency_clock_sigma_hz": None, "frequency_status": "chirp",
        "frequency_candidates_hz": [],
    }  # fmt: skip
    assert marker_frequency(marker) == "chirp"


def test_time_left_reads_as_a_person_says_it():
    assert [seconds_left(s) for s in (4.4, 89, 120, 5399, 7200)] == [
        "4 s left", "89 s left", "2 min left", "90 min left", "2.0 h left"
    ]  # fmt: skip


def test_the_progress_line_never_loses_how_to_stop():
    progress = Progress("T04: run", "tracking markers", 50, 200, 25.0, 6.0)
    for columns in (120, 80, 60, 40, 30):
        line = progress_line(progress, columns)
        assert line.endswith(ESCAPE)
        assert cell_len(line) <= max(columns, len(ESCAPE) + 3)
    assert "50/200" in progress_line(progress, 120)
    assert "25/s, 6 s left" in progress_line(progress, 120)
    assert "stopping" in progress_line(progress, 80, cancelling=True)
    assert ESCAPE in progress_line(Progress("x", "", 0, None), 80)


def test_warnings_come_with_their_remedies():
    text = warnings_text(
        [{"code": "a-b", "text": "It is dark.", "remedy": "Add light."}], True, PLAIN
    )
    assert text.plain == "⚠ It is dark.\n  Add light.  [a-b]"
    assert warnings_text([], True, PLAIN).plain == "No warnings."
    assert "r runs every stage" in warnings_text([], False, PLAIN).plain


def test_facts_of_a_new_trial_are_not_known():
    none = dict.fromkeys(("frame_rate_hz", "row_time_s", "frames", "dropped"))
    facts = facts_text(
        {
            "calibration": {"baseline_mm": None},
            "timing": {"left": none, "right": none, "right_offset_source": None},
            "markers": [],
            "comparison": {"verdict": None},
        },
        PLAIN,
    )
    assert facts.plain.count("not known yet") == 4


def test_a_comparison_is_told_with_sigmas():
    told = comparison_text(scene.comparison(), PLAIN).plain
    assert "agrees: the gain is within" in told
    assert "clock offset 1234.500 ± 0.020 ms" in told
    assert "rotation 2.40 ± 0.20 °" in told
    assert "12.000 Hz: camera 22.70 ± 0.20, sensor 22.60 ± 0.10 m/s²" in told


def test_outputs_say_what_where_and_what_is_missing_in_them():
    gap = Gap(9, 12, 1, 0.433)
    found = ExportPreview(123_456, ("time_s,marker",), 240, (1, 9), 7.97, "left camera", (gap,))
    told = preview_text(Output("csv", "exports/T04.csv", "not made"), found, PLAIN).plain
    assert told.startswith("Enter writes exports/T04.csv · 123 kB")
    for part in ("markers 1, 9; 240 times over 7.97 s", "sigma_z_mm, state", "left camera"):
        assert part in told
    assert "marker 9 12 times in 1 stretch (longest 0.43 s); the others have none" in told
    again = preview_text(Output("pdf", "report.pdf", "made"), None, PLAIN).plain
    assert "Enter writes it again" in again
    assert "none: every marker" in gap_words(replace(found, gaps=()))


def test_the_spectrogram_of_a_fitted_motion_holds_lines_above_half_the_frame_rate():
    """25 Hz at 30 frames/s, 240 instants a second: as in the report, sway left out."""
    t_s = np.arange(960) / 240.0
    path = scene.trajectory()
    n, m = t_s.size, path.ids.size
    xyz = np.tile(path.xyz_mm[:1], (n, 1, 1))
    xyz[:, :, 0] += (3 * np.sin(2 * np.pi * 25 * t_s) + 9 * np.sin(2 * np.pi * 0.5 * t_s))[:, None]
    fine = replace(
        path.rows(np.zeros(n, np.int64)),
        t_s=t_s,
        sample_t_s=np.repeat(t_s[:, None], m, axis=1),
        xyz_mm=xyz,
        method="continuous",
    )
    found = Results(Path("T04"), {}, trajectory=fine, sway_hz=2.5)
    plot = shades(found, int(path.ids[0]), "1")
    assert "fitted motion" in plot.title
    assert plot.f_hz[0] > 2.5
    strongest = plot.f_hz[np.argmax(np.nanmean(plot.power, axis=1))]
    assert strongest == pytest.approx(25.0, abs=0.5)
