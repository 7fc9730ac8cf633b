"""The key of a marker: its drawing at one pose, read again in many frames.

A marker that moves little from frame to frame is drawn once. In each frame the same texture is seen
through a homography close to the identity, at the same pixels moved by whole pixels, so that what
does not change is made once. A key is a function of the card, pose, blur and noise alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats
from olivevib.detection.blur import Blur, by_variances
from olivevib.detection.noise import LAGS
from olivevib.detection.pixels import Pixels, Singles, marker_pixels
from olivevib.detection.refine import only
from olivevib.detection.search import Patch, patch_of
from olivevib.detection.template import FOLLOWED, REACH, Template, draw_template, module_px
from olivevib.marker import MarkerLayout

FLAT = 0.02  # of the steepest slope, squared: 1.5 px from an edge
GEOMETRY, LIGHT = 8, 6  # unknowns of the homography and of the light; one more for the blur


@dataclass(frozen=True)
class Key:
    """One marker drawn at a key pose.

    template: texture with pose and blur; x, y (N,): its pixels there, along edges each, on even
    ground a quarter; area (N,): pixels that each stands for; X, Y (N,): the same about ``centre``
    (2,) px in units of ``scale`` px; coarse (Q,): a quarter of all; cells (9, N): row k averages
    over the k-th ninth; patch to search with; pull (8, 3): by how much a blur beyond the drawing's
    of variances xx, xy, yy px² draws the entries of the homography; spread (15, 15): sum of J R J'
    for unit contrast, R the correlation of the pixels' noise; None where it is white.
    """

    template: Template
    x: NDArray[np.intp]
    y: NDArray[np.intp]
    X: Singles
    Y: Singles
    area: Singles
    centre: Floats
    scale: float
    coarse: NDArray[np.intp]
    cells: Singles
    patch: Patch
    pull: Floats
    spread: Floats | None

    @property
    def H(self) -> Floats:
        """The pose (3, 3) that it is drawn at, centred modules to px."""
        return self.template.H


def make_key(
    white: Singles,
    H: Floats,
    blur: Blur,
    layout: MarkerLayout,
    noise: Singles,
    size_px: tuple[int, int],
) -> Key | None:
    """Draw the key of a card at pose H in images of ``size_px`` (width, height).

    noise (5, 5): autocorrelation of the pixels' noise. None where too little lies in the image.
    """
    reach = min(REACH, layout.quiet - blur.edge_px / module_px(H))
    blank = np.broadcast_to(np.uint8(0), (size_px[1], size_px[0]))
    pixels = marker_pixels(blank, H, layout.modules, reach_modules=reach)
    if pixels is None:
        return None
    template = draw_template(white, H, blur, layout.quiet, FOLLOWED)
    keep, area = _telling(template, pixels)
    pixels = only(pixels, keep)
    cells = area * (pixels.cell == np.arange(9)[:, None])
    cells /= np.maximum(cells.sum(axis=1, keepdims=True), 1)
    white_noise = np.count_nonzero(noise) == 1
    J = _jacobian(template, pixels)
    spread = None if white_noise else _spread(J, pixels, noise)
    return Key(
        template, pixels.x, pixels.y, pixels.X, pixels.Y, area, pixels.centre, pixels.scale,
        np.flatnonzero((pixels.x % 2 == 0) & (pixels.y % 2 == 0)), cells.astype(np.float32),
        patch_of(template, layout), _pull(J, template, pixels), spread,
    )  # fmt: skip


def _telling(template: Template, pixels: Pixels) -> tuple[Bools, Singles]:
    """Which pixels (N,) to fit, and of these (K,) how many pixels each stands for.

    Where the drawing is flat a pixel tells of the light only: a quarter of those is enough.
    """
    slope2 = (template.texture[_samples(template, pixels)][:, 1:3] ** 2).sum(axis=1)
    flat = slope2 < FLAT * slope2.max()
    keep: Bools = ~flat | ((pixels.x % 2 == 0) & (pixels.y % 2 == 0))
    share = max(float(flat.sum()), 1.0) / max(float((flat & keep).sum()), 1.0)
    return keep, np.where(flat[keep], share, 1.0).astype(np.float32)


def _samples(template: Template, pixels: Pixels) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns (N,) of the texture at the pixels, at the key pose."""
    at = (np.stack([pixels.y, pixels.x]) - template.origin_px[::-1, None]) * template.samples
    j, i = at.astype(np.intp)
    return j, i


def _jacobian(template: Template, pixels: Pixels) -> Singles:
    """Derivatives (15, N) of the pixels by all unknowns at the key pose, for unit contrast."""
    X, Y, texture = pixels.X, pixels.Y, template.texture[_samples(template, pixels)]
    T, p, q = texture[:, 0], pixels.scale * texture[:, 1], pixels.scale * texture[:, 2]
    back = -(X * p + Y * q)
    one = np.ones_like(X)
    return np.stack([p * X, p * Y, p, q * X, q * Y, q, back * X, back * Y,
                     one, X, Y, T, X * T, Y * T, texture[:, 3]])  # fmt: skip


def _pull(J: Singles, template: Template, pixels: Pixels) -> Floats:
    """What a fit with Jacobian J takes for W, per px² of variances xx, xy, yy (8, 3)."""
    at = _samples(template, pixels)
    missed = [part[at] for part in by_variances(template.texture[..., 0], template.samples)]
    A = (J @ J.T).astype(np.float64)
    taken = np.linalg.solve(A + 1e-9 * np.trace(A) * np.eye(len(A)), J @ np.stack(missed).T)
    out: Floats = taken[:GEOMETRY]
    return out


def _spread(J: Singles, pixels: Pixels, noise: Singles) -> Floats:
    """J R J' (15, 15) of the whole marker at the key pose."""
    x, y = pixels.x, pixels.y
    left, top = int(x.min()) - LAGS, int(y.min()) - LAGS
    width, height = int(x.max()) - left + LAGS + 1, int(y.max()) - top + LAGS + 1
    at = (y - top) * width + (x - left)
    field = np.zeros((height * width, len(J)), np.float32)
    field[at] = J.T
    smeared = cv2.filter2D(
        field.reshape(height, width, len(J)), -1, noise, borderType=cv2.BORDER_CONSTANT
    )
    B: Floats = (J @ smeared.reshape(-1, len(J))[at]).astype(np.float64)
    return (B + B.T) / 2


def inside_image(key: Key, shift: NDArray[np.intp], size_px: tuple[int, int]) -> bool:
    """Whether all its pixels, moved by ``shift`` (2,), lie in an image (width, height)."""
    low = (int(key.x.min()) + int(shift[0]), int(key.y.min()) + int(shift[1]))
    high = (int(key.x.max()) + int(shift[0]), int(key.y.max()) + int(shift[1]))
    return min(low) >= 0 and high[0] < size_px[0] and high[1] < size_px[1]


def seen_through(key: Key, W: Floats) -> Floats:
    """W (3, 3) as fitted, without what the drawing's blur does to it.

    Through W = 1 + E the drawing's round blur is seen skewed, by v (A A' - 1), A the linear part of
    W; the camera's is round at any pose. Of that difference a fit takes ``pull`` for a change of W.
    """
    A = W[:2, :2] - W[:2, 2:] * W[2, :2]
    S = key.template.blur.variance_px2 * (A @ A.T - np.eye(2))
    out = W.ravel().copy()
    out[:GEOMETRY] -= key.pull @ S[[0, 0, 1], [0, 1, 1]]
    return out.reshape(3, 3)


def change_of_shape(W: Floats) -> float:
    """The larger |log| of the two stretches at the centre of W (3, 3): 0 for a move and a turn."""
    A = W[:2, :2] - W[:2, 2:] * W[2, :2]
    return float(np.abs(np.log(np.linalg.svd(A, compute_uv=False))).max())
