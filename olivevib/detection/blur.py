"""What smears the image of a marker: point spread, pixel and motion, as filters of a drawing.

Every filter works on a drawing of some samples a pixel and gives its derivatives too, by place and
by the numbers of the blur.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats

PIXEL_VARIANCE = 1 / 12  # px² of a pixel's own area, as a Gaussian
SMOOTH = 0.7  # samples: sigma of an edge before it is read
TAIL = 3.5  # sigmas of a Gaussian that are drawn
THREE_TAPS = 0.5  # variance, samples², up to which a Gaussian is three taps
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


def pixel_kernel(variance_px2: float, samples: int, denser: int) -> NDArray[np.float32]:
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


def moved_along(still: NDArray[np.float32], blur: Blur, samples: int) -> NDArray[np.float32]:
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


def slope(level: NDArray[np.float32], axis: int, samples: int) -> NDArray[np.float32]:
    """Derivative along x (axis 0) or y, per px, of fourth order."""
    along, across = samples / 12 * np.array([1.0, -8.0, 0.0, 8.0, -1.0]), np.array([1.0])
    kernels = (along, across) if axis == 0 else (across, along)
    return np.asarray(cv2.sepFilter2D(level, cv2.CV_32F, *kernels), dtype=np.float32)


def by_blur(
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
    first = np.array([-0.5, 0.0, 0.5]) * samples
    xy = np.asarray(cv2.sepFilter2D(level, cv2.CV_32F, first, first), dtype=np.float32)
    return [np.float32(0.5) * xx, xy, np.float32(0.5) * yy]
