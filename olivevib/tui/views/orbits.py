"""Paths of the markers as small multiples: one plane, one mm scale, size and shape at a glance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from rich.text import Text

from olivevib.arrays import Floats, floats
from olivevib.tui.harmless import cut
from olivevib.tui.views.cells import Cells, polyline, scatter
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.ticks import label, nice

LEAST_COLUMNS, LEAST_ROWS = 16, 5  # of one tile
_EMPTY = np.empty((0, 3))


@dataclass(frozen=True)
class Plane:
    """Which axes are drawn to the right and upwards, with the sign that points there."""

    name: str
    words: str
    right: int
    up: int
    up_sign: float


PLANES = (
    Plane("front", "x right, y down", 0, 1, -1.0),
    Plane("above", "x right, z (away) up", 0, 2, 1.0),
    Plane("side", "z (away) right, y down", 2, 1, -1.0),
)


@dataclass(frozen=True)
class Orbit:
    """One marker's motion about its mean: path_mm (N, 3), NaN = not seen.

    ellipse_mm (K, 3): the dominant line's closed curve, empty where its status does not allow one;
    caption: what to write beside the id.
    """

    id: int
    caption: str
    path_mm: Floats
    ellipse_mm: Floats

    def __post_init__(self) -> None:
        for name in ("path_mm", "ellipse_mm"):
            value = floats(name, getattr(self, name), (None, 3), nan=True)
            object.__setattr__(self, name, value)


class Tile(NamedTuple):
    """The cells of one orbit: corner, width and height."""

    x: int
    y: int
    columns: int
    rows: int


class Page(NamedTuple):
    """Which orbits are on screen, and where: tile k holds orbit first + k."""

    first: int
    tiles: tuple[Tile, ...]


def page_of(orbits: Sequence[Orbit], plane: Plane, chosen: int, size: tuple[int, int]) -> Page:
    """The page of small multiples that holds orbit number ``chosen``; the last row is the scale."""
    columns, rows = size[0], size[1] - 1
    most = max(1, columns // LEAST_COLUMNS) * max(1, rows // LEAST_ROWS)
    first = (max(0, chosen) // most) * most
    count = min(most, len(orbits) - first)
    if count < 1:
        return Page(0, ())
    spans = spans_mm(orbits, plane)

    def needed(across: int) -> tuple[float, int]:
        return _mm_per_dot(spans, columns // across, rows // -(-count // across)), across

    across = min((a for a in range(1, count + 1) if columns // a >= LEAST_COLUMNS), key=needed,
                 default=1)  # fmt: skip
    width, height = columns // across, rows // -(-count // across)
    return Page(
        first,
        tuple(Tile(k % across * width, k // across * height, width, height) for k in range(count)),
    )


def spans_mm(orbits: Sequence[Orbit], plane: Plane) -> Floats:
    """(2,) the largest extent of any orbit to the right and upwards; 0 without a path."""
    spans = [np.zeros(2)]
    for orbit in orbits:
        points = np.vstack([orbit.path_mm, orbit.ellipse_mm])[:, [plane.right, plane.up]]
        if np.isfinite(points).any():
            spans.append(np.nanmax(points, axis=0) - np.nanmin(points, axis=0))
    return np.asarray(np.max(spans, axis=0))


def _mm_per_dot(spans: Floats, columns: int, rows: int) -> float:
    """The scale at which the largest orbit just fits a tile."""
    room = np.maximum(1, [2 * columns - 4, 4 * (rows - 1) - 2])
    return float(np.max(spans / room))


def orbit_at(page: Page, x: int, y: int) -> int | None:
    """The number of the orbit that cell (x, y) belongs to, or None."""
    for k, tile in enumerate(page.tiles):
        if tile.x <= x < tile.x + tile.columns and tile.y <= y < tile.y + tile.rows:
            return page.first + k
    return None


def orbits_plot(
    orbits: Sequence[Orbit],
    plane: Plane,
    chosen: int,
    size: tuple[int, int],
    palette: Palette,
) -> Text:
    """The small multiples in ``size`` (columns, rows); ``chosen`` is marked with ▶."""
    cells = Cells(*size)
    if size[0] < LEAST_COLUMNS or size[1] <= LEAST_ROWS:
        return cells.text()
    page = page_of(orbits, plane, chosen, size)
    scale = mm_per_dot(orbits, plane, page)
    for k, tile in enumerate(page.tiles):
        number = page.first + k
        _draw(cells, tile, orbits[number], plane, scale, palette, number == chosen)
    shown = len(page.tiles)
    part = (
        "" if shown == len(orbits) else f"   {page.first + 1}–{page.first + shown} of {len(orbits)}"
    )
    _scale_bar(cells, scale, f"{plane.name}: {plane.words}{part}", palette)
    return cells.text()


def mm_per_dot(orbits: Sequence[Orbit], plane: Plane, page: Page) -> float:
    """The one scale of all tiles: the largest orbit of all markers just fits; NaN without any."""
    if not page.tiles:
        return float("nan")
    tile = page.tiles[0]
    return _mm_per_dot(spans_mm(orbits, plane), tile.columns, tile.rows) or float("nan")


def _draw(
    cells: Cells,
    tile: Tile,
    orbit: Orbit,
    plane: Plane,
    scale: float,
    palette: Palette,
    chosen: bool,
) -> None:
    mark = "▶" if chosen else " "
    title = cut(f"{mark}{orbit.id} {orbit.caption}", tile.columns - 1)
    cells.put(tile.x, tile.y, title, palette.accent if chosen else palette.text)
    if not np.isfinite(orbit.path_mm).any():
        cells.put(tile.x + 2, tile.y + tile.rows // 2, "not seen", palette.muted)
        return
    shape = (4 * (tile.rows - 1), 2 * (tile.columns - 1))
    middle = _middle(orbit.path_mm)
    for points, style, draw in (
        (orbit.path_mm, palette.muted, scatter),
        (orbit.ellipse_mm, palette.accent if chosen else palette.good, polyline),
    ):
        if points.size:
            x, y = _dots(points - middle, plane, scale, shape)
            cells.dots(tile.x, tile.y + 1, draw(shape, x, y), style)


def _middle(points: Floats) -> Floats:
    return np.asarray((np.nanmax(points, axis=0) + np.nanmin(points, axis=0)) / 2)


def _dots(
    points: Floats, plane: Plane, scale: float, shape: tuple[int, int]
) -> tuple[Floats, Floats]:
    """Dot coordinates of points in mm about the middle of a tile."""
    x = points[:, plane.right] / scale + (shape[1] - 1) / 2
    y = -plane.up_sign * points[:, plane.up] / scale + (shape[0] - 1) / 2
    return np.asarray(x), np.asarray(y)


def _scale_bar(cells: Cells, scale: float, words: str, palette: Palette) -> None:
    if not np.isfinite(scale):
        cells.put(1, cells.rows - 1, "no marker has a path yet", palette.muted)
        return
    length = nice(2 * max(4, cells.columns // 6) * scale)
    bar = max(0, round(length / scale / 2) - 2)
    text = f"├{'─' * bar}┤ {label(length)} mm"
    cells.put(1, cells.rows - 1, text, palette.text)
    cells.put(len(text) + 4, cells.rows - 1, words, palette.muted)
