"""Displacement of one marker over time: x, y and z under one another, the phases marked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.text import Text

from olivevib.arrays import Floats, floats
from olivevib.tui.views.axes import LEFT, Frame, draw_axes
from olivevib.tui.views.cells import Cells, polyline
from olivevib.tui.views.palette import Palette


@dataclass(frozen=True)
class Band:
    """A named stretch of time, as a phase of the trial."""

    name: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class MotionPlot:
    """t_s (N,), one or two curves (N, 3) in ``unit``, NaN = not seen; bands: the phases.

    ``curves``: name -> values; the second one is drawn over the first.
    """

    title: str
    t_s: Floats
    curves: tuple[tuple[str, Floats], ...]
    unit: str
    bands: tuple[Band, ...] = ()

    def __post_init__(self) -> None:
        t_s = floats("t_s", self.t_s, (None,), nan=True)
        object.__setattr__(self, "t_s", t_s)
        curves = tuple((n, floats(n, v, (t_s.size, 3), nan=True)) for n, v in self.curves)
        object.__setattr__(self, "curves", curves)


def window(plot: MotionPlot, zoom: int, centre_s: float | None) -> tuple[float, float]:
    """The stretch on screen: the whole record, halved ``zoom`` times about ``centre_s``."""
    good = plot.t_s[np.isfinite(plot.t_s)]
    if good.size < 2:
        return 0.0, 1.0
    start, end = float(good.min()), float(good.max())
    half = (end - start) / 2 ** (zoom + 1)
    middle = (start + end) / 2 if centre_s is None else centre_s
    middle = min(max(middle, start + half), end - half)
    return middle - half, middle + half


def motion_plot(
    plot: MotionPlot, shown: tuple[float, float], size: tuple[int, int], palette: Palette
) -> Text:
    """The curves from shown[0] to shown[1] seconds in ``size`` (columns, rows)."""
    columns, rows = size
    cells = Cells(columns, rows)
    cells.put(1, 0, plot.title, palette.text)
    inside = (plot.t_s >= shown[0]) & (plot.t_s <= shown[1])
    height = (rows - 3) // 3
    if height < 2 or columns < LEFT + 10 or inside.sum() < 2:
        cells.put(1, rows // 2, "nothing to draw here", palette.muted)
        return cells.text()
    half = _half(plot, inside)
    for axis in range(3):
        _axis(cells, plot, axis, (shown, half, height, columns), palette)
    band_row(cells, plot.bands, shown, columns, palette)
    return cells.text()


def _half(plot: MotionPlot, inside: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    """Half the height of all three plots: one scale for x, y and z."""
    values = np.concatenate([np.abs(v[inside]).ravel() for _, v in plot.curves])
    good = values[np.isfinite(values)]
    return float(good.max()) * 1.05 if good.size and good.max() > 0 else 1.0


def _axis(
    cells: Cells,
    plot: MotionPlot,
    axis: int,
    place: tuple[tuple[float, float], float, int, int],
    palette: Palette,
) -> None:
    shown, half, height, columns = place
    top = 2 + axis * height
    frame = Frame(LEFT + 1, top, columns - LEFT - 2, height, *shown, -half, half)
    draw_axes(cells, frame, ("s", f"{'xyz'[axis]} {plot.unit}"), palette)
    for order, (_, values) in enumerate(plot.curves):
        x, y = frame.dot_x(plot.t_s), frame.dot_y(values[:, axis])
        style = palette.axes[axis] if order == 0 else palette.accent
        cells.dots(frame.x, frame.y, polyline(frame.shape, x, y), style)


def band_row(
    cells: Cells,
    bands: tuple[Band, ...],
    shown: tuple[float, float],
    columns: int,
    palette: Palette,
) -> None:
    """A row of phase names above the plots, each from its start to its end."""
    frame = Frame(LEFT + 1, 1, columns - LEFT - 2, 1, *shown, 0.0, 1.0)
    for band in bands:
        start, end = max(band.start_s, shown[0]), min(band.end_s, shown[1])
        if end <= start:
            continue
        first, last = frame.cell_x(start), frame.cell_x(end)
        style = palette.good if band.name == "steady" else palette.muted
        bar = f"├{band.name.center(max(0, last - first - 2), '─')[: max(0, last - first - 2)]}┤"
        cells.put(first, 1, bar if last - first > 1 else "│", style)
