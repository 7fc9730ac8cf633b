"""Which figures a trial can show, in what order, and the words below each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.progress import Tick, silent
from olivevib.report import captions, figures
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.lines import KNOWN, OPEN
from olivevib.report.plates_together import Job, body_jobs, response_jobs
from olivevib.report.words import number
from olivevib.vibration import Spectrum, largest

ROWS = 8  # markers in one figure
SPECTRA = 4  # markers in one figure of spectra: small figures fill a page of paper better
CLOSE_S = 1.0  # length of the close-up
SPECTROGRAMS = 3  # markers whose spectrogram is drawn
STRIPS = 36  # state strips in one figure


@dataclass(frozen=True)
class Plate:
    """One figure of the page: its section, the SVG and what a person should see in it."""

    section: str
    svg: str
    caption: str


def plates(content: ReportContent, tick: Tick = silent) -> list[Plate]:
    """All figures that the content allows, in the order of the page; none is ever empty."""
    jobs = [*_space(content), *_spectra(content), *_quality(content)]
    out = []
    with figures.style():
        for done, (section, caption, drawing) in enumerate(jobs):
            tick(done, len(jobs), f"drawing: {section}")
            out.append(Plate(section, drawing(), caption))
    tick(len(jobs), len(jobs), "figures drawn")
    return out


def _groups(ids: Sequence[int], size: int) -> list[list[int]]:
    """The ids in groups of nearly equal length, at most ``size``."""
    if not ids:
        return []
    parts = np.array_split(np.array(ids), -(-len(ids) // size))
    return [[int(i) for i in part] for part in parts]


def seen_ids(content: ReportContent) -> list[int]:
    """The markers that have at least two positions in space, by id."""
    path = content.trajectory
    if path is None:
        return []
    return sorted(
        int(i) for i, n in zip(path.ids, np.add.reduce(path.seen, axis=0), strict=True) if n >= 2
    )


def _space(content: ReportContent) -> Iterator[Job]:
    path, names, ids = content.shown_path, content.names(), seen_ids(content)
    rig, lines = content.rig, content.lines()
    if rig is not None:
        yield ("paths", captions.SCENE, lambda: figures.scene(rig, path, names))
    if path is None or not ids:
        return
    for group in _groups(ids, ROWS):
        caption = captions.MOTION + (captions.FITTED if content.continuous else "")
        yield ("motion", _once(caption, group, ids), _bound(
            figures.time_series, path, names, group, figures.whole(path), content.phases
        ))  # fmt: skip
    window, closest = _close(content, ids)
    each = "instants of the fitted motion" if content.continuous else "single frames"
    if window is not None:
        caption = captions.CLOSE.format(length=number(window.end_s - window.start_s, 2), each=each)
        yield (
            "motion",
            caption,
            _bound(figures.time_series, path, names, closest, window, (), lines),
        )
    yield from _changing(content, ranked(content, ids))
    reach = figures.orbit_reach_mm(path, ids)
    for group in _groups(ids, figures.MOST_ACROSS):
        caption = _once(captions.ORBITS.format(reach=number(reach, 3), each=each), group, ids)
        yield ("orbits", caption, _bound(figures.orbits, path, names, group, reach, lines))
    yield from body_jobs(content, ranked(content, ids))
    pairs = figures.pair_distances(path)
    if pairs:
        yield ("distances", captions.DISTANCES, lambda: figures.distances(path, pairs, names))


def _once(caption: str, group: Sequence[int], ids: Sequence[int]) -> str:
    """The caption below the first figure of a series; the others only say that they go on."""
    return caption if group[0] == ids[0] else "The same for the other markers."


def _bound(function: Callable[..., str], *values: object) -> Callable[[], str]:
    return lambda: function(*values)


def _close(content: ReportContent, ids: Sequence[int]) -> tuple[figures.Window | None, list[int]]:
    """A second (or 15 frames) of the steady phase, and the three markers that move most."""
    path = content.shown_path
    assert path is not None
    steady = [(span.start_s, span.end_s) for span in content.phases if span.name == "steady"]
    whole = figures.whole(path)
    most = ranked(content, ids)[:3]
    length_s = max(CLOSE_S, 7.5 / content.half_rate_hz)
    span = steady[0] if steady else (whole.start_s, whole.end_s)
    return figures.close_window(path, most[0], span, length_s), sorted(most)


def ranked(content: ReportContent, ids: Sequence[int]) -> list[int]:
    """The markers by the largest amplitude of their line in any direction; unknown ones last."""
    lines = content.lines()

    def size(marker_id: int) -> float:
        line = lines.get(marker_id)
        reach = 0.0 if line is None else largest(line)[0]
        return reach if np.isfinite(reach) else 0.0

    return sorted(ids, key=lambda i: -size(i))


def _changing(content: ReportContent, most: Sequence[int]) -> Iterator[Job]:
    """The spectrograms of the markers that move most."""
    path, names = content.shown_path, content.names()
    assert path is not None
    sway, top = content.sway_hz, content.shown_hz
    each = {i: figures.spectrogram(path, i, top, sway) for i in sorted(most[:SPECTROGRAMS])}
    found = {i: one for i, one in each.items() if one is not None and np.isfinite(one.power).any()}
    if found:
        yield (
            "spectrogram",
            captions.SPECTROGRAM.format(sway=number(sway, 3))
            + (captions.TRUE if content.continuous else captions.FOLDED),
            _bound(figures.spectrograms, found, names, content.phases, _axis(content)),
        )


def _spectra(content: ReportContent) -> Iterator[Job]:
    spectrum, names, fold = content.displacement, content.names(), content.fold_hz
    band = figures.Band(content.half_rate_hz, content.shown_hz, content.continuous)
    if spectrum is None or not spectrum.ids.size:
        return
    if any(line.status in (*KNOWN, *OPEN) for line in spectrum.lines):
        yield ("frequency", captions.FREQUENCY, lambda: figures.frequencies(spectrum, names, fold))
    ids = _finite_ids(spectrum)
    for group in _groups(ids, SPECTRA):
        words = captions.AMPLITUDE + (captions.NO_FLOOR if content.continuous else captions.FLOOR)
        words = _once(words + _window_words(spectrum, content), group, ids)
        yield ("spectra", words, _bound(figures.amplitude_spectra, spectrum, names, group, band))
    acceleration = content.vibration.spectra.get("acceleration") if content.vibration else None
    if acceleration is not None:
        for group in _groups(_finite_ids(acceleration), 12):
            job = _bound(figures.total_spectra, acceleration, names, group, band)
            yield ("spectra", captions.ACCELERATION, job)
    for group in _groups(_finite_ids(spectrum), 12):
        job = _bound(figures.power_spectra, spectrum, names, group, band)
        words = captions.PSD + (
            captions.NO_FLOOR_AGAIN if content.continuous else " Dotted: noise floor."
        )
        yield ("psd", words + _window_words(spectrum, content), job)
    ratios = content.transmissibility
    if ratios is not None:
        job = _bound(figures.transmissibilities, ratios.ratios, names, ratios.reference)
        yield ("transmissibility", captions.RATIOS.format(reference=ratios.reference), job)
    yield from response_jobs(content)
    if content.decays:
        yield ("decay", captions.DECAY, _bound(figures.decays, content.decays, names))


def _finite_ids(spectrum: Spectrum | None) -> list[int]:
    """The markers of which a spectrum knows anything, by id."""
    if spectrum is None:
        return []
    finite = np.isfinite(spectrum.amplitude)
    return sorted(int(i) for m, i in enumerate(spectrum.ids) if finite[:, m].any())


def _axis(content: ReportContent) -> str:
    """What stands at the frequency axis of a spectrogram."""
    return "frequency, Hz" if content.continuous else "as sampled, Hz"


def _window_words(s: Spectrum, content: ReportContent) -> str:
    """How a spectrum was made: phase, window, bins, and where its axis ends."""
    span = f", {s.start_s:.2f} to {s.end_s:.2f} s" if np.isfinite(s.start_s + s.end_s) else ""
    return (
        f" Phase: {clean(s.phase, 20)}{span}; {clean(s.window, 20).capitalize()} window,"
        f" {number(s.resolution_hz, 3)} Hz between bins, noise bandwidth"
        f" {number(s.enbw_bins, 3)} bins; {_end_words(content)}."
    )


def _end_words(content: ReportContent) -> str:
    """Where the axis of a spectrum ends, and why there."""
    half, shown = content.half_rate_hz, content.shown_hz
    end = f"{number(half, 4)} Hz, half the sampling rate"
    if content.continuous:
        end = (
            f"{number(half, 4)} Hz, half of the {number(2 * half, 4)} instants a second at which"
            f" the fitted motion is evaluated (the cameras: {number(2 * content.fold_hz, 4)}"
            " frames a second)"
        )
    if shown < half:
        return f"drawn up to {number(shown, 3)} Hz, four times the highest line; it goes to {end}"
    return f"axis up to {end}"


def _outside(content: ReportContent) -> str:
    """Why positions before and after a fitted motion are flagged; empty where none was fitted."""
    shown = content.shown_path
    if shown is None or shown is content.trajectory:
        return ""
    return captions.OUTSIDE.format(start=f"{shown.t_s[0]:.2f}", end=f"{shown.t_s[-1]:.2f}")


def _quality(content: ReportContent) -> Iterator[Job]:
    path, names, view, rig = (
        content.trajectory, content.names(), content.calibration, content.rig,
    )  # fmt: skip
    rows = figures.strips(content.tracks, path, names)
    for part in range(0, len(rows), STRIPS):
        job = _bound(figures.visibility, rows[part : part + STRIPS], part)
        yield ("seen", captions.SEEN + _outside(content), job)
    if path is not None and np.isfinite(path.sigma_xyz_mm).any():
        yield ("sigma", captions.SIGMA, lambda: figures.sigmas(path, names))
        where = figures.sigma_map(rig, path) if rig is not None else None
        if where is not None:
            yield ("sigma", captions.SIGMA_MAP, _bound(figures.sigma_maps, where, path))
    if (
        view is not None
        and rig is not None
        and len(view.residuals_left)
        and len(view.residuals_right)
    ):
        sizes = {"left": rig.left.size_px, "right": rig.right.size_px}
        yield ("calibration", captions.RESIDUALS, lambda: figures.residual_map(view, sizes))
    if view is not None and len(view.holdout_mm) > 1:
        yield ("calibration", captions.HOLDOUT, lambda: figures.holdout(view))
    for number_of, comparison in enumerate(content.comparisons):
        if np.isfinite(comparison.optical_mm).any():
            caption = f"{clean(comparison.sensor, 60)}: {captions.SENSOR}"
            yield ("comparison", caption, _bound(figures.overlay, comparison, number_of))
