"""Board points to a few hundredths of a pixel: each patch of the print fitted to the image.

A point is moved until the printed pattern around it, drawn through the board's homography and
blurred as the camera blurs, explains the grey values best (least squares with Tukey weights; gain
and offset per patch). Markers within the patch help instead of pulling, as they do with cornerSubPix.
Source: Lucas & Kanade, An iterative image registration technique, 1981; knowledge/detection 4.4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats, Grey, Ints
from olivevib.calibration.artwork import Artwork, Image
from olivevib.geometry import apply_homography, homography, homography_jacobian

BLURS_PX = (0.5, 0.9, 1.5, 2.5)  # Gaussian blur of the camera, one is chosen a view
MOST_PIXELS = 10_000  # of one view; larger patches are thinned
FLOOR_PX = 0.02  # what no template knows: sharpening, compression, print
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
    """Pixels of all patches, sorted by point: index of the point, grey value, board place."""

    start: Ints  # (N,) first pixel of each point
    point: Ints
    grey: Floats
    board_mm: Floats  # (M, 2) under the homography, before the points move
    by_px: Floats  # (M, 2, 2) d board / d pixel

    def sums(self, columns: Floats) -> Floats:
        """Sums (N, C) over the pixels of each point of ``columns`` (M, C)."""
        out: Floats = np.add.reduceat(columns, self.start, axis=0)
        return out


def refine(grey: Grey, artwork: Artwork, board_mm: Floats, px: Floats, reach_mm: Floats) -> Fitted:
    """Refine the images ``px`` (N, 2) of board points (N, 2), N >= 4 not in line.

    Points whose patch leaves the image, or where the print is not seen, come back with ok False.
    """
    n = len(px)
    start = Fitted(px, np.full(n, np.nan), np.ones(n, dtype=np.bool_))
    first = _round(grey, artwork, board_mm, start, reach_mm, _rough)
    if first.ok.sum() < 4:
        return first
    H = robust_homography(board_mm[first.ok], first.px[first.ok])
    predicted = apply_homography(H, board_mm)
    far = np.linalg.norm(first.px - predicted, axis=1) > OUTLIER_PX
    again = np.where((far | ~first.ok)[:, None], predicted, first.px)
    begin = Fitted(again, first.sigma_px, first.ok & ~far)
    second = _round(grey, artwork, board_mm, begin, reach_mm, _fine)
    stray = np.linalg.norm(second.px - predicted, axis=1) > 2 * OUTLIER_PX
    return Fitted(second.px, second.sigma_px, second.ok & ~stray)


def robust_homography(board_mm: Floats, px: Floats) -> Floats:
    """Board to image from points of which a few may be wrong; drops those beyond 4 medians."""
    keep = np.ones(len(px), dtype=np.bool_)
    H = homography(board_mm, px)
    for _ in range(5):
        miss = np.linalg.norm(apply_homography(H, board_mm) - px, axis=1)
        keep = miss <= max(4 * float(np.median(miss)), 0.3)
        if keep.sum() < 4 or keep.all():
            break
        H = homography(board_mm[keep], px[keep])
    return H


def _round(
    grey: Grey,
    artwork: Artwork,
    board_mm: Floats,
    start: Fitted,
    reach_mm: Floats,
    fit: Callable[[Artwork, _Patches, float], _Descent],
) -> Fitted:
    """One homography, its patches, and Gauss-Newton on the shift of every point."""
    n = len(start.px)
    if start.ok.sum() < 4:
        return start
    H = robust_homography(board_mm[start.ok], start.px[start.ok])
    base = apply_homography(H, board_mm)
    inside = _inside(H, board_mm, reach_mm, start.px - base, grey.shape)
    lost = Fitted(start.px, np.full(n, np.nan), np.zeros(n, dtype=np.bool_))
    if not inside.any():
        return lost
    at = np.flatnonzero(inside)
    shift = (start.px - base)[at]
    patches, full = _patches(grey, H, board_mm[at], reach_mm[at], base[at] + shift, shift)
    at, shift = at[full], shift[full]
    if at.size == 0:
        return lost
    scale = artwork.px_per_mm * np.sqrt(abs(np.linalg.det(patches.by_px.mean(axis=0))))
    found = fit(artwork, patches, float(scale))
    px, sigma, ok = start.px.copy(), np.full(n, np.nan), np.zeros(n, dtype=np.bool_)
    ok[at] = found.good
    px[at[found.good]] = (base[at] + shift + found.move)[found.good]
    sigma[at] = np.hypot(found.sigma_px, FLOOR_PX)
    return Fitted(px, sigma, ok)


_AROUND = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def _inside(
    H: Floats, board_mm: Floats, reach_mm: Floats, shift: Floats, shape: tuple[int, ...]
) -> Bools:
    """Whether the patch of each point lies wholly in the image (N,)."""
    around = board_mm[:, None] + reach_mm[:, None, None] * _AROUND
    px = apply_homography(H, around.reshape(-1, 2)).reshape(-1, 4, 2) + shift[:, None]
    limit = np.array([shape[1] - 2, shape[0] - 2])
    return np.asarray(((px >= 1) & (px <= limit)).all(axis=(1, 2)), dtype=np.bool_)


def _patches(
    grey: Grey, H: Floats, board_mm: Floats, reach_mm: Floats, px: Floats, shift: Floats
) -> tuple[_Patches, Bools]:
    """The pixels whose place on the board lies within the reach of a point, and which points."""
    corners = board_mm[:, None] + reach_mm[:, None, None] * _AROUND
    outline = apply_homography(H, corners.reshape(-1, 2)).reshape(-1, 4, 2) + shift[:, None]
    low, high = np.ceil(outline.min(axis=1)), np.floor(outline.max(axis=1))
    sides = np.maximum(high - low + 1, 0)
    stride = max(1, int(np.ceil(np.sqrt(0.7 * sides.prod(axis=1).sum() / MOST_PIXELS))))
    grids = [
        np.stack(np.meshgrid(np.arange(a[0], b[0] + 1, stride), np.arange(a[1], b[1] + 1, stride)), -1)
        for a, b in zip(low, high, strict=True)
    ]
    point = np.repeat(np.arange(len(px)), [g.shape[0] * g.shape[1] for g in grids])
    pixel = np.concatenate([g.reshape(-1, 2) for g in grids])
    inverse = np.linalg.inv(H)
    place = apply_homography(inverse, pixel - shift[point])
    near = np.abs(place - board_mm[point]).max(axis=1) < reach_mm[point]
    enough = np.bincount(point, near, len(px)) >= 25
    near &= enough[point]
    point, pixel, place = point[near], pixel[near], place[near]
    point = (np.cumsum(enough) - 1)[point]
    by_px = homography_jacobian(inverse, pixel - shift[enough][point]) if point.size else np.zeros((0, 2, 2))
    values = grey[pixel[:, 1].astype(np.int64), pixel[:, 0].astype(np.int64)].astype(np.float64)
    start = np.searchsorted(point, np.arange(int(enough.sum())))
    return _Patches(start, point, values, place, by_px), enough


def _sample(layer: Image, px: Image) -> Floats:
    """Grey value and slopes (M, 3) at template pixels (M, 2), bilinear."""
    n, width = len(px), 256  # OpenCV takes no list longer than 32767
    padded = np.zeros((-(-n // width) * width, 2), np.float32)
    padded[:n] = px
    x, y = padded[:, 0].reshape(-1, width), padded[:, 1].reshape(-1, width)
    out = cv2.remap(layer, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(out.reshape(-1, 3)[:n], dtype=np.float64)


def _blurred(artwork: Artwork, scale: float) -> list[Image]:
    """The print as the camera may blur it; ``scale``: template pixels an image pixel."""
    return [artwork.layer(float(np.hypot(blur, 12**-0.5)) * scale) for blur in BLURS_PX]


def _rough(artwork: Artwork, patches: _Patches, scale: float) -> _Descent:
    """A few steps at a middle blur."""
    layer = _blurred(artwork, scale)[1]
    return _descend(artwork, patches, layer, np.zeros((patches.start.size, 2)), 4)


def _fine(artwork: Artwork, patches: _Patches, scale: float) -> _Descent:
    """All steps at the blur that leaves the least residual."""
    zero = np.zeros((patches.start.size, 2))
    layers = _blurred(artwork, scale)
    rests = [_rest(artwork, patches, layer, zero) for layer in layers]
    return _descend(artwork, patches, layers[int(np.argmin(rests))], zero, 6)


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


def _drawn(artwork: Artwork, patches: _Patches, layer: Image, move: Floats) -> Floats:
    """Print and its derivative by the move of the point (M, 3)."""
    place = patches.board_mm - np.einsum("mij,mj->mi", patches.by_px, move[patches.point])
    drawn = _sample(layer, artwork.pixels(place))
    slope = -np.einsum("mj,mji->mi", drawn[:, 1:], patches.by_px) * artwork.px_per_mm
    return np.column_stack([drawn[:, 0], slope])


def _light(patches: _Patches, drawn: Floats) -> tuple[Floats, Floats]:
    """Gain and offset (N,) of each patch by linear least squares."""
    T, grey = drawn[:, 0], patches.grey
    count, t, tt, g, tg = patches.sums(
        np.column_stack([np.ones_like(T), T, T * T, grey, T * grey])
    ).T
    gain = (count * tg - t * g) / np.maximum(count * tt - t * t, 1e-9)
    return gain, (g - gain * t) / count


def _rest(artwork: Artwork, patches: _Patches, layer: Image, move: Floats) -> float:
    """Median over the patches of the residual, rms."""
    drawn = _drawn(artwork, patches, layer, move)
    gain, offset = _light(patches, drawn)
    residual = patches.grey - offset[patches.point] - gain[patches.point] * drawn[:, 0]
    count = np.diff(np.append(patches.start, patches.point.size))
    return float(np.median(np.sqrt(patches.sums((residual**2)[:, None])[:, 0] / count)))


def _descend(artwork: Artwork, patches: _Patches, layer: Image, move: Floats, steps: int) -> _Descent:
    k = patches.point
    count = np.diff(np.append(patches.start, k.size)).astype(np.float64)
    drawn = _drawn(artwork, patches, layer, move)
    gain, offset = _light(patches, drawn)
    for _ in range(steps):
        residual = patches.grey - offset[k] - gain[k] * drawn[:, 0]
        rms = np.sqrt(patches.sums((residual**2)[:, None])[:, 0] / count)
        limit = np.maximum(0.36 * np.abs(gain), 3.9 * rms)[k]
        weight = np.clip(1 - (residual / limit) ** 2, 0, None) ** 2
        normal, right, square = _normal(patches, drawn, gain, weight, residual)
        step = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
        length = np.linalg.norm(step[:, :2], axis=1)
        move = move + step[:, :2] * np.minimum(1, 1.5 / np.maximum(length, 1e-9))[:, None]
        gain, offset = gain + step[:, 2], offset + step[:, 3]
        drawn = _drawn(artwork, patches, layer, move)
        if length.max() < 4e-3:
            break
    total = patches.sums(weight[:, None])[:, 0]
    variance = square / np.maximum(total - 4, 1)
    covariance = np.linalg.inv(normal)[:, :2, :2] * variance[:, None, None]
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    return _Descent(move, sigma, gain, _ncc(patches, drawn[:, 0]), length)


def _normal(
    patches: _Patches, drawn: Floats, gain: Floats, weight: Floats, residual: Floats
) -> tuple[Floats, Floats, Floats]:
    """Normal matrices (N, 4, 4), right sides (N, 4), weighted squares (N,); move, gain, offset."""
    g = gain[patches.point]
    columns = np.column_stack([g * drawn[:, 1], g * drawn[:, 2], drawn[:, 0], np.ones_like(g), residual])
    weighted = columns * weight[:, None]
    ends = np.append(patches.start, g.size)
    full = np.array([
        columns[a:b].T @ weighted[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)
    ])  # fmt: skip
    normal = full[:, :4, :4]
    normal = normal + 1e-7 * np.einsum("nii->n", normal)[:, None, None] * np.eye(4) + 1e-9 * np.eye(4)
    return normal, full[:, :4, 4], full[:, 4, 4]


def _ncc(patches: _Patches, drawn: Floats) -> Floats:
    """Correlation (N,) between print and image, signed like the gain's magnitude (never below 0)."""
    count = np.diff(np.append(patches.start, patches.point.size))
    grey = patches.grey
    columns = np.column_stack([drawn, grey, drawn * drawn, grey * grey, drawn * grey])
    t, g, tt, gg, tg = (patches.sums(columns) / count[:, None]).T
    spread = np.sqrt(np.maximum((tt - t * t) * (gg - g * g), 1e-18))
    return np.asarray(np.abs(tg - t * g) / spread, dtype=np.float64)
