"""A marker drawn as a camera sees it: the template that refinement fits to the image.

The pattern is drawn once at a start pose as a texture of some samples a pixel, blurred by the point
spread and the pixel; its derivatives are textures too. Near the start pose the image of the marker
is this texture seen through a homography close to the identity.

A sharp edge read at points lies between two of them, up to half a sample wrong and, along the pixel
axes, all of it alike. So the pattern is smooth before it is read: each module edge is a Gaussian
step of SMOOTH samples across, exact in the plane of the marker, which leaves exp(-2 pi² SMOOTH²) of
that error (sampling theorem). The pixel is its own box, which whole pixels read without error at
any point spread; the Gaussian between the two makes up the rest of the variance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from olivevib.arrays import Bools, Floats
from olivevib.detection.bend import Bend, bent_maps
from olivevib.detection.blur import (
    LEAST_PATH_PX,
    SMOOTH,
    TAIL,
    Blur,
    by_blur,
    by_variances,
    moved_along,
    pixel_kernel,
    slope,
)
from olivevib.geometry import apply_homography, homography_jacobian

FINE, COARSE = 3, 2  # texture samples a pixel: to measure with, to approach with
FOLLOWED = 4  # the same of a drawing that is read anywhere between its samples
DENSER = 2  # the card's own samples a texture sample, where it is to measure with
TERMS, LEAST_TERM = 3, 0.05  # of the series for skewed corners: at most, power worth one more
REACH = 0.6  # modules around the dark square that are drawn
MARGIN_PX = 2.0  # and px around these; beyond them the edge is repeated
LARGE_PX = 20.0  # side of a module from which the coarse drawing is fine enough
MOSAIC = 6  # numbers of a blur that alternates from pixel to pixel, see mosaic


@dataclass(frozen=True)
class Template:
    """Texture (h, w, 3 + S) float32: level (0 dark, 1 white), its derivatives by x and y per px,
    and by S numbers of the blur: 1 a round variance, per px²; 3 with a motion: the same, and its
    path's x and y, per px; or, for moments, variances xx, xy and yy.

    origin_px (2,): image point of texture sample (0, 0); H (3, 3): start pose, centred modules to
    px; blur it is drawn with; samples a pixel; moving: S is the one with a motion; mosaic: it is
    read with MOSAIC numbers more.
    """

    texture: NDArray[np.float32]
    origin_px: Floats
    H: Floats
    blur: Blur
    samples: int
    moving: bool = False
    mosaic: bool = False

    @property
    def blurs(self) -> int:
        """Numbers of the blur, S and those of a mosaic."""
        return int(self.texture.shape[2]) - 3 + MOSAIC * self.mosaic

    @cached_property
    def layers(self) -> list[NDArray[np.float32]]:
        """The texture in parts of 3 and 4 channels: of others cv2.remap reads 1/32 sample off."""
        cuts = range(3, self.texture.shape[2] - 1, 3)
        return [np.ascontiguousarray(part) for part in np.split(self.texture, list(cuts), axis=2)]


def card(dark: Bools, quiet: int) -> NDArray[np.float32]:
    """The pattern with its white quiet zone, 1 white, 0 dark."""
    return np.pad(np.where(dark, 0, 1), quiet, constant_values=1).astype(np.float32)


def draw_template(
    white: NDArray[np.float32],
    H: Floats,
    blur: Blur,
    quiet: int = 2,
    samples: int = FINE,
    moments: bool = False,
    bend: Bend | None = None,
) -> Template:
    """Draw a card (n, n) with its ``quiet`` zone at pose H; ``moments`` asks for S = 3.

    With a ``bend`` it lies on a cylinder, and H is the pose of the plane that touches its middle.

    Degenerates for a variance below 0.16 px²: the texture's own sampling is then the blur.
    """
    denser = 1 if samples == COARSE else DENSER
    if module_px(H) >= LARGE_PX:
        samples = COARSE
    half = len(white) / 2
    reach = half - quiet + REACH
    box = apply_homography(H, [[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]])
    origin = np.floor(box.min(axis=0) - MARGIN_PX)
    width, height = (np.ceil(box.max(axis=0) + MARGIN_PX) - origin).astype(int) * samples + 1
    across, skew = _across_px(H)
    density = denser * samples * across
    drawn, first = _smooth_card(white, quiet, density, skew, denser * SMOOTH)
    size = (int(width), int(height))
    if bend is None:
        to_image = np.array([[1 / samples, 0, origin[0]], [0, 1 / samples, origin[1]], [0, 0, 1]])
        to_drawn = np.array([[density[0], 0, first[0]], [0, density[1], first[1]], [0, 0, 1]])
        read = cv2.warpPerspective(
            drawn,
            to_drawn @ np.linalg.inv(H) @ to_image,
            size,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
    else:
        maps = bent_maps(bend, H, origin, size, samples)
        u, v = (
            np.float32(m) * part + np.float32(c)
            for m, part, c in zip(density, maps, first, strict=True)
        )
        read = cv2.remap(drawn, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    kernel = pixel_kernel(blur.variance_px2, samples, denser)
    still = np.asarray(
        cv2.sepFilter2D(read, cv2.CV_32F, kernel, kernel, borderType=cv2.BORDER_REPLICATE),
        dtype=np.float32,
    )
    level = moved_along(still, blur, samples)
    parts = [level, slope(level, 0, samples), slope(level, 1, samples)]
    parts += by_variances(level, samples) if moments else by_blur(level, still, blur, samples)
    texture = np.asarray(cv2.merge(parts), dtype=np.float32)
    moving = blur.path_px > LEAST_PATH_PX and not moments
    return Template(texture, origin, H, blur, samples, moving)


def _across_px(H: Floats) -> tuple[Floats, float]:
    """How wide a module is across its edges u = const and v = const (2,), px, at the centre.

    And the correlation of u and v where x and y have none: the cosine between the edges' normals.
    """
    normals = np.linalg.inv(homography_jacobian(H, [[0.0, 0.0]])[0])
    steep = np.linalg.norm(normals, axis=1)
    return 1 / steep, float(normals[0] @ normals[1] / (steep[0] * steep[1]))


def _smooth_card(
    white: NDArray[np.float32], quiet: int, density: Floats, skew: float, sigma: float
) -> tuple[NDArray[np.float32], Floats]:
    """A card with ``density`` (2,) samples a module along u and v, and the sample of its centre.

    Its edges are Gaussian steps of ``sigma`` samples, and so are its corners in the image: there u
    and v are correlated by ``skew`` (tetrachoric series: Pearson 1900). It ends where all is white.
    """
    core = white[quiet - 1 : len(white) - quiet + 1, quiet - 1 : len(white) - quiet + 1]
    inner = len(core) - 2
    centre = np.ceil(TAIL * sigma) + density * inner / 2
    terms = 1 + sum(abs(skew) ** n > LEAST_TERM for n in range(1, TERMS))
    across, down = (
        _smooth_modules(inner, float(m), float(c), sigma, terms)
        for m, c in zip(density, centre, strict=True)
    )
    rows = [np.float32(skew**n / factorial(n)) * (part @ core) for n, part in enumerate(down)]
    drawn = np.concatenate(rows, axis=1) @ np.concatenate(list(across), axis=1).T
    return np.asarray(drawn, dtype=np.float32), centre


def _smooth_modules(
    modules: int, density: float, centre: float, sigma: float, terms: int
) -> NDArray[np.float32]:
    """How much each sample of a row sees of each module, and of the white before and after.

    (terms, K, modules + 2): the n-th is the n-th derivative by the sample, in units of sigma.
    """
    samples = np.arange(int(np.ceil(2 * centre)) + 1)
    edges = centre + density * (np.arange(modules + 1) - modules / 2)
    behind = ((samples[:, None] - edges) / sigma).astype(np.float32)
    beyond = np.zeros((terms, len(samples), modules + 3), dtype=np.float32)
    beyond[0, :, 0] = 1
    beyond[0, :, 1:-1] = ndtr(behind)
    if terms > 1:
        beyond[1, :, 1:-1] = np.exp(-0.5 * behind * behind) / np.float32(np.sqrt(2 * np.pi))
    if terms > 2:
        beyond[2, :, 1:-1] = -behind * beyond[1, :, 1:-1]
    out: NDArray[np.float32] = beyond[..., :-1] - beyond[..., 1:]
    return out


def module_px(H: Floats) -> float:
    """Root mean square length of a module's sides at the centre, px."""
    sides = homography_jacobian(H, [[0.0, 0.0]])[0]
    return float(np.sqrt((sides**2).sum() / 2))


def module_stretches_px(H: Floats) -> Floats:
    """The longer stretch of a module at the centre (its size seen straight on) and the shorter."""
    out: Floats = np.linalg.svd(homography_jacobian(H, [[0.0, 0.0]])[0], compute_uv=False)
    return out
