"""The frame of a plot: where its dots go, its ticks with units, log or linear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.tui.views.cells import Cells
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.ticks import label, linear

LEFT = 7  # cells for the numbers of the y axis


@dataclass(frozen=True)
class Frame:
    """A plot of x_low…x_high over y_low…y_high (log10 where ``log_y``) in a rectangle of cells.

    The cells of the plot itself start at (x, y); ticks stand left of it and below.
    """

    x: int
    y: int
    columns: int
    rows: int
    x_low: float
    x_high: float
    y_low: float
    y_high: float
    log_y: bool = False

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the bitmap."""
        return 4 * self.rows, 2 * self.columns

    def dot_x(self, value: Floats | float) -> Floats:
        """Dot column of x values."""
        share = (np.asarray(value, float) - self.x_low) / (self.x_high - self.x_low)
        return np.asarray(share * (2 * self.columns - 1))

    def dot_y(self, value: Floats | float) -> Floats:
        """Dot row of y values, 0 at the top."""
        v = np.asarray(value, float)
        if self.log_y:
            v = np.log10(np.maximum(v, 10.0 ** (self.y_low - 9)))
        share = (v - self.y_low) / (self.y_high - self.y_low)
        return np.asarray((1 - share) * (4 * self.rows - 1))

    def cell_x(self, value: float) -> int:
        """Cell column of an x value."""
        return self.x + int(self.dot_x(value) // 2)

    def value_at(self, cell_x: int) -> float:
        """The x value at the middle of a cell column."""
        share = (2 * (cell_x - self.x) + 0.5) / (2 * self.columns - 1)
        return float(self.x_low + share * (self.x_high - self.x_low))


def draw_axes(cells: Cells, frame: Frame, units: tuple[str, str], palette: Palette) -> None:
    """Ticks and units of both axes, left of the plot and in the row below it."""
    x_unit, y_unit = units
    _y_axis(cells, frame, y_unit, palette)
    below, end = frame.y + frame.rows, frame.x + frame.columns - len(x_unit) - 1
    for value in linear(frame.x_low, frame.x_high, max(1, frame.columns // 10)):
        text, at = label(float(value)), frame.cell_x(float(value))
        cells.put(at, below, "╵", palette.muted)
        if at + 1 + len(text) <= end:
            cells.put(at + 1, below, text, palette.muted)
    cells.put_right(frame.x + frame.columns, below, x_unit, palette.text)


def _y_axis(cells: Cells, frame: Frame, unit: str, palette: Palette) -> None:
    for row in range(frame.rows):
        cells.put(frame.x - 1, frame.y + row, "│", palette.muted)
    for value in _y_ticks(frame):
        raised = 10.0**value if frame.log_y else value
        row = frame.y + int(frame.dot_y(raised) // 4)
        if frame.y < row < frame.y + frame.rows:
            cells.put_right(frame.x - 1, row, label(round(float(raised), 9)), palette.muted)
            cells.put(frame.x - 1, row, "┤", palette.muted)
    cells.put_right(frame.x - 1, frame.y, unit, palette.text)


def _y_ticks(frame: Frame) -> Floats:
    if not frame.log_y:
        return linear(frame.y_low, frame.y_high, max(1, frame.rows // 2))
    decades = np.arange(np.ceil(frame.y_low), np.floor(frame.y_high) + 1)
    return decades[:: max(1, -(-decades.size // max(1, frame.rows // 2)))]
