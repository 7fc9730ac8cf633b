"""The right camera's view of a marker at the instants at which the left camera saw it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.signals import State
from olivevib.tracking import Track

SAME_INSTANT_S = 2e-6  # closer observations are taken as they are
LARGEST_GAP = 1.6  # frame periods between the neighbours that are interpolated


@dataclass(frozen=True)
class View:
    """One marker as one camera saw it at N instants; NaN where it was not seen."""

    centre_px: Floats  # (N, 2)
    centre_cov_px2: Floats  # (N, 2, 2)
    corners_px: Floats  # (N, 4, 2)
    corners_cov_px2: Floats  # (N, 8, 8)
    state: Ints  # (N,)


def as_seen(track: Track) -> View:
    """The track's own observations."""
    return View(
        track.centre_px, track.centre_cov_px2, track.corners_px, track.corners_cov_px2, track.state
    )


def same_count(track: Track, frames: Ints) -> View:
    """The observations of the frames with the same count (the paper's synchronous pairs)."""
    row = {int(f): k for k, f in enumerate(track.frame)}
    pick = np.array([row.get(int(f), -1) for f in frames], dtype=np.int64)
    return _take(track, pick[:, None], np.ones((frames.size, 1)), pick >= 0)


def at_times(track: Track, track_t_s: Floats, t_s: Floats) -> View:
    """The marker at the times ``t_s`` (N,), between this camera's observations at track_t_s.

    Cubic through four neighbours (one-sided at the ends), linear through two beside a gap, nothing
    across one. A motion above half the frame rate is not followed by any interpolation: who calls
    must know the band. Covariances are those of independent neighbours.
    """
    seen = np.flatnonzero(np.isfinite(track.centre_px[:, 0]))
    n = t_s.size
    pick, weight = np.zeros((n, 4), np.int64), np.zeros((n, 4))
    good = np.zeros(n, dtype=np.bool_)
    if seen.size >= 2:
        period = float(np.median(np.diff(track_t_s)))
        times = track_t_s[seen]
        after = np.clip(np.searchsorted(times, t_s), 1, seen.size - 1)
        for k in range(n):
            choice = _neighbours(times, int(after[k]), float(t_s[k]), LARGEST_GAP * period)
            if choice is not None:
                rows, w = choice
                pick[k, : len(rows)], weight[k, : len(rows)] = seen[rows], w
                good[k] = True
    nearest = np.abs(track_t_s[None] - t_s[:, None]).argmin(axis=1)
    view = _take(track, pick, weight, good)
    flagged = (track.state[pick] == State.FLAGGED) & (weight != 0)
    missing = np.where(track.state[nearest] <= State.FLAGGED, State.HIDDEN, track.state[nearest])
    found = np.where(flagged.any(axis=1), int(State.FLAGGED), int(State.SEEN))
    state = np.where(good, found, missing).astype(np.int64)
    return View(view.centre_px, view.centre_cov_px2, view.corners_px, view.corners_cov_px2, state)


def _neighbours(
    times: Floats, after: int, t: float, gap: float
) -> tuple[list[int], list[float]] | None:
    """Rows and Lagrange weights of the observations around t, or None across a gap."""
    for k in (after - 1, after):
        if abs(times[k] - t) < SAME_INSTANT_S:
            return [k], [1.0]
    a, b = after - 1, after
    if not times[a] < t < times[b] or times[b] - times[a] > gap:
        return None
    first = min(max(a - 1, 0), max(times.size - 4, 0))
    rows = list(range(first, min(first + 4, times.size)))
    if np.diff(times[rows]).max() > gap:
        rows = [a, b]
    nodes = times[rows]
    weights = [
        float(np.prod((t - np.delete(nodes, j)) / (nodes[j] - np.delete(nodes, j))))
        for j in range(len(rows))
    ]
    return rows, weights


def _take(track: Track, pick: Ints, weight: Floats, good: Bools) -> View:
    """Weighted sums over the picked rows (N, K); NaN where not good."""

    def mix(values: Floats, w: Floats) -> Floats:
        extra = (1,) * (values.ndim - 1)
        terms = np.where(
            w.reshape(*w.shape, *extra) != 0, values[pick] * w.reshape(*w.shape, *extra), 0.0
        )
        out: Floats = terms.sum(axis=1)
        out[~good] = np.nan
        return out

    state = np.where(good, track.state[pick[:, 0]], int(State.DROPPED))
    return View(
        mix(track.centre_px, weight),
        mix(track.centre_cov_px2, weight**2),
        mix(track.corners_px, weight),
        mix(track.corners_cov_px2, weight**2),
        state.astype(np.int64),
    )
