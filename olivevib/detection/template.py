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
from olivevib.detection.bend import Bend, bent_maps
from olivevib.geometry import apply_homography, homography_jacobian

FINE, COARSE = 4, 2  # texture samples a pixel: to measure with, to approach with
PIXEL_VARIANCE = 1 / 12  # px² of a pixel's own area, as a Gaussian
LEAST_BLUR = 0.3  # texture samples; sharper cannot be drawn
REACH = 0.6  # modules around the dark square that are drawn
MARGIN_PX = 4.0  # and px around these; beyond them the edge is repeated
LARGE_PX = 20.0  # side of a module from which the coarse drawing is fine enough
SMALL_PX = 3.2  # side of a module below which FINE would leave a bias of 0.001 px
FINENESS = (4, 8, 16, 32)  # drawn samples a module
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
    px; blur it is drawn with; samples a pixel; moving: S is the one with a motion.
    """

    texture: NDArray[np.float32]
    origin_px: Floats
    H: Floats
    blur: Blur
    samples: int
    moving: bool = False


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

    Degenerates for a variance below 0.1 px²: the texture's own sampling is then the blur.
    """
    if module_px(H) >= LARGE_PX:
        samples = COARSE
    elif module_px(H) < SMALL_PX and samples == FINE:
        samples = 2 * FINE
    half = len(white) / 2
    reach = half - quiet + REACH
    box = apply_homography(H, [[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]])
    origin = np.floor(box.min(axis=0) - MARGIN_PX)
    width, height = (np.ceil(box.max(axis=0) + MARGIN_PX) - origin).astype(int) * samples + 1
    side_px = module_px(H)
    fine = min(FINENESS, key=lambda m: abs(np.log(m / (0.7 * samples * side_px))))
    drawn = white.repeat(fine, axis=0).repeat(fine, axis=1)
    size, first = (int(width), int(height)), fine * half - 0.5
    if bend is None:
        to_image = np.array([[1 / samples, 0, origin[0]], [0, 1 / samples, origin[1]], [0, 0, 1]])
        to_drawn = np.array([[fine, 0, first], [0, fine, first], [0, 0, 1]])
        sharp = cv2.warpPerspective(
            drawn,
            to_drawn @ np.linalg.inv(H) @ to_image,
            size,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
    else:
        u, v = (fine * part + first for part in bent_maps(bend, H, origin, size, samples))
        sharp = cv2.remap(drawn, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    own = 1 / (6 * samples**2) + (side_px / fine) ** 2 / 12  # bilinear reads, drawn ramps
    sigma = samples * float(np.sqrt(max(blur.variance_px2 - own, 0.0)))
    still = _smoothed(np.asarray(sharp, dtype=np.float32), sigma)
    level = _along(still, blur, samples)
    parts = [level, _slope(level, 1, 0, samples), _slope(level, 0, 1, samples)]
    parts += _by_variances(level, samples) if moments else _by_blur(level, still, blur, samples)
    texture = np.asarray(cv2.merge(parts), dtype=np.float32)
    moving = blur.path_px > LEAST_PATH_PX and not moments
    return Template(texture, origin, H, blur, samples, moving)


def _smoothed(level: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    if sigma <= LEAST_BLUR:
        return level
    size = 2 * int(np.ceil(3 * sigma)) + 1
    smooth = cv2.GaussianBlur(level, (size, size), sigma, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(smooth, dtype=np.float32)


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


def _slope(level: NDArray[np.float32], dx: int, dy: int, samples: int) -> NDArray[np.float32]:
    """Central difference along x or y, per px."""
    slope = cv2.Sobel(level, cv2.CV_32F, dx, dy, ksize=1, scale=0.5 * samples)
    return np.asarray(slope, dtype=np.float32)


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


def _by_variances(level: NDArray[np.float32], samples: int) -> list[NDArray[np.float32]]:
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
