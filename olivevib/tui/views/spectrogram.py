"""How the frequencies of one marker change in time: shades over time and frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.text import Text

from olivevib.arrays import Floats, floats
from olivevib.tui.views.axes import LEFT, Frame, draw_axes
from olivevib.tui.views.cells import Cells
from olivevib.tui.views.motion import Band, band_row
from olivevib.tui.views.palette import Palette

SHADES = " ░▒▓█"
RANGE_DB = 40.0


@dataclass(frozen=True)
class ShadePlot:
    """t_s (K,), f_hz (F,), power (F, K) in mm², NaN = too few samples; bands: the phases."""

    title: str
    t_s: Floats
    f_hz: Floats
    power: Floats
    bands: tuple[Band, ...] = ()

    def __post_init__(self) -> None:
        shape = (np.asarray(self.f_hz).size, np.asarray(self.t_s).size)
        for name, size in (("t_s", shape[1:]), ("f_hz", shape[:1]), ("power", shape)):
            value = floats(name, getattr(self, name), size, nan=name == "power")
            object.__setattr__(self, name, value)


def shade_plot(plot: ShadePlot, size: tuple[int, int], palette: Palette) -> Text:
    """The plot in ``size`` (columns, rows); a full block is the strongest, a blank 40 dB less."""
    columns, rows = size
    cells = Cells(columns, rows)
    cells.put(1, 0, plot.title, palette.text)
    if columns < LEFT + 10 or rows < 8:
        return cells.text()
    span = (float(plot.t_s[0]), float(plot.t_s[-1]))
    reach = (float(plot.f_hz[0]), float(plot.f_hz[-1]))
    frame = Frame(LEFT + 1, 2, columns - LEFT - 2, rows - 3, *span, *reach)
    draw_axes(cells, frame, ("s", "Hz"), palette)
    levels = _levels(plot, frame)
    for row in range(frame.rows):
        shades = "".join(SHADES[v] for v in levels[row])
        cells.put(frame.x, frame.y + row, shades, palette.axes[0])
    band_row(cells, plot.bands, span, columns, palette)
    return cells.text()


def _levels(plot: ShadePlot, frame: Frame) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """(rows, columns) shade of each cell: the strongest power that falls into it."""
    down = np.clip(frame.dot_y(plot.f_hz) // 4, 0, frame.rows - 1).astype(np.int64)
    out = np.full((frame.rows, plot.t_s.size), -1.0)
    np.maximum.at(out, down, np.nan_to_num(plot.power, nan=-1.0))
    known = np.unique(down)
    filled = known[np.argmin(np.abs(np.arange(frame.rows)[:, None] - known), axis=1)]
    middles = [frame.value_at(frame.x + k) for k in range(frame.columns)]
    nearest = np.argmin(np.abs(plot.t_s[:, None] - np.array(middles)), axis=0)
    power = out[filled][:, nearest]
    top = max(float(power.max()), 1e-30)
    level = 10 * np.log10(np.maximum(power / top, 1e-12))
    share = np.clip(1 + level / RANGE_DB, 0, 1) * (power >= 0)
    return np.asarray(np.rint(share * (len(SHADES) - 1)).astype(np.int64))
