"""Start-up and shut-down that a search by windows of a second has left in a steady record.

A machine that stops within the last half second of a recording changes its speed where no window
fits any more; one that runs near the frame rate looks like sway to every window. One line and a
spline describe the pixels of the steady part to their noise; what they miss by far is a ramp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.reconstruction.motion.observe import FEWEST, gather
from olivevib.reconstruction.motion.pixels import look
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations, Sightings
from olivevib.reconstruction.motion.wander import PixelLine

KNOT_S = 0.2
BIN_S = 0.1
FAR = 4.0  # rms of an end's bin over that of the usual bin: it is no part of the steady motion
LONGEST_S = 1.0  # that is cut at an end; what misses for longer is no ramp
SHORTEST_S = 2.0  # that must be left
ROUNDS = 20
PARTS = ((1 / 3, 1.0), (0.0, 2 / 3), (1 / 6, 5 / 6))  # of a record that nothing describes whole
CLEAN = 2.0  # noise over the localiser's below which one line and a spline describe a part
WHOLE_S = 0.5  # so short a cut is made at once, of a longer one half: a ramp spoils its neighbours

Span = tuple[float, float]


@dataclass(frozen=True)
class Ends:
    """What is left of the record of each camera, on its own clock of raw row 0, s."""

    left: Span
    right: Span

    def part(self, first: float, last: float) -> Ends:
        """From a share of the record to another."""
        (a, b), (c, d) = self.left, self.right
        return Ends(
            (a + first * (b - a), a + last * (b - a)), (c + first * (d - c), c + last * (d - c))
        )

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


def steady_ends(observations: Observations, most_s: float = LONGEST_S) -> Ends | None:
    """Where the steady motion begins and ends in each camera; None where nothing is to be cut.

    most_s: that may be cut at an end; infinite where nobody knows yet when the machine ran: then
    the longest part that one line and a spline describe is taken. Where they describe the whole to
    nowhere near its noise, and a part of it well, rest or ramps were taken for steady: that part.
    """
    whole = Ends(_span(observations, "left"), _span(observations, "right"))
    found = _cut(observations, whole, most_s)
    if found is not None or _scatter(observations, whole) < CLEAN:
        return found
    parts = [whole.part(*share) for share in PARTS]
    parts = [_cut(observations, part, np.inf) or part for part in parts]
    scatter = [_scatter(observations, part) for part in parts]
    best = int(np.argmin(scatter))
    return parts[best] if scatter[best] < CLEAN else None


def _scatter(observations: Observations, ends: Ends) -> float:
    """Noise inside over the localiser's; infinite where that cannot be told."""
    try:
        seen = look(ends.of(observations), None, 2)
    except ValueError:
        return float("inf")
    return seen.scale if seen.peaks_hz else float("inf")


def _cut(observations: Observations, whole: Ends, most_s: float) -> Ends | None:
    """The part of ``whole`` that one line and a spline describe; None: all of it, or none."""
    ends = whole
    for _ in range(ROUNDS):
        try:
            inside = ends.of(observations)
            peaks = look(inside, KNOT_S, 2).peaks_hz
        except ValueError:
            return None
        if not peaks:
            return None
        shorter = Ends(
            _described(inside.markers, "left", peaks[0], ends.left),
            _described(inside.markers, "right", peaks[0], ends.right),
        )
        if shorter == ends:
            return None if ends == whole else ends
        ends = Ends(_nearer(ends.left, shorter.left), _nearer(ends.right, shorter.right))
        left = np.array([ends.left, ends.right])
        cut = np.abs(left - [whole.left, whole.right])
        if cut.max() > most_s or np.ptp(left, axis=1).min() < SHORTEST_S:
            return None
    return None


def _described(markers: tuple[MarkerSightings, ...], side: str, peak_hz: float, span: Span) -> Span:
    """The longest run of bins that the steady line describes, less a bin where it was cut."""
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
    steps = np.flatnonzero(np.diff(np.concatenate([[True], far, [True]]).astype(int)))
    first, last = max(zip(steps[::2], steps[1::2], strict=True), key=lambda run: run[1] - run[0])
    first, last = first + (first > 0), last - (last < count)
    return float(edges[first]), float(edges[max(last, first + 1)])


def _nearer(now: Span, asked: Span) -> Span:
    """Each end moved to what is asked if that is near, else half the way."""
    first, last = (
        b if abs(b - a) <= WHOLE_S else 0.5 * (a + b) for a, b in zip(now, asked, strict=True)
    )
    return first, last


def _span(observations: Observations, side: str) -> Span:
    times = [getattr(m, side).row_zero_s for m in observations.markers]
    return float(min(t[0] for t in times)), float(max(t[-1] for t in times))


def _within(view: Sightings, span: Span) -> Sightings:
    """The sightings inside a span."""
    return view.only((view.row_zero_s >= span[0]) & (view.row_zero_s <= span[1]))
