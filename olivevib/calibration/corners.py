"""Board points to a few hundredths of a pixel: each patch of the print fitted to the image.

A point is moved until the printed pattern around it, drawn through the board's homography (bent as
the lens bends it) and blurred as the camera blurs, explains the grey values best: least squares
with Tukey weights; gain and offset are planes over a patch. Markers within the patch help instead
of pulling, as they do with cornerSubPix.
Source: Lucas & Kanade, An iterative image registration technique, 1981; knowledge/detection 4.4.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats, Grey, Ints
from olivevib.calibration.artwork import Artwork, Image
from olivevib.calibration.warp import Warp, bent_warp, sane
from olivevib.detection.pixels import Singles

FIRST_BLUR_PX = 0.8  # Gaussian blur of a camera to begin with; one is chosen a view
MOST_PIXELS = 12_000  # of one view; larger patches are cut down, but not below the next
LEAST_PER_POINT = 400
FLOOR_PX = 0.02  # what no template knows: sharpening, compression, print
STILL_PX = 5e-3  # a step below this is the last
LEAST_PIXELS = 25  # of a patch
LEAST_NCC = 0.75
LEAST_GAIN = 10.0  # grey levels between white and black
OUTLIER_PX = 1.5  # from the other points' homography; lenses bend by less across a patch


@dataclass(frozen=True)
class Fitted:
    """Refined points: px (N, 2), sigma_px (N,), ok (N,) whether the print was really there."""

    px: Floats
    sigma_px: Floats
    ok: Bools


@dataclass(frozen=True)
class _Patches:
    """Pixels of all patches, sorted by point: index of the point, grey value, board place.

    In single precision, which is good to 1e-4 template pixels.
    """

    start: Ints  # (N,) first pixel of each point
    point: Ints
    grey: Singles
    board_mm: Singles  # (2, M) under the homography, before the points move
    local: Singles  # (2, M) the same from the middle of the patch, in units of its reach
    by_px: Singles  # (4, M) d board / d pixel: xx, xy, yx, yy

    @property
    def count(self) -> Floats:
        """Pixels (N,) of each patch."""
        return np.diff(np.append(self.start, self.point.size)).astype(np.float64)

    def thinned(self, step: int) -> _Patches:
        """Every ``step``-th pixel."""
        point = self.point[::step]
        start = np.searchsorted(point, np.arange(self.start.size))
        rest = (self.grey, self.board_mm, self.local, self.by_px)
        return _Patches(start, point, *(np.ascontiguousarray(p[..., ::step]) for p in rest))

    def sums(self, rows: Singles) -> Floats:
        """Sums (..., N) over the pixels of each point of ``rows`` (..., M)."""
        return np.asarray(np.add.reduceat(rows, self.start, axis=-1), dtype=np.float64)

    def each(self, values: Floats) -> Singles:
        """Values (N,) of the points at their pixels (M,)."""
        return np.asarray(values, dtype=np.float32)[self.point]


def refine(grey: Grey, artwork: Artwork, board_mm: Floats, px: Floats, reach_mm: Floats) -> Fitted:
    """Refine the images ``px`` (N, 2) of board points (N, 2), N >= 4 not in line.

    Points whose patch leaves the image, or where the print is not seen, come back with ok False.
    """
    n = len(px)
    start = Fitted(px, np.full(n, np.nan), np.ones(n, dtype=np.bool_))
    first = _round(_Task(grey, artwork, board_mm, reach_mm, MOST_PIXELS // 2), start, _rough)
    if first.ok.sum() < 4:
        return first
    predicted = bent_warp(board_mm[first.ok], first.px[first.ok]).forward(board_mm)
    far = np.linalg.norm(first.px - predicted, axis=1) > OUTLIER_PX
    again = np.where((far | ~first.ok)[:, None], predicted, first.px)
    begin = Fitted(again, first.sigma_px, first.ok & ~far)
    second = _round(_Task(grey, artwork, board_mm, reach_mm, MOST_PIXELS), begin, _fine)
    stray = np.linalg.norm(second.px - predicted, axis=1) > 2 * OUTLIER_PX
    return Fitted(second.px, second.sigma_px, second.ok & ~stray)


@dataclass(frozen=True)
class _Task:
    grey: Grey
    artwork: Artwork
    board_mm: Floats
    reach_mm: Floats
    pixels: int


def _round(
    task: _Task, start: Fitted, fit: Callable[[Artwork, _Patches, float], _Descent]
) -> Fitted:
    """One warp, its patches, and Gauss-Newton on the shift of every point."""
    n, board_mm, artwork = len(start.px), task.board_mm, task.artwork
    if start.ok.sum() < 4:
        return start
    warp = bent_warp(board_mm[start.ok], start.px[start.ok])
    base = warp.forward(board_mm)
    lost = Fitted(start.px, np.full(n, np.nan), np.zeros(n, dtype=np.bool_))
    at = np.flatnonzero(_inside(warp, task, start.px - base))
    if at.size == 0 or not sane(warp, board_mm):
        return lost
    patches, full = _patches(task, warp, at, (start.px - base)[at])
    at = at[full]
    if at.size == 0:
        return lost
    scale = artwork.px_per_mm * np.sqrt(
        abs(np.linalg.det(patches.by_px.mean(axis=1).reshape(2, 2)))
    )
    found = fit(artwork, patches, float(scale))
    px, sigma, ok = start.px.copy(), np.full(n, np.nan), np.zeros(n, dtype=np.bool_)
    ok[at] = found.good
    px[at[found.good]] = (start.px[at] + found.move)[found.good]
    sigma[at] = np.hypot(found.sigma_px, FLOOR_PX)
    return Fitted(px, sigma, ok)


_AROUND = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def _outlines(warp: Warp, board_mm: Floats, reach_mm: Floats, shift: Floats) -> Floats:
    """The corners of each patch in the image (N, 4, 2)."""
    around = board_mm[:, None] + reach_mm[:, None, None] * _AROUND
    out: Floats = warp.forward(around.reshape(-1, 2)).reshape(-1, 4, 2) + shift[:, None]
    return out


def _inside(warp: Warp, task: _Task, shift: Floats) -> Bools:
    """Whether the patch of each point lies wholly in the image (N,)."""
    px = _outlines(warp, task.board_mm, task.reach_mm, shift)
    limit = np.array([task.grey.shape[1] - 2, task.grey.shape[0] - 2])
    return np.asarray(((px >= 1) & (px <= limit)).all(axis=(1, 2)), dtype=np.bool_)


def _patches(task: _Task, warp: Warp, at: Ints, shift: Floats) -> tuple[_Patches, Bools]:
    """The pixels whose place on the board lies within the reach of a point, and which points."""
    board_mm = task.board_mm[at]
    area = (4 * task.reach_mm[at] ** 2 * np.abs(np.linalg.det(warp.jacobian(board_mm)))).sum()
    budget = max(task.pixels, LEAST_PER_POINT * at.size)
    reach_mm = task.reach_mm[at] * min(1.0, np.sqrt(budget / max(area, 1.0)))
    outline = _outlines(warp, board_mm, reach_mm, shift)
    low, high = np.ceil(outline.min(axis=1)), np.floor(outline.max(axis=1))
    middle = warp.forward(board_mm) + shift
    back = warp.local_inverse(board_mm, reach_mm)
    parts, full = [], np.zeros(at.size, dtype=np.bool_)
    for k in range(at.size):
        grid = np.meshgrid(*(np.arange(u, v + 1) for u, v in zip(low[k], high[k], strict=True)))
        x, y = grid[0].ravel(), grid[1].ravel()
        place, by_px = back[k].at(x - middle[k, 0], y - middle[k, 1])
        local = (place - board_mm[k]) / reach_mm[k]
        near = np.abs(local).max(axis=1, initial=0.0) < 1
        full[k] = near.sum() >= LEAST_PIXELS
        values = task.grey[y[near].astype(np.int64), x[near].astype(np.int64)].astype(np.float64)
        if full[k]:
            parts.append((values, place[near], local[near], by_px[near]))
    return _joined(parts), full


def _joined(parts: list[tuple[Floats, Floats, Floats, Floats]]) -> _Patches:
    counts = [len(part[0]) for part in parts]
    if not parts:
        none = np.zeros(0, dtype=np.int64)
        return _Patches(none, none, *(np.zeros((n, 0), np.float32) for n in (0, 2, 2, 4)))
    start = np.cumsum([0, *counts[:-1]])
    columns = (np.concatenate([part[k] for part in parts]) for k in range(4))
    return _Patches(
        start,
        np.repeat(np.arange(len(parts)), counts),
        *(np.ascontiguousarray(part.T, dtype=np.float32) for part in columns),
    )


def _sample(layer: Image, px: Singles) -> Singles:
    """Grey value and slopes (3, M) at template pixels (2, M), bilinear."""
    n, width = px.shape[1], 256  # OpenCV takes no list longer than 32767
    padded = np.zeros((2, -(-n // width) * width), np.float32)
    padded[:, :n] = px
    x, y = padded.reshape(2, -1, width)
    out = cv2.remap(layer, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.ascontiguousarray(out.reshape(-1, 3)[:n].T, dtype=np.float32)


def _rough(artwork: Artwork, patches: _Patches, scale: float) -> _Descent:
    """A few steps at a middle blur; ``scale``: template pixels an image pixel."""
    layer = artwork.layer(artwork.level(FIRST_BLUR_PX * scale))
    return _descend(artwork, patches, layer, np.zeros((patches.start.size, 2)), 3)


def _fine(artwork: Artwork, patches: _Patches, scale: float) -> _Descent:
    """All steps at the blur that leaves the least residual, found by walking up or down."""
    zero, some = np.zeros((patches.start.size, 2)), patches.thinned(3)
    rests: dict[int, float] = {}

    def rest(level: int) -> float:
        if level not in rests:
            rests[level] = _rest(artwork, some, artwork.layer(level), zero)
        return rests[level]

    level = artwork.level(FIRST_BLUR_PX * scale)
    while True:
        best = min((level, level - 1, level + 1), key=lambda k: rest(artwork.clip(k)))
        if artwork.clip(best) == level:
            return _descend(artwork, patches, artwork.layer(level), zero, 6)
        level = artwork.clip(best)


@dataclass(frozen=True)
class _Descent:
    """Where the points moved (N, 2), how sure that is, and how well print and image agree."""

    move: Floats
    sigma_px: Floats
    gain: Floats
    ncc: Floats
    last_px: Floats

    @property
    def good(self) -> Bools:
        """Whether the print was really there (N,)."""
        good = (self.ncc > LEAST_NCC) & (np.abs(self.gain) > LEAST_GAIN)
        good &= np.sign(self.gain) == np.sign(np.median(self.gain))
        near = (self.last_px < 0.1) & (np.linalg.norm(self.move, axis=1) < 4)
        return np.asarray(good & near, dtype=np.bool_)


def _drawn(artwork: Artwork, patches: _Patches, layer: Image, move: Floats) -> Singles:
    """Print and its derivative by the move of the point (3, M)."""
    xx, xy, yx, yy = patches.by_px
    mx, my = patches.each(move[:, 0]), patches.each(move[:, 1])
    place = patches.board_mm - np.stack([xx * mx + xy * my, yx * mx + yy * my])
    drawn = _sample(layer, artwork.pixels(place))
    tx, ty = np.float32(-artwork.px_per_mm) * drawn[1:]
    drawn[1], drawn[2] = tx * xx + ty * yx, tx * xy + ty * yy
    return drawn


def _light_rows(patches: _Patches, T: Singles) -> list[Singles]:
    """What light makes of a print, six rows (M,): gain and offset, each a plane over the patch."""
    x, y = patches.local
    return [T, np.ones_like(T), x, y, T * x, T * y]


def _per_patch(patches: _Patches, rows: Singles, weight: Singles | None = None) -> Floats:
    """Gram matrices (N, C, C) of ``rows`` (C, M) over the pixels of each patch."""
    other = rows * (np.float32(1) if weight is None else weight)
    ends = np.append(patches.start, patches.point.size)
    grams = [rows[:, a:b] @ other[:, a:b].T for a, b in itertools.pairwise(ends)]
    return np.array(grams, dtype=np.float64)


def _firm(matrix: Floats) -> Floats:
    """The matrices (N, C, C), invertible for sure."""
    size = matrix.shape[-1]
    trace = np.einsum("nii->n", matrix)
    out: Floats = matrix + (1e-8 * trace + 1e-9)[:, None, None] * np.eye(size)
    return out


def _light(patches: _Patches, drawn: Singles) -> Floats:
    """The light (N, 6) of each patch by linear least squares."""
    gram = _per_patch(patches, np.stack([*_light_rows(patches, drawn[0]), patches.grey]))
    light = np.linalg.solve(_firm(gram[:, :6, :6]), gram[:, :6, 6:])[:, :, 0]
    return np.asarray(light, dtype=np.float64)


def _left_over(patches: _Patches, drawn: Singles, light: Floats) -> tuple[Singles, Singles]:
    """Grey values (M,) that print and light do not explain, and the light's gain there (M,)."""
    g, o, ox, oy, gx, gy = light.T
    x, y = patches.local
    gain = patches.each(g) + patches.each(gx) * x + patches.each(gy) * y
    ground = patches.each(o) + patches.each(ox) * x + patches.each(oy) * y
    out: Singles = patches.grey - ground - gain * drawn[0]
    return out, gain


def _rms(patches: _Patches, residual: Singles) -> Floats:
    """Rms (N,) of each patch."""
    return np.asarray(np.sqrt(patches.sums(residual * residual) / patches.count))


def _rest(artwork: Artwork, patches: _Patches, layer: Image, move: Floats) -> float:
    """Median over the patches of the residual, rms."""
    drawn = _drawn(artwork, patches, layer, move)
    left = _left_over(patches, drawn, _light(patches, drawn))[0]
    return float(np.median(_rms(patches, left)))


def _descend(
    artwork: Artwork, patches: _Patches, layer: Image, move: Floats, steps: int
) -> _Descent:
    """Gauss-Newton with Tukey weights; at most ``steps`` steps, or until nothing moves."""
    drawn = _drawn(artwork, patches, layer, move)
    light = _light(patches, drawn)
    for k in range(steps):
        if k:
            drawn = _drawn(artwork, patches, layer, move)
        residual, gain = _left_over(patches, drawn, light)
        limit = np.maximum(0.36 * np.abs(light[:, 0]), 3.9 * _rms(patches, residual))
        weight = np.maximum(1 - (residual * patches.each(1 / limit)) ** 2, 0) ** 2
        rows = [gain * drawn[1], gain * drawn[2], *_light_rows(patches, drawn[0]), residual]
        gram = _per_patch(patches, np.stack(rows), weight)
        normal = _firm(gram[:, :8, :8])
        step = np.linalg.solve(normal, gram[:, :8, 8:])[:, :, 0]
        length = np.linalg.norm(step[:, :2], axis=1)
        move = move + step[:, :2] * np.minimum(1, 1.5 / np.maximum(length, 1e-9))[:, None]
        light = light + step[:, 2:]
        if length.max() < STILL_PX:
            break
    total = patches.sums(weight)
    variance = gram[:, 8, 8] / np.maximum(total - 8, 1)
    covariance = np.linalg.inv(normal)[:, :2, :2] * variance[:, None, None]
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    return _Descent(move, sigma, light[:, 0], _ncc(patches, drawn[0]), length)


def _ncc(patches: _Patches, drawn: Singles) -> Floats:
    """Size of the correlation (N,) between print and image; an inverted print is one too."""
    grey = patches.grey - patches.grey.mean()
    rows = np.stack([drawn, grey, drawn * drawn, grey * grey, drawn * grey])
    t, g, tt, gg, tg = patches.sums(rows) / patches.count
    spread = np.sqrt(np.maximum((tt - t * t) * (gg - g * g), 1e-18))
    return np.asarray(np.abs(tg - t * g) / spread, dtype=np.float64)
