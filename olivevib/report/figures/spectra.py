"""Amplitude spectrum and power spectral density of each marker and axis, with the marked line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from olivevib.arrays import Floats
from olivevib.report.figures import canvas
from olivevib.report.words import measure, plain, unit_text
from olivevib.vibration.types import Line, LineStatus, Spectrum


def noise_floor(f_hz: Floats, values: Floats, line_hz: float, resolution_hz: float) -> float:
    """The median of a spectrum (F,) away from its line (and from zero): what noise alone gives."""
    near = np.abs(f_hz - line_hz) < 4 * resolution_hz if np.isfinite(line_hz) else f_hz < 0
    rest = values[(f_hz > 2 * resolution_hz) & ~near]
    rest = rest[np.isfinite(rest)]
    return float(np.median(rest)) if rest.size else float("nan")


def seen_at_hz(line: Line, nyquist_hz: float) -> float:
    """Where a line of frequency f shows up below half the sampling rate, Hz."""
    if not np.isfinite(line.f_hz):
        return float("nan")
    rate = 2 * nyquist_hz
    folded = line.f_hz % rate
    return float(min(folded, rate - folded))


def describe(line: Line) -> str:
    """A line in words, never without its status: ``12.003 ± 0.002 Hz (direct)``."""
    if line.status is LineStatus.NONE:
        return "no line stands out of the noise"
    if line.candidates_hz and line.status in (LineStatus.AMBIGUOUS, LineStatus.ALIASED):
        listed = [plain(f, 2) for f in line.candidates_hz[:4]]
        more = " …" if len(line.candidates_hz) > 4 else ""
        return f"{line.status}: " + " or ".join(listed) + more + " Hz"
    if not np.isfinite(line.f_hz):
        return str(line.status)
    return f"{measure(line.f_hz, 'Hz', line.f_sigma_hz)} ({line.status})"


def spectrum_rows(
    spectrum: Spectrum, names: Mapping[int, str], ids: Sequence[int], kind: str
) -> str:
    """Spectra of some markers: a row a marker, a column an axis, logarithmic values.

    kind "amplitude" (peak amplitude) or "psd". The dashed upright is the dominant line as the
    camera sees it; the dotted level is the noise floor; the axis ends at half the sampling rate.
    """
    height = 0.62 + 0.98 * len(ids)
    title = f"{'Amplitude spectrum' if kind == 'amplitude' else 'Power spectral density'}"

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, len(ids), 3, margins_in=(0.6, 0.15, 0.4, 0.4), gaps_in=(0.2, 0.26)
        )
        top, bottom = _limits(spectrum, ids, kind)
        for row, marker_id in zip(grid, ids, strict=True):
            m = int(np.flatnonzero(spectrum.ids == marker_id)[0])
            for k, ax in enumerate(row):
                _panel(ax, spectrum, (m, k), kind)
                ax.set_ylim(bottom, top)
        lines = dict(zip(spectrum.ids.tolist(), spectrum.lines, strict=True))
        canvas.row_names(figure, grid, [f"{names[i]} — {describe(lines[i])}" for i in ids])
        unit = unit_text(spectrum.unit)
        of = f"{unit} peak" if kind == "amplitude" else f"{unit}²/Hz"
        canvas.column_heads(figure, grid, [f"{axis}, {of}" for axis in "xyz"])
        _frame(grid)

    return canvas.draw(f"{kind}{ids[0]}", f"{title} of {len(ids)} markers", height, paint)


def _limits(spectrum: Spectrum, ids: Sequence[int], kind: str) -> tuple[float, float]:
    values = spectrum.amplitude if kind == "amplitude" else spectrum.psd
    chosen = values[1:, np.isin(spectrum.ids, ids)]
    positive = chosen[np.isfinite(chosen) & (chosen > 0)]
    if not positive.size:
        return 1.0, 1e-3
    top = float(positive.max()) * 2
    return top, max(float(np.percentile(positive, 2)) / 2, top * 1e-9)


def _panel(ax: Axes, spectrum: Spectrum, at: tuple[int, int], kind: str) -> None:
    m, k = at
    line = spectrum.lines[m]
    values = (spectrum.amplitude if kind == "amplitude" else spectrum.psd)[:, m, k]
    nyquist = float(spectrum.f_hz[-1])
    shown = np.where(values > 0, values, np.nan)
    ax.semilogy(spectrum.f_hz[1:], shown[1:], color=canvas.AXIS_COLOURS[k], lw=0.8)
    where = seen_at_hz(line, nyquist)
    floor = noise_floor(spectrum.f_hz, values, where, spectrum.resolution_hz)
    if floor > 0:
        ax.axhline(floor, color=canvas.QUIET, lw=0.7, ls=(0, (1, 2)))
    if np.isfinite(where):
        ax.axvline(where, color=canvas.MARK, lw=0.7, ls=(0, (4, 2)), zorder=1)
        if kind == "amplitude" and line.amplitude[k] > 0:
            ax.plot(where, line.amplitude[k], "v", color=canvas.MARK, ms=4, mew=0)
    ax.axvline(nyquist, color=canvas.QUIET, lw=0.8)
    ax.set_xlim(0, nyquist)
    ax.grid(axis="y")


def _frame(grid: Sequence[Sequence[Axes]]) -> None:
    for ax in grid[-1]:
        ax.set_xlabel("frequency as sampled, Hz")
    for r, row in enumerate(grid):
        for k, ax in enumerate(row):
            ax.locator_params(axis="x", nbins=7, prune="upper")
            canvas.label_ticks(ax, left=k == 0, bottom=r == len(grid) - 1)
            ax.yaxis.set_major_locator(LogLocator(numticks=4))
            ax.yaxis.set_major_formatter("{x:g}")
            ax.yaxis.set_minor_locator(NullLocator())
