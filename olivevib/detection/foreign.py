"""Foreign marker families (ArUco, AprilTag): found by OpenCV, measured by their drawing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection.blur import Blur
from olivevib.detection.card_fit import fit_card
from olivevib.detection.codes import read_modules, sample_points
from olivevib.detection.detection import Detection
from olivevib.detection.softcode import MASK
from olivevib.detection.template import card
from olivevib.detection.template_reader import SURE, Found, fitted_detection, sound
from olivevib.geometry import (
    apply_homography,
    diagonal_crossing,
    diagonal_crossing_jacobian,
    homography,
)
from olivevib.marker import MarkerLibrary

UNREFINED_SIGMA_PX = 0.35  # cv2 without refinement: 0.25-0.35 px per axis on rendered scenes
ALIKE = 0.87  # correlation of two drawings up to which the fit alone tells them apart (SURE)


def dictionary(name: str) -> Any:
    """OpenCV's predefined dictionary of that name; raises KeyError where it has none."""
    if not name.startswith("DICT_") or not hasattr(cv2.aruco, name):
        raise KeyError(name)
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


class ForeignReader:
    """Reads one OpenCV dictionary, dark on light and light on dark, in any grey image.

    OpenCV finds and reads the squares; each is then fitted by its drawing as the paper's markers
    are. Each polarity has a pass of its own: OpenCV's detectInvertedMarker looks for light squares
    with a threshold made for dark ones and misses a fifth of them. Corners are the outer corners of
    the square. Where the drawing does not fit, they are OpenCV's own, flagged "unrefined".
    """

    def __init__(self, library: MarkerLibrary) -> None:
        self.library = library
        layout = library.layout
        table = dictionary(library.dictionary)
        self._row = {int(i): k for k, i in enumerate(library.ids)}
        self._dark = [table.generateImageMarker(int(i), layout.modules) == 0 for i in library.ids]
        self.cards = [card(dark, layout.quiet) for dark in self._dark]
        self.far = _alike(self._dark) <= ALIKE
        self._tolerated = (library.distance - 1) // 2
        self._points = sample_points(layout, MASK)
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self._detector: Any = cv2.aruco.ArucoDetector(table, parameters)

    def detect(self, grey: Grey) -> list[Detection]:
        """All markers of the library in ``grey`` (H, W) uint8, sorted by id; the largest wins."""
        found: dict[int, Detection] = {}
        for inverted, image in ((False, grey), (True, 255 - grey)):
            for row, corners in self._quads(image):
                one = self._measure(image, row, corners, inverted)
                if one.id not in found or one.size_px > found[one.id].size_px:
                    found[one.id] = one
        return [found[i] for i in sorted(found)]

    def fit(
        self, grey: Grey, H: Floats, code: tuple[int, int, int], blur: Blur | None = None
    ) -> Found | None:
        """Fit the drawing of a row of the library from pose H, dark on light or light on dark."""
        for inverted, image in ((False, grey), (True, 255 - grey)):
            one = self._fit(image, H, code[0], blur or Blur(), inverted)
            if one is not None:
                return one
        return None

    def detection(self, one: Found) -> Detection:
        """What is said of a fitted marker."""
        return fitted_detection(self.library, one)

    def _quads(self, grey: Grey) -> Iterator[tuple[int, Floats]]:
        """Rows of the library and rough corners (4, 2) of the dark markers."""
        quads, ids, _ = self._detector.detectMarkers(grey)
        numbers = [] if ids is None else [int(i) for i in np.ravel(ids)]
        for quad, marker in zip(quads, numbers, strict=True):
            if marker in self._row:
                yield self._row[marker], np.asarray(quad, np.float64).reshape(4, 2)

    def _measure(self, grey: Grey, row: int, corners: Floats, inverted: bool) -> Detection:
        H = homography(self.library.layout.cornerstones, corners)
        one = self._fit(grey, H / H[2, 2], row, Blur(), inverted)
        return (
            _unrefined(int(self.library.ids[row]), corners) if one is None else self.detection(one)
        )

    def _fit(self, grey: Grey, H: Floats, row: int, blur: Blur, inverted: bool) -> Found | None:
        layout = self.library.layout
        card_fit = fit_card(grey, self.cards[row], H, layout, blur)
        if card_fit is None or not sound(card_fit.fit, H, layout.cornerstones):
            return None
        wrong = self._wrong(grey, card_fit.fit.H, row)
        if wrong > self._tolerated and not (self.far and card_fit.fit.whole_ncc >= SURE):
            return None
        return Found(row, card_fit.fit.H, card_fit, wrong, inverted)

    def _wrong(self, grey: Grey, H: Floats, row: int) -> int:
        """Modules that read the other way than the drawing of this row has them."""
        inside = apply_homography(H, self._points.reshape(-1, 2))
        if (inside < 0).any() or (inside > np.array(grey.shape[::-1]) - 1).any():
            return int(self._dark[row].size)
        levels = read_modules(grey, H[None], self._points)[0]
        dark = self._dark[row].ravel()
        middle = (np.median(levels[dark]) + np.median(levels[~dark])) / 2
        return int(((levels < middle) != dark).sum())


def _alike(dark: list[Any]) -> float:
    """The largest correlation of two drawings."""
    if len(dark) < 2:
        return 0.0
    flat = np.array([d.ravel() for d in dark], dtype=np.float32)
    flat -= flat.mean(axis=1, keepdims=True)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    together = flat @ flat.T
    np.fill_diagonal(together, -1)
    return float(together.max())


def _unrefined(marker: int, corners: Floats) -> Detection:
    covariance = np.eye(8) * UNREFINED_SIGMA_PX**2
    jacobian = diagonal_crossing_jacobian(corners)
    centre = diagonal_crossing(corners)
    return Detection(
        id=marker,
        corners_px=corners,
        corners_cov_px2=covariance,
        centre_px=centre,
        centre_cov_px2=jacobian @ covariance @ jacobian.T,
        raw_row=np.concatenate([centre[1:], corners[:, 1]]),
        localiser="cv2",
        flags=("unrefined",),
    )
