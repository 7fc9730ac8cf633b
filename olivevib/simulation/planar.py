"""Flat printed things: markers and what they are made of, dark rectangles on a white card."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats, floats
from olivevib.errors import UsageError
from olivevib.marker import MarkerLibrary

PREFIX = {"aruco": "", "apriltag": "DICT_APRILTAG_"}


@dataclass(frozen=True)
class Planar:
    """A flat print: dark rectangles on a white card, mm, origin at the centre, x right, y down.

    dark_mm (K, 4) and card_mm (4,) are left, top, right, bottom; the dark ones do not overlap.
    ``inverted``: white print on a dark card.
    """

    dark_mm: Floats
    card_mm: Floats
    inverted: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "dark_mm", floats("dark_mm", self.dark_mm, (None, 4)))
        object.__setattr__(self, "card_mm", floats("card_mm", self.card_mm, (4,)))
        boxes = np.vstack([self.dark_mm, self.card_mm])
        if (boxes[:, 2:] <= boxes[:, :2]).any():
            raise ValueError("a rectangle is empty: left, top must be less than right, bottom")

    @property
    def card_corners_mm(self) -> Floats:
        """The card's corners (4, 2), clockwise from upper left."""
        x0, y0, x1, y1 = self.card_mm
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])

    def moved(self, by_mm: Floats) -> Planar:
        """The same print with every coordinate moved by (2,) mm."""
        step = np.tile(np.asarray(by_mm, dtype=np.float64), 2)
        return replace(self, dark_mm=self.dark_mm + step, card_mm=self.card_mm + step)


def from_modules(dark: Bools, module_mm: float, quiet_modules: float) -> Planar:
    """The print of a module pattern (R, C), True where dark, with a white rim around it."""
    rows, columns = dark.shape
    size = np.array([columns, rows]) * module_mm
    rim = quiet_modules * module_mm
    card = np.array([-size[0] / 2 - rim, -size[1] / 2 - rim, size[0] / 2 + rim, size[1] / 2 + rim])
    return Planar(runs(dark) * module_mm - np.tile(size / 2, 2), card)


def runs(dark: Bools) -> Floats:
    """Rectangles (K, 4) of the dark runs of each row, in modules from the upper left corner."""
    boxes: list[tuple[int, int, int, int]] = []
    for row, cells in enumerate(dark):
        padded = np.concatenate([[False], cells, [False]])
        edges = np.flatnonzero(padded[1:] != padded[:-1])
        boxes += [(int(a), row, int(b), row + 1) for a, b in edges.reshape(-1, 2)]
    return np.array(boxes, dtype=np.float64).reshape(-1, 4)


def dictionary(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of a name such as DICT_4X4_50; UsageError for an unknown one."""
    number = getattr(cv2.aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        raise UsageError(
            f"there is no ArUco dictionary {name}",
            remedy="name one of OpenCV's, such as DICT_4X4_50 or DICT_APRILTAG_36h11",
        )
    return cv2.aruco.getPredefinedDictionary(number)


def dictionary_modules(name: str, marker: int) -> Bools:
    """The modules (n + 2, n + 2) of a dictionary's marker with its dark border, True where dark."""
    book = dictionary(name)
    if not 0 <= marker < len(book.bytesList):
        raise UsageError(f"{name} has no marker {marker}; it has 0 to {len(book.bytesList) - 1}")
    side = int(book.markerSize) + 2
    drawn = cv2.aruco.generateImageMarker(book, marker, side, borderBits=1)
    return np.asarray(drawn) < 128


def foreign_dictionary(library: str) -> str | None:
    """The dictionary of ``aruco:NAME`` or ``apriltag:36h11``; None for any other library name."""
    family, _, name = library.partition(":")
    return PREFIX[family] + name if family in PREFIX and name else None


def marker_planar(
    library: str, marker: int, size_mm: float, codes: MarkerLibrary | None = None
) -> Planar:
    """The print of one marker; ``size_mm`` is the outer side of its dark square.

    ``library`` is ``aruco:…``, ``apriltag:…`` or the name of ``codes``, which holds our own layout.
    Foreign markers stand on a card with one module of quiet zone, ours with the layout's.
    """
    name = foreign_dictionary(library)
    if name is not None:
        dark = dictionary_modules(name, marker)
        return from_modules(dark, size_mm / dark.shape[0], 1.0)
    if codes is None:
        raise UsageError(f"the codes of library {library} are needed to draw its markers")
    layout = codes.layout
    code = codes.only((marker,)).codes[0]
    return from_modules(layout.pattern(code), size_mm / layout.modules, float(layout.quiet))


def corners_mm(size_mm: float) -> Floats:
    """Outer corners (4, 2) of the dark square, clockwise as printed from upper left."""
    half = size_mm / 2
    return np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
