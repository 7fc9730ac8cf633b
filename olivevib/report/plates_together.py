"""The figures of markers together: response over frequency, deflection shape, rotation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from olivevib.report import figures
from olivevib.report.content import ReportContent
from olivevib.report.words import number

Job = tuple[str, str, Callable[[], str]]  # section, caption, what draws it
TURNED = 4  # markers whose rotation is drawn


def response_jobs(content: ReportContent) -> Iterator[Job]:
    """H1 with phase and coherence of the markers that follow the reference best.

    Of motions that were fitted: size and phase of the fitted ratio, at the lines.
    """
    survey = content.survey
    all_of_them = survey.transmissions if survey is not None else ()
    at_lines = figures.at_lines(all_of_them)
    if at_lines:
        caption = _AT_LINES.format(reference=at_lines[0].reference)
        yield (
            "transmissibility",
            caption,
            partial(figures.line_responses, at_lines, content.names()),
        )
    found = figures.shown_responses(all_of_them)
    if found:
        segments = min(t.curve.segments for t in found)
        caption = _RESPONSE.format(reference=found[0].reference, segments=segments,
                                   noise=number(1 / max(1, segments), 2))  # fmt: skip
        yield "transmissibility", caption, partial(figures.responses, found, content.names())


def body_jobs(content: ReportContent, largest_first: Sequence[int]) -> Iterator[Job]:
    """The deflection shape, and the rotation of the markers that move most."""
    path, survey, names = content.shown_path, content.survey, content.names()
    if path is None or survey is None:
        return
    shape = survey.deflection
    if shape is not None and len(shape.ids) > 1:
        yield "orbits", _SHAPE, partial(figures.deflection, shape, path, names)
    turned = [i for i in largest_first if figures.turns_of(path, i) is not None][:TURNED]
    if turned:
        yield "orbits", _ROTATION, partial(figures.rotations, path, names, sorted(turned))


_RESPONSE = (
    "Response of each marker to marker {reference} over the whole trial, axis by axis: size and"
    " phase of H1, and coherence. Thin grey: coherence below 0.8, not to be trusted; noise alone"
    " gives {noise} ({segments} segments). Frequencies are as sampled."
)
_AT_LINES = (
    "Response of each marker to marker {reference} at the lines of the fitted motion, axis by axis:"
    " ratio of the fitted complex amplitudes, size and phase. Bars: one standard deviation of the"
    " fit, times and frequency included. Nothing stands between the lines, and there is no"
    " coherence: fitted motions cohere because they were fitted."
)
_SHAPE = (
    "The shape in which the markers move at their common line. Square: mean place; ellipse: the"
    " marker's path, enlarged as said; dot: all markers at one instant."
)
_ROTATION = (
    "Turns of the markers that move most about their mean attitude, in the axes of the paths: with"
    " the displacement above, all six degrees of freedom. One scale a row; a gap is a gap."
)
