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
    pick, weight = np.zeros((t_s.size, 4), np.int64), np.zeros((t_s.size, 4))
    if seen.size >= 2:
        gap = LARGEST_GAP * float(np.median(np.diff(track_t_s)))
        rows, weight = _neighbours(track_t_s[seen], t_s, gap)
        pick = seen[rows]
    good: Bools = np.any(weight != 0, axis=1)
    nearest = np.abs(track_t_s[None] - t_s[:, None]).argmin(axis=1)
    view = _take(track, pick, weight, good)
    flagged = (track.state[pick] == State.FLAGGED) & (weight != 0)
    missing = np.where(track.state[nearest] <= State.FLAGGED, State.HIDDEN, track.state[nearest])
    found = np.where(flagged.any(axis=1), int(State.FLAGGED), int(State.SEEN))
    state = np.where(good, found, missing).astype(np.int64)
    return View(view.centre_px, view.centre_cov_px2, view.corners_px, view.corners_cov_px2, state)


def _neighbours(times: Floats, t_s: Floats, gap: float) -> tuple[Ints, Floats]:
    """Rows and Lagrange weights (N, 4) of the observations around each t; zeros across a gap."""
    after = np.clip(np.searchsorted(times, t_s), 1, times.size - 1)
    pair = np.stack([after - 1, after], axis=1)
    last = max(times.size - 4, 0)
    four = np.clip(after - 2, 0, last)[:, None] + np.arange(min(4, times.size))
    whole = np.diff(times[four], axis=1).max(axis=1) <= gap
    inside = (times[pair[:, 0]] < t_s) & (t_s < times[pair[:, 1]])
    inside &= np.diff(times[pair], axis=1)[:, 0] <= gap
    rows, weight = np.zeros((t_s.size, 4), np.int64), np.zeros((t_s.size, 4))
    for chosen, nodes in ((inside & whole, four), (inside & ~whole, pair)):
        k = nodes.shape[1]
        rows[chosen, :k] = nodes[chosen]
        weight[chosen, :k] = _lagrange(times[nodes[chosen]], t_s[chosen])
    for k in (1, 0):
        same = np.abs(times[pair[:, k]] - t_s) < SAME_INSTANT_S
        rows[same] = pair[same, k, None]
        weight[same] = [1.0, 0.0, 0.0, 0.0]
    return rows, weight


def _lagrange(nodes: Floats, t_s: Floats) -> Floats:
    """Weights (N, K) of the polynomial through K nodes (N, K) at t (N,)."""
    k = nodes.shape[1]
    away = ~np.eye(k, dtype=np.bool_)
    top = np.where(away, (t_s[:, None] - nodes)[:, None, :], 1.0)
    bottom = np.where(away, nodes[:, :, None] - nodes[:, None, :], 1.0)
    out: Floats = np.prod(top / bottom, axis=2)
    return out


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
