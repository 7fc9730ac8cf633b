"""Tracks of both cameras to sightings, each point with its own raw row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.reconstruction.motion.drawing import Pattern, drawn, nodes
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations, Sightings
from olivevib.signals import State
from olivevib.tracking import Track

FEWEST = 40  # frames in each camera below which a marker is left out


def observe(
    left: Sequence[Track],
    right: Sequence[Track],
    corners_mm: Mapping[int, Floats],
    row_times_s: tuple[float, float] = (0.0, 0.0),
    patterns: Mapping[int, Pattern] | None = None,
) -> Observations:
    """Sightings of every marker that both cameras tracked; flagged samples are left out.

    corners_mm: for each id the corners (4, 3) in the marker's frame; row_times_s: the (left, right)
    row times with which Track.t_s was made, so that the frame's own time can be restored. patterns:
    of the markers whose tracks come from a drawing fitted to the whole marker; the corners of
    others were each seen by itself.
    Raises ValueError where no marker was seen often enough by both.
    """
    pairs = {t.id: [t] for t in left}
    for track in right:
        if track.id in pairs:
            pairs[track.id].append(track)
    markers, skipped = [], []
    for id_, tracks in sorted(pairs.items()):
        views = [sightings(t, row) for t, row in zip(tracks, row_times_s, strict=False)]
        if len(views) == 2 and min(v.frame.size for v in views) >= FEWEST:
            marker = MarkerSightings(id_, corners_mm[id_], views[0], views[1])
            pattern = None if patterns is None else patterns.get(id_)
            markers.append(marker if pattern is None else _by_drawing(marker, pattern))
        else:
            skipped.append(id_)
    if not markers:
        raise ValueError(f"no marker was seen in {FEWEST} frames by both cameras")
    return gather(tuple(markers), tuple(skipped))


def gather(markers: tuple[MarkerSightings, ...], skipped: tuple[int, ...] = ()) -> Observations:
    """Observations with the frame rate and the mean row that the sightings show."""
    views = [v for m in markers for v in (m.left, m.right)]
    rows = np.concatenate([v.row.ravel() for v in views])
    steps = [np.diff(v.row_zero_s) / np.maximum(np.diff(v.frame), 1) for v in views]
    rate = 1.0 / float(np.median(np.concatenate(steps)))
    return Observations(markers, rate, float(rows.mean()), skipped)


def sightings(track: Track, row_time_s: float) -> Sightings:
    """One track's sound samples; a corner's raw row is the centre's plus its distance down."""
    good = (track.state == State.SEEN) & np.isfinite(track.centre_px[:, 0])
    good &= np.isfinite(track.corners_px).all(axis=(1, 2))
    good &= np.isfinite(track.corners_cov_px2).all(axis=(1, 2))
    px, centre = track.corners_px[good], track.centre_px[good]
    row = track.raw_row[good, None] + px[:, :, 1] - centre[:, None, 1]
    zero = track.t_s[good] - row_time_s * track.raw_row[good]
    return Sightings(
        track.frame[good], zero, row, px, track.corners_cov_px2[good], track.exposure_s[good]
    )


def _by_drawing(marker: MarkerSightings, pattern: Pattern) -> MarkerSightings:
    """The marker as its fitted drawing reports it, by its nodes."""
    stones = marker.points_mm[:, :2] / pattern.module_mm
    views = []
    for view in (marker.left, marker.right):
        fitted = drawn(pattern.dark, stones, view.px)
        above = (view.row - view.px[..., 1]).mean(axis=1, keepdims=True)
        views.append(replace(view, row=above + fitted.px[..., 1], drawn=fitted))
    places = pattern.module_mm * nodes(len(pattern.dark))
    flat = np.column_stack([places, np.zeros(len(places))])
    return replace(marker, left=views[0], right=views[1], nodes_mm=flat)
