"""Location bars to hypotheses of a marker: two of the four bars are enough.

Two opposite bars, or two adjacent ones, fix an affine frame: centre and the images a, b of one
module to the right and down. Under a steep view two bars are thin lines, of which blur joins one
to the code, and the others are blobs without a direction: one line and the blobs beside its ends
will do. Bars found where a hypothesis expects them support it. A false hypothesis costs a reading
of its code; none is refused for want of a third bar.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from olivevib.arrays import Bools, Floats, Ints
from olivevib.detection.domains import Bars
from olivevib.marker import MarkerLayout

SHORTEST_PX = 4.0  # of a bar that founds a hypothesis
SLENDER = 1.8  # its length over its thickness
LENGTHS = 1.3  # ratio of two opposite bars, at most
FARTHEST = 2.4  # lengths between two bars: 1.43 face on, more where a tilt shortens them
PLACE = (0.11, 0.6)  # a bar's centroid is within .11 lengths + .6 px of its place
SINE = 0.25  # between adjacent bars, at least
THIN = (9.0, 20.0)  # length over thickness, and length in px, of a line under a steep view
BESIDE = (2.5, 0.35)  # blobs lie 2.5 thicknesses to .35 lengths from the line of such a bar
NEAR = (1.2, 0.6)  # of its lengths: how far their middles may be from its own, how long they are
EVEN = (0.2, 0.1, 0.3)  # of what is expected: distance of blobs, their slant and shift in lengths


@dataclass(frozen=True)
class Frames:
    """Affine frames (F,): centre (F, 2) px, a and b (F, 2) px a module, bars that support each.

    (a, b) turns clockwise on the screen as (right, down) does.
    """

    centre: Floats
    a: Floats
    b: Floats
    support: Ints

    def __len__(self) -> int:
        return self.support.size

    def only(self, keep: Bools | Ints) -> Frames:
        """The frames ``keep`` alone, in that order."""
        return Frames(self.centre[keep], self.a[keep], self.b[keep], self.support[keep])

    def homographies(self) -> Floats:
        """The frames as (F, 3, 3), centred modules to px."""
        H = np.zeros((len(self), 3, 3))
        H[:, :2, 0], H[:, :2, 1], H[:, :2, 2] = self.a, self.b, self.centre
        H[:, 2, 2] = 1
        return H


def joined(parts: list[Frames]) -> Frames:
    """Several sets of frames as one."""
    return Frames(
        np.concatenate([p.centre for p in parts]),
        np.concatenate([p.a for p in parts]),
        np.concatenate([p.b for p in parts]),
        np.concatenate([p.support for p in parts]),
    )


def frame_hypotheses(bars: Bars, layout: MarkerLayout) -> Frames:
    """Every frame that two bars found, or one and the blobs beside it, best supported first."""
    founders = (bars.length >= SHORTEST_PX) & (bars.length >= SLENDER * bars.width)
    few = bars.only(founders)
    if not len(few):
        none = np.empty((0, 2))
        return Frames(none, none, none, np.empty(0, np.int64))
    i, j = _neighbours(few)
    parts = [_opposite(few, i, j, layout), _adjacent(few, i, j, layout), _steep(bars, layout)]
    frames = joined(parts)
    frames = _clockwise(frames)
    support = _support(frames, bars, layout)
    frames = Frames(frames.centre, frames.a, frames.b, support)
    return frames.only(np.argsort(-support, kind="stable"))


def _neighbours(bars: Bars) -> tuple[Ints, Ints]:
    """Pairs i < j closer than ``FARTHEST`` lengths of the longer one."""
    tree = cKDTree(bars.centre, balanced_tree=False, compact_nodes=False)
    near = tree.query_ball_point(bars.centre, FARTHEST * bars.length, return_sorted=False)
    i = np.repeat(np.arange(len(bars)), [len(n) for n in near])
    j = np.fromiter(itertools.chain.from_iterable(near), np.int64, i.size)
    L = bars.length
    longer = (L[i] > L[j]) | ((L[i] == L[j]) & (i < j))  # each pair once, from its longer bar
    i, j = i[longer], j[longer]
    return np.minimum(i, j), np.maximum(i, j)


def _opposite(bars: Bars, i: Ints, j: Ints, layout: MarkerLayout) -> Frames:
    """Parallel bars of like length, side by side."""
    Li, Lj = bars.length[i], bars.length[j]
    axis_i, axis_j = bars.axis[i], bars.axis[j]
    sine, cosine = np.abs(_cross(axis_i, axis_j)), np.abs((axis_i * axis_j).sum(axis=1))
    L = (Li + Lj) / 2
    keep = (np.maximum(Li, Lj) < LENGTHS * np.minimum(Li, Lj)) & (sine < (0.14 + 1.2 / L) * cosine)
    i, j, L, axis_i, axis_j = i[keep], j[keep], L[keep], axis_i[keep], axis_j[keep]
    same = np.sign((axis_i * axis_j).sum(axis=1))[:, None]
    u = (bars.length[i, None] * axis_i + same * bars.length[j, None] * axis_j) / 2
    d = bars.centre[j] - bars.centre[i]
    along = u / np.linalg.norm(u, axis=1, keepdims=True)
    apart = np.abs(_cross(along, d))
    shift = np.abs((along * d).sum(axis=1))
    thick = (bars.width[i] + bars.width[j]) / 2
    keep = (apart > np.maximum(2.5, 3 * thick)) & (apart < np.minimum(22 * thick, FARTHEST * L))
    keep &= (shift < 1.5 * L) & (np.hypot(apart, shift) < FARTHEST * L)
    i, j, u, d = i[keep], j[keep], u[keep], d[keep]
    centre = (bars.centre[i] + bars.centre[j]) / 2
    return Frames(centre, u / layout.bar, d / (layout.modules - 1), np.full(i.size, 2))


def _adjacent(bars: Bars, i: Ints, j: Ints, layout: MarkerLayout) -> Frames:
    """Bars whose axes meet where a cornerstone of both should be."""
    half = (layout.modules - 1) / 2
    sine = _cross(bars.axis[i], bars.axis[j])
    keep = np.abs(sine) >= SINE
    i, j, sine = i[keep], j[keep], sine[keep]
    between = bars.centre[j] - bars.centre[i]
    ahead = _cross(between, bars.axis[j]) / sine
    back = _cross(between, bars.axis[i]) / sine
    Li, Lj = bars.length[i], bars.length[j]
    keep = np.abs(np.abs(ahead) - half / layout.bar * Li) < PLACE[0] * Li + PLACE[1]
    keep &= np.abs(np.abs(back) - half / layout.bar * Lj) < PLACE[0] * Lj + PLACE[1]
    i, j = i[keep], j[keep]
    corner = bars.centre[i] + ahead[keep, None] * bars.axis[i]
    a, b = (bars.centre[i] - corner) / half, (bars.centre[j] - corner) / half
    return Frames(bars.centre[i] + bars.centre[j] - corner, a, b, np.full(i.size, 2))


def _steep(bars: Bars, layout: MarkerLayout) -> Frames:
    """A thin bar and two domains of any shape where the bars beside its ends are."""
    half = (layout.modules - 1) / 2
    thin = np.flatnonzero((bars.length >= THIN[0] * bars.width) & (bars.length >= THIN[1]))
    tree = cKDTree(bars.centre, balanced_tree=False, compact_nodes=False)
    reach = NEAR[0] * bars.length[thin]
    near = tree.query_ball_point(bars.centre[thin], reach, return_sorted=False)
    of = np.repeat(thin, [len(n) for n in near])
    blob = np.fromiter(itertools.chain.from_iterable(near), np.int64, of.size)
    L, axis, d = bars.length[of], bars.axis[of], bars.centre[blob] - bars.centre[of]
    along, across = (axis * d).sum(axis=1) / L, _cross(axis, d) / L
    keep = (np.abs(across) * L > BESIDE[0] * bars.width[of]) & (np.abs(across) < BESIDE[1])
    keep &= bars.length[blob] < NEAR[1] * L
    of, blob, along, across = of[keep], blob[keep], along[keep], across[keep]
    first, last = _each_with_each(of, along < 0)
    apart = 2 * half / layout.bar
    keep = np.abs(along[last] - along[first] - apart) < EVEN[0] * apart
    keep &= across[first] * across[last] > 0
    keep &= np.abs(across[first] - across[last]) < EVEN[1]
    keep &= np.abs(along[first] + along[last]) / 2 < EVEN[2]
    first, last = first[keep], last[keep]
    one, other = bars.centre[blob[first]], bars.centre[blob[last]]
    centre = (one + other) / 2
    b = (centre - bars.centre[of[first]]) / half
    return Frames(centre, (other - one) / (2 * half), b, np.full(first.size, 3))


def _each_with_each(group: Ints, left: Bools) -> tuple[Ints, Ints]:
    """All pairs of a left and a right member of the same group, as places in ``group`` (rising)."""
    lefts, rights = np.flatnonzero(left), np.flatnonzero(~left)
    start = np.searchsorted(group[rights], group[lefts], side="left")
    count = np.searchsorted(group[rights], group[lefts], side="right") - start
    first = np.repeat(lefts, count)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return first, rights[np.repeat(start, count) + step]


def _clockwise(frames: Frames) -> Frames:
    turn = np.where(_cross(frames.a, frames.b) < 0, -1.0, 1.0)[:, None]
    return Frames(frames.centre, frames.a, turn * frames.b, frames.support)


def _support(frames: Frames, bars: Bars, layout: MarkerLayout) -> Ints:
    """At how many of the four places of bars (F,) there is a domain that may be one."""
    if len(frames) == 0:
        return frames.support
    half = (layout.modules - 1) / 2
    tree = cKDTree(bars.centre, balanced_tree=False, compact_nodes=False)
    total = np.zeros(len(frames), np.int64)
    for way, along in ((frames.a, frames.b), (frames.b, frames.a)):
        for sign in (-1, 1):
            place = frames.centre + sign * half * way
            far, at = tree.query(place)
            wanted = layout.bar * along
            length = np.linalg.norm(wanted, axis=1)
            reach = PLACE[0] * layout.bar * np.linalg.norm(way, axis=1) + PLACE[1]
            found = far < np.maximum(reach, PLACE[0] * length + PLACE[1])
            slender = bars.length[at] > 2.2 * bars.width[at]
            turned = np.abs(_cross(bars.axis[at], wanted)) >= 0.35 * length
            wrong = np.abs(bars.length[at] - length) > 0.43 * length
            total += found & ~(slender & (turned | wrong))
    return total


def _cross(a: Floats, b: Floats) -> Floats:
    out: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
