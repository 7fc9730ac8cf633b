"""What a coded planar marker is: the layout of location bars and code area, and a library."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints, bools, ints


@dataclass(frozen=True)
class MarkerLayout:
    """The printed grid of a marker; the paper's is 11 modules a side with a 7 x 7 code area.

    Module coordinates count centres from 1, x right, y down, as printed (paper, section 3).
    The marker's size in mm is the outer side of its dark square: all ``modules`` modules.
    Bars as long as the marker close to the dark frame of ArUco and AprilTag markers.
    """

    modules: int = 11
    code: int = 7  # modules a side of the code area, centred
    bar: int = 7  # length of a location bar, centred on its side, one module wide
    quiet: int = 2  # white modules around the marker

    def __post_init__(self) -> None:
        ring = 2 if self.framed else 4  # a bar stands one white module off the code area
        if not (0 < self.code <= self.modules - ring and (self.modules - self.code) % 2 == 0):
            raise ValueError(f"a code area of {self.code} does not fit {self.modules} modules")
        if not (
            self.framed or (0 < self.bar <= self.modules - 4 and (self.modules - self.bar) % 2 == 0)
        ):
            raise ValueError(f"a bar of {self.bar} does not fit {self.modules} modules")
        if self.quiet < 1:
            raise ValueError(f"the quiet zone must be at least one module, got {self.quiet}")

    @property
    def framed(self) -> bool:
        """Whether the four bars close to one dark frame, as in foreign families."""
        return self.bar == self.modules

    @property
    def cornerstones(self) -> Floats:
        """P1…P4, clockwise as printed from upper left, as centred module coordinates (4, 2).

        The crossings of the bars' axes; of a framed layout the outer corners of the dark square.
        """
        a = self.modules / 2 if self.framed else (self.modules - 1) / 2
        return np.array([[-a, -a], [a, -a], [a, a], [-a, a]])

    def pattern(self, code: Bools) -> Bools:
        """The whole marker, (modules, modules), True where a module is dark."""
        n, c, b = self.modules, self.code, self.bar
        dark = np.zeros((n, n), dtype=np.bool_)
        bar = slice((n - b) // 2, (n + b) // 2)
        dark[0, bar] = dark[-1, bar] = dark[bar, 0] = dark[bar, -1] = True
        area = slice((n - c) // 2, (n + c) // 2)
        dark[area, area] = bools("code", code, (c, c))
        return dark


@dataclass(frozen=True)
class MarkerLibrary:
    """Marker ids with their codes; ``family`` says which detector reads them.

    ids (M,); codes (M, c, c) True where dark; distance: smallest Hamming distance over rotations,
    also to mirror images where ``mirrors`` is set (only then can a mirrored video be told).
    ``family`` is "olive" for the paper's layout, "aruco" or "apriltag" for foreign families, whose
    codes stay with OpenCV (codes is then (M, 0, 0) and ``dictionary`` names them).
    """

    name: str
    ids: Ints
    codes: Bools
    layout: MarkerLayout
    distance: int
    family: str = "olive"
    dictionary: str = ""
    mirrors: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", ints("ids", self.ids, (None,)))
        side = self.layout.code if self.family == "olive" else 0
        object.__setattr__(self, "codes", bools("codes", self.codes, (self.ids.size, side, side)))
        if np.unique(self.ids).size != self.ids.size:
            raise ValueError(f"library {self.name} has repeated ids")

    def only(self, wanted: tuple[int, ...]) -> MarkerLibrary:
        """The same library with the ids ``wanted`` alone; raises KeyError for an unknown id."""
        at = {int(i): k for k, i in enumerate(self.ids)}
        pick = np.array([at[i] for i in wanted], dtype=np.int64)
        return replace(self, ids=self.ids[pick], codes=self.codes[pick])

    def code(self, wanted: int) -> Bools:
        """The code (c, c) of one id, True where dark; raises KeyError for an unknown id."""
        found: Bools = self.only((wanted,)).codes[0]
        return found
