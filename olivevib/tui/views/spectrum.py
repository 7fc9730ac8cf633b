"""The spectrum of one marker: log amplitude over frequency, its line marked with its status."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.cells import cell_len
from rich.style import Style
from rich.text import Text

from olivevib.arrays import Floats, floats
from olivevib.tui.views.axes import LEFT, Frame, draw_axes
from olivevib.tui.views.cells import Cells, polyline
from olivevib.tui.views.palette import Palette

DECADES = 5.0  # below the largest value


@dataclass(frozen=True)
class Mark:
    """A marked frequency of the plot: where it is seen, what to say, whether it is decided."""

    seen_hz: float
    words: str
    decided: bool


@dataclass(frozen=True)
class SpectrumPlot:
    """f_hz (F,), amplitude (F,) in ``unit``; title names marker, axis and phase."""

    title: str
    f_hz: Floats
    amplitude: Floats
    unit: str
    marks: tuple[Mark, ...]

    def __post_init__(self) -> None:
        f_hz = floats("f_hz", self.f_hz, (None,))
        object.__setattr__(self, "f_hz", f_hz)
        amplitude = floats("amplitude", self.amplitude, (f_hz.size,), nan=True)
        object.__setattr__(self, "amplitude", amplitude)


def folded(f_hz: float, rate_hz: float) -> float:
    """Where a frequency shows in the spectrum of samples taken at ``rate_hz``."""
    return abs(f_hz - rate_hz * round(f_hz / rate_hz))


def frame_of(plot: SpectrumPlot, columns: int, rows: int) -> Frame | None:
    """The plot's frame in ``columns`` x ``rows``; None where there is nothing to draw."""
    good = plot.amplitude[np.isfinite(plot.amplitude) & (plot.amplitude > 0)]
    if good.size < 2 or columns < LEFT + 10 or rows < 6:
        return None
    top = float(np.log10(good.max())) + 0.15
    low = max(float(np.log10(good.min())), top - DECADES) - 0.05
    place = (LEFT + 1, 2, columns - LEFT - 2, rows - 3)
    return Frame(*place, float(plot.f_hz[0]), float(plot.f_hz[-1]), low, top, log_y=True)


def spectrum_plot(
    plot: SpectrumPlot, cursor_hz: float | None, size: tuple[int, int], palette: Palette
) -> Text:
    """The spectrum in ``size`` (columns, rows), with the cursor's reading in the title row."""
    columns, rows = size
    cells = Cells(columns, rows)
    cells.put(1, 0, plot.title, palette.text)
    frame = frame_of(plot, columns, rows)
    if frame is None:
        cells.put(1, rows // 2, "no spectrum: not known, or the pane is too small", palette.muted)
        return cells.text()
    draw_axes(cells, frame, ("Hz", plot.unit), palette)
    for mark in plot.marks:
        _upright(cells, frame, mark.seen_hz, "┊", palette.good if mark.decided else palette.warn)
    x, y = frame.dot_x(plot.f_hz), frame.dot_y(plot.amplitude)
    y = np.where(np.isfinite(plot.amplitude), y, np.nan)
    cells.dots(frame.x, frame.y, polyline(frame.shape, x, y), palette.axes[0])
    _words(cells, frame, plot.marks, palette)
    if cursor_hz is not None:
        _cursor(cells, frame, plot, cursor_hz, palette)
    return cells.text()


def _upright(cells: Cells, frame: Frame, f_hz: float, glyph: str, style: Style) -> None:
    for row in range(frame.rows):
        cells.put(frame.cell_x(f_hz), frame.y + row, glyph, style)


def _words(cells: Cells, frame: Frame, marks: tuple[Mark, ...], palette: Palette) -> None:
    """The words of each mark in the row above the plot, beside an arrow at its frequency."""
    for mark in marks:
        style = palette.good if mark.decided else palette.warn
        _beside(cells, frame.cell_x(mark.seen_hz), 1, "▾", mark.words, style)


def _beside(cells: Cells, x: int, y: int, glyph: str, words: str, style: Style) -> None:
    """A glyph at x with its words right of it, or left of it where the pane ends."""
    cells.put(x, y, glyph, style)
    width = cell_len(words)
    if x + 2 + width <= cells.columns:
        cells.put(x + 2, y, words, style)
    else:
        start = x - 1 - width if x - 1 - width >= 0 else max(0, cells.columns - width)
        cells.put(start, y, words, style)


def _cursor(
    cells: Cells, frame: Frame, plot: SpectrumPlot, cursor_hz: float, palette: Palette
) -> None:
    nearest = int(np.argmin(np.abs(plot.f_hz - cursor_hz)))
    f_hz, value = float(plot.f_hz[nearest]), plot.amplitude[nearest]
    _upright(cells, frame, f_hz, "│", palette.accent)
    told = f"{value:.3g} {plot.unit}" if np.isfinite(value) else "not known"
    _beside(cells, frame.cell_x(f_hz), 2, "│", f"{f_hz:.3f} Hz {told}", palette.accent)


def next_peak(plot: SpectrumPlot, cursor_hz: float | None, step: int) -> float:
    """The neighbouring local maximum to the right (step 1) or left (-1) that stands out."""
    a = np.nan_to_num(plot.amplitude)
    inner = np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])) + 1
    tall = inner[a[inner] > 5 * np.median(a)] if inner.size else inner
    at = plot.f_hz[0] if cursor_hz is None else cursor_hz
    peaks = plot.f_hz[tall if tall.size else inner]
    onward = peaks[peaks > at + 1e-9] if step > 0 else peaks[peaks < at - 1e-9][::-1]
    return float(onward[0]) if onward.size else float(at)
