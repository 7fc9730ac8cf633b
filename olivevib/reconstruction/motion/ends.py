"""Start-up and shut-down that a search by windows of a second has left in a steady record.

A machine that stops within the last half second of a recording changes its speed where no window
fits any more. The steady line and a spline describe the pixels of the steady part to their noise;
frames at either end that they miss by far are the ramp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools
from olivevib.reconstruction.motion.observe import FEWEST, gather
from olivevib.reconstruction.motion.pixels import look
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations, Sightings
from olivevib.reconstruction.motion.wander import PixelLine

KNOT_S = 0.2
BIN_S = 0.1
FAR = 4.0  # rms of an end's bin over that of the usual bin: it is no part of the steady motion
LONGEST_S = 1.0  # that is cut at an end; what misses for longer is no ramp
ROUNDS = 12

Span = tuple[float, float]


@dataclass(frozen=True)
class Ends:
    """What is left of the record of each camera, on its own clock of raw row 0, s."""

    left: Span
    right: Span

    def of(self, observations: Observations) -> Observations:
        """The sightings inside; ValueError where no marker is seen often enough there."""
        markers = [
            replace(m, left=_within(m.left, self.left), right=_within(m.right, self.right))
            for m in observations.markers
        ]
        often = [m for m in markers if min(m.left.frame.size, m.right.frame.size) >= FEWEST]
        if not often:
            raise ValueError(f"no marker was seen in {FEWEST} frames by both cameras")
        kept = {m.id for m in often}
        seldom = [m.id for m in markers if m.id not in kept]
        return gather(tuple(often), (*observations.skipped, *seldom))


def steady_ends(observations: Observations) -> Ends | None:
    """Where the steady motion ends in each camera; None where nothing has to be cut."""
    whole = ends = Ends(_span(observations, "left"), _span(observations, "right"))
    for _ in range(ROUNDS):
        try:
            inside = ends.of(observations)
            peaks = look(inside, KNOT_S, 2).peaks_hz
        except ValueError:
            return None
        if not peaks:
            return None
        shorter = Ends(
            _shorter(inside.markers, "left", peaks[0], ends.left),
            _shorter(inside.markers, "right", peaks[0], ends.right),
        )
        if shorter == ends:
            return None if ends == whole else ends
        ends = shorter
        cuts = [
            abs(a - b)
            for mine, all_ in ((ends.left, whole.left), (ends.right, whole.right))
            for a, b in zip(mine, all_, strict=True)
        ]
        if max(cuts) > LONGEST_S:
            return None
    return ends


def _shorter(markers: tuple[MarkerSightings, ...], side: str, peak_hz: float, span: Span) -> Span:
    """The span less the bins at its ends that the steady line misses by far, and a bin more."""
    count = max(1, round((span[1] - span[0]) / BIN_S))
    edges = np.linspace(*span, count + 1)
    squares, frames = np.zeros(count), np.zeros(count)
    for marker in markers:
        view: Sightings = getattr(marker, side)
        line = PixelLine.of(view, KNOT_S)
        rest = line.rest(2 * np.pi * peak_hz * (line.t_s - 0.5 * sum(span)))
        at = np.clip(np.searchsorted(edges, line.t_s, side="right") - 1, 0, count - 1)
        squares += np.bincount(at, np.mean(rest**2, axis=1), count)
        frames += np.bincount(at, minlength=count)
    size = np.sqrt(squares / np.maximum(frames, 1))
    far = size > FAR * np.median(size[frames > 0])
    first, last = _run(far), count - _run(far[::-1])
    return float(edges[min(first, count)]), float(edges[max(last, 0)])


def _run(far: Bools) -> int:
    """Bins to leave out at the beginning: those that are far without a break, and one more."""
    near = np.flatnonzero(~far)
    first = int(near[0]) if near.size else len(far)
    return first + 1 if first else 0


def _span(observations: Observations, side: str) -> Span:
    times = [getattr(m, side).row_zero_s for m in observations.markers]
    return float(min(t[0] for t in times)), float(max(t[-1] for t in times))


def _within(view: Sightings, span: Span) -> Sightings:
    """The sightings inside a span."""
    keep = (view.row_zero_s >= span[0]) & (view.row_zero_s <= span[1])
    drawn = view.drawn
    return replace(
        view,
        frame=view.frame[keep],
        row_zero_s=view.row_zero_s[keep],
        row=view.row[keep],
        px=view.px[keep],
        covariance_px2=view.covariance_px2[keep],
        exposure_s=view.exposure_s[keep],
        drawn=None if drawn is None else replace(drawn, px=drawn.px[keep]),
    )
