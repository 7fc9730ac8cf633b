"""Location bars to candidate markers: pairs and closed loops of four (paper, 3.1 steps 4, 5)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from olivevib.arrays import Bools, Floats, Ints
from olivevib.detection.domains import Bars
from olivevib.detection.settings import DetectionSettings

MOST_PATHS = 4_000_000  # two-step paths looked at; beyond it the longest bars are left out
SMALLEST_AREA = 30.0  # px² of the quadrilateral of cornerstones


@dataclass(frozen=True)
class Candidates:
    """Loops of four bars: bars (M, 4), index of each in clockwise order on the screen, and
    cornerstones (M, 4, 2) px; cornerstone k is where the axes of bars k - 1 and k meet.
    """

    bars: Ints
    corners: Floats


@dataclass(frozen=True)
class _Pairs:
    """Directed bar pairs i -> j (E,): side (E,) says whether their axes meet ahead of C_i (+1
    along U_i) or behind it (-1).
    """

    i: Ints
    j: Ints
    side: Ints


def candidate_loops(bars: Bars, settings: DetectionSettings, shape: tuple[int, int]) -> Candidates:
    """Every loop of four bars that may be a marker, once each.

    Bars follow head to tail (eq. 2): each bar lies between its two cornerstones. Loops that are
    not convex, smaller than 30 px² or not wholly in the image (height, width) are left out.
    """
    loops = _loops(_pairs(bars, settings), len(bars))
    if loops.size == 0:
        return Candidates(np.empty((0, 4), np.int64), np.empty((0, 4, 2)))
    corners = _meeting(bars, np.roll(loops, 1, axis=1), loops)
    sign = np.sign(_signed_area(corners))  # the marker sign m_sign, eq. 3
    loops = np.where(sign[:, None] < 0, loops[:, [0, 3, 2, 1]], loops)
    corners = np.where(sign[:, None, None] < 0, corners[:, [1, 0, 3, 2]], corners)
    good = _sensible(corners, shape)
    return Candidates(loops[good], corners[good])


def _pairs(bars: Bars, settings: DetectionSettings) -> _Pairs:
    """Both directions of every pair that keeps the distance and the angle criterion."""
    if len(bars) < 4:
        return _Pairs(*(np.empty(0, np.int64) for _ in range(3)))
    tree = cKDTree(bars.centre)
    near = tree.query_ball_point(bars.centre, settings.pos * bars.length, return_sorted=False)
    i = np.repeat(np.arange(len(bars)), [len(n) for n in near])
    j = np.fromiter(itertools.chain.from_iterable(near), np.int64, i.size)
    longer = (bars.length[i] > bars.length[j]) | ((bars.length[i] == bars.length[j]) & (i < j))
    sine = np.abs(_cross(bars.axis[i], bars.axis[j]))
    keep = longer & (sine >= np.sin(np.radians(settings.angle_deg)))
    i, j = i[keep], j[keep]
    i, j = np.concatenate([i, j]), np.concatenate([j, i])
    between = bars.centre[j] - bars.centre[i]
    ahead = _cross(between, bars.axis[j]) / _cross(bars.axis[i], bars.axis[j])
    return _Pairs(i, j, np.where(ahead > 0, 1, -1))


def _loops(pairs: _Pairs, count: int) -> Ints:
    """Bars (M, 4) in loop order; the first is the smallest index, the second below the fourth."""
    first, middle, last, side_first, side_last = _paths(pairs, count)
    key = first * count + last
    order = np.lexsort((middle, key))
    first, middle, last, key = first[order], middle[order], last[order], key[order]
    side_first, side_last = side_first[order], side_last[order]
    found = []
    step = 1
    while step < key.size:
        same = key[step:] == key[:-step]
        if not same.any():
            break
        a = np.flatnonzero(same)
        b = a + step
        head_to_tail = (side_first[a] != side_first[b]) & (side_last[a] != side_last[b])
        a, b = a[head_to_tail], b[head_to_tail]
        found.append(np.column_stack([first[a], middle[a], last[a], middle[b]]))
        step += 1
    return np.concatenate(found) if found else np.empty((0, 4), np.int64)


def _paths(pairs: _Pairs, count: int) -> tuple[Ints, Ints, Ints, Ints, Ints]:
    """Paths i - j - k through the two ends of bar j, i smallest; and the sides taken at i and k."""
    order = np.argsort(pairs.i, kind="stable")
    at, to, side = pairs.i[order], pairs.j[order], pairs.side[order]
    back = _reverse_side(pairs, count)[order]
    starts = np.searchsorted(at, np.arange(count + 1))
    degree = np.diff(starts)
    one = np.flatnonzero(degree[at] <= _most_neighbours(degree))
    counts = degree[at[one]]
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    two = np.repeat(starts[at[one]], counts) + place
    one = np.repeat(one, counts)
    i, j, k = to[one], at[one], to[two]
    keep = (i < k) & (i < j) & (side[one] != side[two])
    one, two = one[keep], two[keep]
    return i[keep], j[keep], k[keep], back[one], back[two]


def _most_neighbours(degree: Ints) -> int:
    """How many neighbours a bar may have so that all paths through such bars can be looked at."""
    rising = np.sort(degree)
    fits = rising[np.cumsum(rising**2) <= MOST_PATHS]
    return int(fits[-1]) if fits.size else 0


def _reverse_side(pairs: _Pairs, count: int) -> Ints:
    """For each directed pair i -> j the side on which the axes meet as seen from j."""
    key = pairs.i * count + pairs.j
    reverse = pairs.j * count + pairs.i
    order = np.argsort(key)
    out: Ints = pairs.side[order[np.searchsorted(key[order], reverse)]]
    return out


def _meeting(bars: Bars, i: Ints, j: Ints) -> Floats:
    """Where the axes of bars i and j (any shape) meet, (..., 2) px."""
    between = bars.centre[j] - bars.centre[i]
    ahead = _cross(between, bars.axis[j]) / _cross(bars.axis[i], bars.axis[j])
    out: Floats = bars.centre[i] + ahead[..., None] * bars.axis[i]
    return out


def _signed_area(corners: Floats) -> Floats:
    """Area (M,) of quadrilaterals (M, 4, 2), positive clockwise on the screen (y down)."""
    out: Floats = 0.5 * _cross(corners, np.roll(corners, -1, axis=1)).sum(axis=1)
    return out


def _sensible(corners: Floats, shape: tuple[int, int]) -> Bools:
    sides = np.roll(corners, -1, axis=1) - corners
    convex = (_cross(sides, np.roll(sides, -1, axis=1)) > 0).all(axis=1)
    limit = np.array([shape[1], shape[0]], dtype=np.float64) - 1
    inside = ((corners >= 0) & (corners <= limit)).all(axis=(1, 2))
    out: Bools = convex & inside & (_signed_area(corners) >= SMALLEST_AREA)
    return out


def _cross(a: Floats, b: Floats) -> Floats:
    out: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
