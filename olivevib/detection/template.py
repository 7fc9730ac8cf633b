"""A marker drawn as a camera sees it: the template that refinement fits to the image.

The pattern is drawn once at a start pose as a texture of SAMPLES per pixel, blurred by the point
spread and the pixel; its derivatives are textures too. Near the start pose the image of the marker
is this texture seen through a homography close to the identity.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats
from olivevib.geometry import apply_homography

FINE, COARSE = 4, 2  # texture samples a pixel: to measure with, to approach with
PIXEL_VARIANCE = 1 / 12  # px² of a pixel's own area, as a Gaussian
LEAST_BLUR = 0.3  # texture samples; sharper cannot be drawn
REACH = 0.6  # modules around the dark square that are drawn
MARGIN_PX = 4.0  # and px around these; beyond them the edge is repeated
FINENESS = (4, 8, 16, 32)  # drawn samples a module


@dataclass(frozen=True)
class Template:
    """Texture (h, w, 4) float32: level (0 dark, 1 white), its derivatives by x and y per px, and
    half its Laplacian per px² (the derivative by the variance of the blur).

    origin_px (2,): image point of texture sample (0, 0); H (3, 3): start pose, centred modules to
    px; variance_px2: PSF² + 1/12; samples a pixel.
    """

    texture: NDArray[np.float32]
    origin_px: Floats
    H: Floats
    variance_px2: float
    samples: int


def card(dark: Bools, quiet: int) -> NDArray[np.float32]:
    """The pattern with its white quiet zone, 1 white, 0 dark."""
    return np.pad(np.where(dark, 0, 1), quiet, constant_values=1).astype(np.float32)


def draw_template(
    white: NDArray[np.float32], H: Floats, variance_px2: float, quiet: int = 2, samples: int = FINE
) -> Template:
    """Draw a card (n, n) with its ``quiet`` zone at pose H with a blur of ``variance_px2``.

    Degenerates for a blur below 0.1 px²: the texture's own sampling is then the blur.
    """
    half = len(white) / 2
    reach = half - quiet + REACH
    box = apply_homography(H, [[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]])
    origin = np.floor(box.min(axis=0) - MARGIN_PX)
    width, height = (np.ceil(box.max(axis=0) + MARGIN_PX) - origin).astype(int) * samples + 1
    module_px = _module_px(H)
    fine = min(FINENESS, key=lambda m: abs(np.log(m / (0.7 * samples * module_px))))
    drawn = white.repeat(fine, axis=0).repeat(fine, axis=1)
    to_image = np.array([[1 / samples, 0, origin[0]], [0, 1 / samples, origin[1]], [0, 0, 1]])
    to_drawn = np.array([[fine, 0, fine * half - 0.5], [0, fine, fine * half - 0.5], [0, 0, 1]])
    level = cv2.warpPerspective(
        drawn,
        to_drawn @ np.linalg.inv(H) @ to_image,
        (int(width), int(height)),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    own = 1 / (6 * samples**2) + (module_px / fine) ** 2 / 12  # bilinear reads, drawn ramps
    sigma = samples * float(np.sqrt(max(variance_px2 - own, 0.0)))
    if sigma > LEAST_BLUR:
        size = 2 * int(np.ceil(3 * sigma)) + 1
        level = cv2.GaussianBlur(level, (size, size), sigma, borderType=cv2.BORDER_REPLICATE)
    x = cv2.Sobel(level, cv2.CV_32F, 1, 0, ksize=1, scale=0.5 * samples)
    y = cv2.Sobel(level, cv2.CV_32F, 0, 1, ksize=1, scale=0.5 * samples)
    laplacian = cv2.Laplacian(level, cv2.CV_32F, ksize=1, scale=0.5 * samples**2)
    texture = np.asarray(cv2.merge([level, x, y, laplacian]), dtype=np.float32)
    return Template(texture, origin, H, variance_px2, samples)


def _module_px(H: Floats) -> float:
    """Root mean square length of a module's sides at the centre, px."""
    at = H[:2, 2] / H[2, 2]
    sides = (H[:2, :2] - at[:, None] * H[2, :2]) / H[2, 2]
    return float(np.sqrt((sides**2).sum() / 2))
