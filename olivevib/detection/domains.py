"""Connected dark domains of a black/white image, with area, centroid and second moments.

Domains are summed over horizontal runs instead of pixels: a run of m pixels with middle x adds
closed sums (m, m x, m x² + m (m² - 1)/12), the same as its pixels one by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats, Grey, Ints

SHORTEST = 1e-9  # px, below which a direction is not defined


@dataclass(frozen=True)
class Runs:
    """Horizontal runs of dark pixels: row, first column, last column, domain (R,)."""

    y: Ints
    first: Ints
    last: Ints
    domain: NDArray[np.int32]


@dataclass(frozen=True)
class Domains:
    """Dark domains under 8-connectivity; index 0 is the background and stays empty.

    area (D,) px; centre (D, 2) px; moments (D, 3): central xx, yy, xy per pixel, px², with the
    1/12 of a pixel's own area.
    """

    area: Floats
    centre: Floats
    moments: Floats
    runs: Runs


@dataclass(frozen=True)
class Bars:
    """Domains that may be location bars (paper, 3.1 step 2): the oriented rectangle of each.

    centre (N, 2) centroid C; axis (N, 2) unit vector U along the longer side; length W and width H
    (N,) px; area (N,) px; domain (N,) index in Domains.
    """

    centre: Floats
    axis: Floats
    length: Floats
    width: Floats
    area: Floats
    domain: Ints

    def __len__(self) -> int:
        return self.length.size

    def only(self, keep: Bools | Ints) -> Bars:
        """The bars ``keep`` alone, in that order."""
        return Bars(
            self.centre[keep],
            self.axis[keep],
            self.length[keep],
            self.width[keep],
            self.area[keep],
            self.domain[keep],
        )


def dark_domains(dark: Grey, area_px2: tuple[float, float] = (0, np.inf)) -> Domains:
    """Domains of the non-zero pixels of ``dark`` (H, W) uint8.

    Only those with an area within ``area_px2`` are measured; of others neither area nor runs stay.
    """
    count, labels = cv2.connectedComponents(dark, connectivity=8, ltype=cv2.CV_32S)
    runs = _runs(dark, np.asarray(labels, dtype=np.int32))
    pixels = np.bincount(runs.domain, runs.last - runs.first + 1, minlength=count)
    area = pixels.astype(np.float64)
    wanted = (area >= area_px2[0]) & (area <= area_px2[1])
    if not wanted.all():
        area = np.where(wanted, area, 0.0)
        keep = np.flatnonzero(wanted[runs.domain])
        runs = Runs(runs.y[keep], runs.first[keep], runs.last[keep], runs.domain[keep])
    return _measured(runs, area)


def _measured(runs: Runs, area: Floats) -> Domains:
    m = (runs.last - runs.first + 1).astype(np.float64)
    x = 0.5 * (runs.first + runs.last)
    y = runs.y.astype(np.float64)
    mx, my = m * x, m * y
    safe, domain = np.maximum(area, 1.0), runs.domain.astype(np.int64)

    def mean(values: Floats) -> Floats:
        total = np.bincount(domain, values, minlength=area.size)
        return np.asarray(total / safe, dtype=np.float64)

    cx, cy = mean(mx), mean(my)
    xx = mean(mx * x + m * (m * m - 1) / 12) - cx * cx + 1 / 12
    yy = mean(my * y) - cy * cy + 1 / 12
    xy = mean(mx * y) - cx * cy
    return Domains(area, np.column_stack([cx, cy]), np.column_stack([xx, yy, xy]), runs)


def _runs(dark: Grey, labels: NDArray[np.int32]) -> Runs:
    height, width = dark.shape
    padded = np.zeros(1 + height * (width + 1), dtype=np.bool_)  # a white pixel before each row
    rows = padded[1:].reshape(height, width + 1)
    np.not_equal(dark, 0, out=rows[:, :width])
    turns = np.flatnonzero(padded[1:] != padded[:-1])
    start, end = turns[0::2], turns[1::2]
    y = start // (width + 1)
    first = start - y * (width + 1)
    last = first + (end - start) - 1
    return Runs(y, first, last, labels.ravel()[start - y])


def principal_axes(moments: Floats) -> tuple[Floats, Floats, Floats]:
    """Larger and smaller variance (N,) and the unit vector (N, 2) of the larger, of (N, 3)."""
    xx, yy, xy = moments.T
    half = 0.5 * np.hypot(xx - yy, 2 * xy)
    mean = 0.5 * (xx + yy)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    return mean + half, mean - half, np.column_stack([np.cos(angle), np.sin(angle)])


def rectangles(domains: Domains, wanted: Ints) -> Bars:
    """Bounding rectangles along the principal axes of the domains ``wanted`` (N,), rising.

    Extents are largest minus smallest pixel plus one (a pixel is a square); the ends of the runs
    suffice. W >= H, U along W.
    """
    if wanted.size == 0:
        none = np.empty(0)
        return Bars(np.empty((0, 2)), np.empty((0, 2)), none, none, none, wanted)
    _, _, axis = principal_axes(domains.moments[wanted])
    rank = np.full(domains.area.size, -1)
    rank[wanted] = np.arange(wanted.size)
    runs = domains.runs
    of = rank[runs.domain]
    mine = np.flatnonzero(of >= 0)
    mine = mine[np.argsort(of[mine], kind="stable")]
    of = of[mine]
    starts = np.flatnonzero(np.diff(of, prepend=-1))
    centre = domains.centre[wanted]
    dy = runs.y[mine] - centre[of, 1]
    ends = np.stack([runs.first[mine] - centre[of, 0], runs.last[mine] - centre[of, 0]])
    along = _extent(ends * axis[of, 0] + dy * axis[of, 1], starts)
    across = _extent(dy * axis[of, 0] - ends * axis[of, 1], starts)
    swap = across > along
    axis[swap] = np.column_stack([-axis[swap, 1], axis[swap, 0]])
    length, width = np.maximum(along, across), np.minimum(along, across)
    return Bars(centre, axis, length, width, domains.area[wanted], wanted)


def _extent(values: Floats, starts: Ints) -> Floats:
    """Largest minus smallest plus one of values (2, R) within each group beginning at starts."""
    top = np.maximum.reduceat(values.max(axis=0), starts)
    low = np.minimum.reduceat(values.min(axis=0), starts)
    out: Floats = top - low + 1
    return out
