"""Foreign marker families (ArUco, AprilTag) through OpenCV, with edges measured by ourselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection.detection import Detection
from olivevib.detection.edges import refine_quad
from olivevib.geometry import diagonal_crossing, diagonal_crossing_jacobian
from olivevib.marker import MarkerLibrary

UNREFINED_SIGMA_PX = 0.35  # cv2 without refinement: 0.25-0.35 px per axis on rendered scenes
TINY_PX = 12.0  # shortest side at which edges are refined


def dictionary(name: str) -> Any:
    """OpenCV's predefined dictionary of that name; raises KeyError where it has none."""
    if not name.startswith("DICT_") or not hasattr(cv2.aruco, name):
        raise KeyError(name)
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


class ForeignReader:
    """Reads one OpenCV dictionary, dark on light and light on dark, in any grey image.

    Each polarity has a pass of its own: OpenCV's detectInvertedMarker looks for light squares with
    a threshold made for dark ones and misses a fifth of them.
    Corners are the outer corners of the square. Without a clear edge on all four sides the corners
    are OpenCV's own and the detection is flagged "unrefined".
    """

    def __init__(self, library: MarkerLibrary) -> None:
        self.ids = frozenset(int(i) for i in library.ids)
        table = dictionary(library.dictionary)
        self.modules = int(table.markerSize) + 2
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self._detector: Any = cv2.aruco.ArucoDetector(table, parameters)

    def detect(self, grey: Grey) -> list[Detection]:
        """All markers of the library in ``grey`` (H, W) uint8, sorted by id; the largest wins."""
        found: dict[int, Detection] = {}
        for marker, corners in (*self._quads(grey), *self._quads(255 - grey)):
            one = self._measure(grey, marker, corners)
            if marker not in found or one.size_px > found[marker].size_px:
                found[marker] = one
        return [found[i] for i in sorted(found)]

    def _quads(self, grey: Grey) -> Iterator[tuple[int, Floats]]:
        """Ids and rough corners (4, 2) of the dark markers."""
        quads, ids, _ = self._detector.detectMarkers(grey)
        numbers = [] if ids is None else [int(i) for i in np.ravel(ids)]
        for quad, marker in zip(quads, numbers, strict=True):
            if marker in self.ids:
                yield marker, np.asarray(quad, np.float64).reshape(4, 2)

    def _measure(self, grey: Grey, marker: int, corners: Floats) -> Detection:
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        quad = refine_quad(grey, corners, self.modules) if sides.min() >= TINY_PX else None
        if quad is not None:
            moved = np.abs(quad.corners_px - corners).max()
            quad = quad if moved < max(2.0, 0.12 * float(sides.mean())) else None
        points = corners if quad is None else quad.corners_px
        covariance = np.eye(8) * UNREFINED_SIGMA_PX**2 if quad is None else quad.covariance_px2
        jacobian = diagonal_crossing_jacobian(points)
        centre = diagonal_crossing(points)
        return Detection(
            id=marker,
            corners_px=points,
            corners_cov_px2=covariance,
            centre_px=centre,
            centre_cov_px2=jacobian @ covariance @ jacobian.T,
            raw_row=np.concatenate([centre[1:], points[:, 1]]),
            localiser="cv2" if quad is None else "edges",
            flags=("unrefined",) if quad is None else (),
        )
