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
from olivevib.geometry import apply_homography, homography_jacobian

FINE, COARSE = 3, 2  # texture samples a pixel: to measure with, to approach with
FOLLOWED = 4  # the same of a drawing that is read anywhere between its samples
PIXEL_VARIANCE = 1 / 12  # px² of a pixel's own area, as a Gaussian
SMOOTH = 0.7  # samples: sigma of an edge before it is read
DENSER = 2  # the card's own samples a texture sample, where it is to measure with
TAIL = 3.5  # sigmas of a Gaussian that are drawn
TERMS, LEAST_TERM = 3, 0.05  # of the series for skewed corners: at most, power worth one more
THREE_TAPS = 0.5  # variance, samples², up to which a Gaussian is three taps
REACH = 0.6  # modules around the dark square that are drawn
MARGIN_PX = 2.0  # and px around these; beyond them the edge is repeated
LARGE_PX = 20.0  # side of a module from which the coarse drawing is fine enough
MOSAIC = 6  # numbers of a blur that alternates from pixel to pixel, see mosaic
LEAST_PATH_PX = 0.5  # a shorter motion is part of the round blur
PATH_POINTS = 512  # of a motion path


@dataclass(frozen=True)
class Blur:
    """What smears an image: variance_px2 of a round Gaussian (PSF² + 1/12) and the path motion_px
    (2,) of a steady motion during the exposure; m and -m are the same.
    """

    variance_px2: float = 0.7**2 + PIXEL_VARIANCE
    motion_px: tuple[float, float] = (0.0, 0.0)

    @property
    def path_px(self) -> float:
        """Length of the motion, px."""
        return float(np.hypot(*self.motion_px))

    @property
    def edge_px(self) -> float:
        """How far an edge is blurred to either side of where its path ends, px: two sigma."""
        return 2 * float(np.sqrt(self.variance_px2))


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
    kernel = _pixel_kernel(blur.variance_px2, samples, denser)
    still = np.asarray(
        cv2.sepFilter2D(read, cv2.CV_32F, kernel, kernel, borderType=cv2.BORDER_REPLICATE),
        dtype=np.float32,
    )
    level = _along(still, blur, samples)
    parts = [level, _slope(level, 0, samples), _slope(level, 1, samples)]
    parts += by_variances(level, samples) if moments else _by_blur(level, still, blur, samples)
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


def _pixel_kernel(variance_px2: float, samples: int, denser: int) -> NDArray[np.float32]:
    """What blurs a drawing along one axis: the pixel's box, and a Gaussian for the rest.

    Already in the drawing are its smooth edges and the bilinear reads of the card; a coarse drawing
    is read anywhere between its own samples too, another near them (or its blur is fitted).
    """
    taps = samples + 1 - samples % 2
    box = np.full(taps, 1 / samples)
    if samples % 2 == 0:
        box[[0, -1]] /= 2
    at = np.arange(taps) - taps // 2
    own = float(box @ at**2) + SMOOTH**2 + 1 / (6 * denser**2) + (1 / 6 if denser == 1 else 0)
    rest = max(variance_px2 * samples**2 - own, 0.0)
    if rest < THREE_TAPS:
        gauss = np.array([rest / 2, 1 - rest, rest / 2])
    else:
        sigma = float(np.sqrt(rest))
        reach = int(np.ceil(TAIL * sigma))
        gauss = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    return np.asarray(np.convolve(box, gauss / gauss.sum()), dtype=np.float32)


def _along(still: NDArray[np.float32], blur: Blur, samples: int) -> NDArray[np.float32]:
    """The drawing as its motion smears it."""
    if blur.path_px <= LEAST_PATH_PX:
        return still
    path = samples * np.array(blur.motion_px)
    return _filtered(still, _path_kernel(path, _half(path)))


def _half(path: Floats) -> int:
    """Samples to either side that the kernels of a path, and of one slightly longer, need."""
    return int(np.ceil(np.abs(path).max() / 2)) + 2


def _filtered(level: NDArray[np.float32], kernel: NDArray[np.float32]) -> NDArray[np.float32]:
    out = cv2.filter2D(level, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(out, dtype=np.float32)


def _path_kernel(path: Floats, half: int) -> NDArray[np.float32]:
    """A straight path (2,), texture samples, as a filter kernel (2 half + 1) squared; bilinear."""
    steps = (np.arange(PATH_POINTS) + 0.5) / PATH_POINTS - 0.5
    x, y = (half + path[axis] * steps for axis in (0, 1))
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    for dj, di in ((0, 0), (0, 1), (1, 0), (1, 1)):
        weight = np.abs(1 - di - (x - i)) * np.abs(1 - dj - (y - j))
        np.add.at(kernel, (j + dj, i + di), weight)
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


def _slope(level: NDArray[np.float32], axis: int, samples: int) -> NDArray[np.float32]:
    """Derivative along x (axis 0) or y, per px, of fourth order."""
    slope, one = samples / 12 * np.array([1.0, -8.0, 0.0, 8.0, -1.0]), np.array([1.0])
    kernels = (slope, one) if axis == 0 else (one, slope)
    return np.asarray(cv2.sepFilter2D(level, cv2.CV_32F, *kernels), dtype=np.float32)


def _by_blur(
    level: NDArray[np.float32], still: NDArray[np.float32], blur: Blur, samples: int
) -> list[NDArray[np.float32]]:
    """Derivatives by a round variance and, of what moves, by its path's x and y."""
    round_ = cv2.Laplacian(level, cv2.CV_32F, ksize=1, scale=0.5 * samples**2)
    out = [np.asarray(round_, dtype=np.float32)]
    if blur.path_px > LEAST_PATH_PX:
        path = samples * np.array(blur.motion_px)
        out += [_filtered(still, samples * _path_slope(path, axis)) for axis in (0, 1)]
    return out


def _path_slope(path: Floats, axis: int) -> NDArray[np.float32]:
    """Derivative of the path's kernel by its x (axis 0) or y, per texture sample."""
    step = np.eye(2)[axis]
    more, less = (_path_kernel(path + sign * step, _half(path)) for sign in (1, -1))
    return np.asarray((more - less) / 2, dtype=np.float32)


def by_variances(level: NDArray[np.float32], samples: int) -> list[NDArray[np.float32]]:
    """Derivatives by further variances: ½ xx, xy, ½ yy."""
    second = np.array([1.0, -2.0, 1.0]) * samples**2
    one = np.array([1.0])
    xx, yy = (
        np.asarray(cv2.sepFilter2D(level, cv2.CV_32F, a, b), dtype=np.float32)
        for a, b in ((second, one), (one, second))
    )
    slope = np.array([-0.5, 0.0, 0.5]) * samples
    xy = np.asarray(cv2.sepFilter2D(level, cv2.CV_32F, slope, slope), dtype=np.float32)
    return [np.float32(0.5) * xx, xy, np.float32(0.5) * yy]


def module_px(H: Floats) -> float:
    """Root mean square length of a module's sides at the centre, px."""
    sides = homography_jacobian(H, [[0.0, 0.0]])[0]
    return float(np.sqrt((sides**2).sum() / 2))


def module_stretches_px(H: Floats) -> Floats:
    """The longer stretch of a module at the centre (its size seen straight on) and the shorter."""
    out: Floats = np.linalg.svd(homography_jacobian(H, [[0.0, 0.0]])[0], compute_uv=False)
    return out
