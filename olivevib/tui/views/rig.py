"""Where the cameras stand, in space: both viewing cones and the markers, from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.style import Style
from rich.text import Text

from olivevib.arrays import Floats, floats
from olivevib.tui.views.cells import Cells, polyline, scatter
from olivevib.tui.views.palette import Palette

TURN, LIFT = np.radians(35.0), np.radians(30.0)  # of the eye about the vertical, and above it
CONE = 0.35  # length of a viewing cone in distances to the scene


@dataclass(frozen=True)
class Stand:
    """One camera: name, centre (3,) and axes (3, 3; rows right, down, forward), half angles."""

    name: str
    centre_mm: Floats
    axes: Floats
    half_across: float
    half_down: float


@dataclass(frozen=True)
class RigScene:
    """Both cameras and points_mm (K, 3) of the scene, in the left camera's frame."""

    stands: tuple[Stand, ...]
    points_mm: Floats
    words: str

    def __post_init__(self) -> None:
        points = floats("points_mm", self.points_mm, (None, 3))
        object.__setattr__(self, "points_mm", points)


def rig_plot(scene: RigScene, size: tuple[int, int], palette: Palette) -> Text:
    """The scene in ``size`` (columns, rows), one mm scale for all directions."""
    cells = Cells(*size)
    columns, rows = size
    if columns < 20 or rows < 6:
        return cells.text()
    far = _distance(scene)
    cones = [_cone(stand, CONE * far) for stand in scene.stands]
    every = np.vstack([scene.points_mm, *cones])
    low, scale = _fit(every, columns, rows - 1)
    shape = (4 * (rows - 1), 2 * columns)

    def dots(points: Floats) -> tuple[Floats, Floats]:
        flat = (_flat(points) - low) / scale
        return flat[:, 0] + 2, shape[0] - 3 - flat[:, 1]

    for stand, cone, style in zip(scene.stands, cones, palette.axes, strict=False):
        cells.dots(0, 0, polyline(shape, *dots(cone)), style)
        x, y = dots(stand.centre_mm[None])
        _name(cells, stand.name, int(x[0] // 2), int(y[0] // 4), style)
    if scene.points_mm.size:
        cells.dots(0, 0, scatter(shape, *dots(scene.points_mm)), palette.accent)
    cells.put(1, rows - 1, scene.words, palette.muted)
    return cells.text()


def _distance(scene: RigScene) -> float:
    if scene.points_mm.size:
        return float(np.median(np.linalg.norm(scene.points_mm, axis=1)))
    base = np.linalg.norm(scene.stands[-1].centre_mm - scene.stands[0].centre_mm)
    return 3 * float(base) or 1000.0


def _cone(stand: Stand, length: float) -> Floats:
    """The edges of a viewing cone as one line."""
    across, down = np.tan(stand.half_across), np.tan(stand.half_down)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    ends = np.column_stack([signs * [across, down], np.ones(4)]) @ stand.axes * length
    corners = stand.centre_mm + ends
    order = (0, 1, 2, 3, 0)
    line = [corners[k] for k in order]
    for corner in corners:
        line += [np.full(3, np.nan), stand.centre_mm, corner]
    return np.array(line)


def _flat(points: Floats) -> Floats:
    """Right and up of points (x right, y down, z away) as the eye sees them."""
    x, y, z = points.T
    c, s = np.cos(TURN), np.sin(TURN)
    return np.column_stack([c * x - s * z, np.sin(LIFT) * (s * x + c * z) - np.cos(LIFT) * y])


def _fit(points: Floats, columns: int, rows: int) -> tuple[Floats, float]:
    flat = _flat(points)
    low = np.nanmin(flat, axis=0)
    span = np.nanmax(flat, axis=0) - low
    room = np.array([2 * columns - 6, 4 * rows - 6])
    return low, float(np.max(span / room)) or 1.0


def _name(cells: Cells, name: str, x: int, y: int, style: Style) -> None:
    cells.put(min(x + 1, cells.columns - len(name)), max(0, y), name, style)
