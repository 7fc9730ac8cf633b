"""A printed page as geometry in mm: dark areas, lines and labels, before any file format."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.errors import UsageError

PAPERS_MM = {
    "A0": (841.0, 1189.0),
    "A1": (594.0, 841.0),
    "A2": (420.0, 594.0),
    "A3": (297.0, 420.0),
    "A4": (210.0, 297.0),
    "A5": (148.0, 210.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}
LANDSCAPE = "-landscape"
EM = 0.6  # widest mean letter of a label, in font heights (Helvetica: digits 0.556)

Point = tuple[float, float]  # x right, y down from the upper left corner of the page, mm


@dataclass(frozen=True)
class Area:
    """A dark area bounded by closed loops (K, 2) of corners, mm; even-odd rule."""

    loops: tuple[Floats, ...]


@dataclass(frozen=True)
class Line:
    """A straight line; ``dash_mm`` 0 is solid; ``grey`` 0 is black, 1 white."""

    start: Point
    end: Point
    width_mm: float = 0.2
    dash_mm: float = 0.0
    grey: float = 0.0


@dataclass(frozen=True)
class Label:
    """A text whose base line starts at ``at``; ``height_mm`` is the font size."""

    at: Point
    text: str
    height_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", printable(self.text))


@dataclass(frozen=True)
class Page:
    """One page at true scale, mm."""

    width_mm: float
    height_mm: float
    areas: tuple[Area, ...] = ()
    lines: tuple[Line, ...] = ()
    labels: tuple[Label, ...] = field(default=())


def printable(text: str) -> str:
    """The text with control characters and the like replaced by question marks."""
    return "".join(c if c.isprintable() else "?" for c in text)


def paper_size(name: str) -> tuple[float, float]:
    """Width and height of a paper in mm, A4 exactly 210 x 297; ``A4-landscape`` lies on its side.

    Raises UsageError that lists the known papers.
    """
    upright = name.lower().removesuffix(LANDSCAPE)
    sizes = {key.lower(): size for key, size in PAPERS_MM.items()}
    if upright not in sizes:
        raise UsageError(
            f"There is no paper {name}",
            f"Known are {', '.join(PAPERS_MM)}, each also with {LANDSCAPE}.",
            "Name one of these with --paper.",
        )
    width, height = sizes[upright]
    return (height, width) if name.lower().endswith(LANDSCAPE) else (width, height)


def outline(dark: Bools, origin: Point, module_mm: float) -> Area:
    """The dark modules of a pattern (R, C) as one area without inner seams.

    ``origin`` is the upper left corner of module (0, 0) on the page, mm.
    """
    loops = [np.array(loop, dtype=np.float64) * module_mm + origin for loop in _loops(dark)]
    return Area(tuple(loops))


def _loops(dark: Bools) -> list[list[tuple[int, int]]]:
    """Closed loops of grid corners (x, y) round the dark modules, straight runs joined."""
    padded = np.pad(dark, 1)
    following: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for y, x in np.argwhere(padded):
        corners = [(x - 1, y - 1), (x, y - 1), (x, y), (x - 1, y)]  # clockwise
        beside = [padded[y - 1, x], padded[y, x + 1], padded[y + 1, x], padded[y, x - 1]]
        for k, inside in enumerate(beside):
            if not inside:
                start = (int(corners[k][0]), int(corners[k][1]))
                end = corners[(k + 1) % 4]
                following.setdefault(start, []).append((int(end[0]), int(end[1])))
    loops = []
    while following:
        start = min(following)
        loop = [start]
        while (at := _step(following, loop[-1])) != start:
            loop.append(at)
        loops.append(_corners_only(loop))
    return loops


def _step(
    following: dict[tuple[int, int], list[tuple[int, int]]], at: tuple[int, int]
) -> tuple[int, int]:
    ends = following[at]
    step = ends.pop()
    if not ends:
        del following[at]
    return step


def _corners_only(loop: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The loop without the points where it runs straight on."""
    kept = []
    for k, (x, y) in enumerate(loop):
        (xa, ya), (xb, yb) = loop[k - 1], loop[(k + 1) % len(loop)]
        if (x - xa) * (yb - y) != (y - ya) * (xb - x):
            kept.append((x, y))
    return kept


def ruler(at: Point, length_mm: int = 150) -> tuple[list[Line], list[Label]]:
    """A horizontal ruler from ``at`` to the right with millimetre marks above its base line."""
    x, y = at
    lines = [Line((x, y), (x + length_mm, y))]
    labels = []
    for mm in range(length_mm + 1):
        height = 5.0 if mm % 10 == 0 else 3.5 if mm % 5 == 0 else 2.0
        lines.append(Line((x + mm, y), (x + mm, y - height), 0.1))
        if mm % 10 == 0:
            labels.append(Label((x + mm + 0.5, y - 3.2), str(mm), 2.4))
    says = f"{length_mm} mm: measure this ruler; if it is not {length_mm} mm long, print at 100 %"
    return lines, [*labels, Label((x, y + 3.5), says, 2.8)]


def cut_lines(x: tuple[float, float], y: tuple[float, float]) -> list[Line]:
    """A dashed grey rectangle from x[0], y[0] to x[1], y[1], mm; neighbours share equal lines."""
    (left, right), (top, bottom) = ([round(value, 4) for value in ends] for ends in (x, y))
    sides = [
        ((left, top), (right, top)),
        ((left, bottom), (right, bottom)),
        ((left, top), (left, bottom)),
        ((right, top), (right, bottom)),
    ]
    return [Line(start, end, 0.15, 2.0, 0.45) for start, end in sides]


def fitted_height(text: str, width_mm: float, largest_mm: float) -> float:
    """Font height, at most ``largest_mm``, at which ``text`` stays within ``width_mm``."""
    return min(largest_mm, width_mm / (EM * max(len(text), 1)))
