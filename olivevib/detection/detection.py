"""What a detector says of one marker in one image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from olivevib.arrays import Floats, Grey, floats


@dataclass(frozen=True)
class Detection:
    """One marker in one grey image, in raw (distorted, unturned) pixels.

    corners_px (4, 2): images of the layout's corners P1…P4, clockwise as printed, whatever the
    turn in the image (paper's layout: the cornerstones; foreign families: the outer corners of the
    dark square); corners_cov_px2 (8, 8) in the order x1 y1 … x4 y4. centre_px (2,): the image of
    the marker's centre under the homography, never the mean of the corners (``paper`` excepted).
    raw_row (5,): sensor row of the centre and of P1…P4. localiser names what measured the points.
    bit_errors: wrong modules accepted. flags: words such as "occluded"; empty when sound.
    """

    id: int
    corners_px: Floats
    corners_cov_px2: Floats
    centre_px: Floats
    centre_cov_px2: Floats
    raw_row: Floats
    localiser: str
    bit_errors: int = 0
    flags: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, shape in _SHAPES.items():
            object.__setattr__(self, name, floats(name, getattr(self, name), shape))

    @property
    def size_px(self) -> float:
        """Mean length of the four sides between the corners, px."""
        sides = np.roll(self.corners_px, -1, axis=0) - self.corners_px
        return float(np.linalg.norm(sides, axis=1).mean())


_SHAPES: dict[str, tuple[int | None, ...]] = {
    "corners_px": (4, 2),
    "corners_cov_px2": (8, 8),
    "centre_px": (2,),
    "centre_cov_px2": (2, 2),
    "raw_row": (5,),
}


class Reader(Protocol):
    """Whatever finds the markers of one library in a grey image; Detector hands on to one."""

    def detect(self, grey: Grey) -> list[Detection]:
        """All markers of the library in ``grey`` (H, W) uint8, sorted by id."""
        ...
