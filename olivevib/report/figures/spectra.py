"""Amplitude spectra: a row a marker, a column an axis, with the marked line; PSD of all axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from olivevib.arrays import Floats
from olivevib.report.figures import canvas
from olivevib.report.lines import describe, folded_hz
from olivevib.report.words import unit_text
from olivevib.vibration import Line, Spectrum

MOST = 700  # points of one curve
_BELOW = 0.1  # of the smallest sigma of a fitted line: where an axis of fitted motions ends


@dataclass(frozen=True)
class Band:
    """What of a frequency axis is drawn: up to ``top_hz``; at ``half_hz`` lines fold.

    fitted: the curves are those of a fitted motion. It holds sway, one line and its harmonics and
    nothing else, so what stands between is the skirt of the window and no measured noise: no noise
    floor is drawn, and the axis ends where the fit's own sigma does.
    """

    half_hz: float
    top_hz: float
    fitted: bool = False

    @property
    def axis(self) -> str:
        """The words at the frequency axis."""
        return "frequency, Hz" if self.fitted else "frequency as sampled, Hz"


def noise_floor(f_hz: Floats, values: Floats, line_hz: float, resolution_hz: float) -> float:
    """The median of a spectrum (F,) away from its line (and from zero): what noise alone gives."""
    near = np.abs(f_hz - line_hz) < 4 * resolution_hz if np.isfinite(line_hz) else f_hz < 0
    rest = values[(f_hz > 2 * resolution_hz) & ~near]
    rest = rest[np.isfinite(rest)]
    return float(np.median(rest)) if rest.size else float("nan")


def amplitude_spectra(
    spectrum: Spectrum, names: Mapping[int, str], ids: Sequence[int], band: Band
) -> str:
    """Peak amplitude over frequency, logarithmic: a row a marker, a column an axis.

    The dashed upright is the dominant line as the camera sees it, the triangle its fitted
    amplitude, the dotted level the noise floor of what was measured.
    """
    height = 0.66 + 0.76 * len(ids)
    lines = dict(zip(spectrum.ids.tolist(), spectrum.lines, strict=True))

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, len(ids), 3, margins_in=(0.6, 0.15, 0.4, 0.4), gaps_in=(0.2, 0.26), light=True
        )
        limits = _limits(spectrum, spectrum.amplitude, ids, band, _least_known(spectrum, ids))
        for r, (row, marker_id) in enumerate(zip(grid, ids, strict=True)):
            m = int(np.flatnonzero(spectrum.ids == marker_id)[0])
            line = lines[marker_id]
            for k, ax in enumerate(row):
                values = spectrum.amplitude[:, m, k]
                where = _curve(ax, spectrum, values, (line, band), canvas.AXIS_COLOURS[k])
                if np.isfinite(where) and line.amplitude[k] > 0:
                    ax.plot(where, line.amplitude[k], "v", color=canvas.MARK, ms=4, mew=0)
                _scales(ax, limits, band, left=k == 0, bottom=r == len(ids) - 1)
        canvas.row_names(figure, grid, [f"{names[i]} — {describe(lines[i])}" for i in ids])
        unit = f"{unit_text(spectrum.unit)} peak"
        canvas.column_heads(figure, grid, [f"{axis}, {unit}" for axis in "xyz"])

    name = f"{spectrum.quantity}{ids[0]}"
    title = f"Amplitude spectrum of the {spectrum.quantity} of {len(ids)} markers"
    return canvas.draw(name, title, height, paint)


def power_spectra(
    spectrum: Spectrum, names: Mapping[int, str], ids: Sequence[int], band: Band
) -> str:
    """Power spectral density of the three axes together (powers add), a panel a marker."""
    about = (f"psd{ids[0]}", "Power spectral density", f"{unit_text(spectrum.unit)}²/Hz, x + y + z")
    least = _least_known(spectrum, ids) ** 2 / 2 / (spectrum.resolution_hz * spectrum.enbw_bins)
    shown = (spectrum.psd.sum(axis=2), least)
    return _totals(spectrum, shown, names, ids, band, about)


def total_spectra(
    spectrum: Spectrum, names: Mapping[int, str], ids: Sequence[int], band: Band
) -> str:
    """Amplitude spectrum (peak) of the three axes together (powers add), a panel a marker."""
    total = np.sqrt(np.sum(spectrum.amplitude**2, axis=2))
    title = f"Amplitude spectrum of the {spectrum.quantity}"
    about = (f"{spectrum.quantity}{ids[0]}", title, f"{unit_text(spectrum.unit)} peak, all axes")
    return _totals(spectrum, (total, _least_known(spectrum, ids)), names, ids, band, about)


def _totals(
    spectrum: Spectrum,
    shown: tuple[Floats, float],
    names: Mapping[int, str],
    ids: Sequence[int],
    band: Band,
    about: tuple[str, str, str],
) -> str:
    """One value (F, M) a frequency and marker, a panel a marker; about: name, title, unit.

    shown: the values, and the least that a fit tells from nothing.
    """
    total, least = shown
    columns = 3
    rows = -(-len(ids) // columns)
    height = 0.66 + 0.78 * rows
    lines = dict(zip(spectrum.ids.tolist(), spectrum.lines, strict=True))

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure,
            rows,
            columns,
            margins_in=(0.6, 0.15, 0.36, 0.4),
            gaps_in=(0.2, 0.28),
            light=True,
        )
        limits = _limits(spectrum, total, ids, band, least)
        panels = [ax for row in grid for ax in row]
        for place, (ax, marker_id) in enumerate(zip(panels, ids, strict=False)):
            m = int(np.flatnonzero(spectrum.ids == marker_id)[0])
            _curve(ax, spectrum, total[:, m], (lines[marker_id], band), canvas.LEFT)
            lowest = place + columns >= len(ids)
            _scales(ax, limits, band, left=place % columns == 0, bottom=lowest)
            ax.set_title(names[marker_id], loc="left", pad=3, fontsize=7.5, fontweight="bold")
        for ax in panels[len(ids) :]:
            ax.remove()
        canvas.note(figure, 0.02, 0.1, about[2], va="center", fontsize=8)

    return canvas.draw(about[0], f"{about[1]} of {len(ids)} markers", height, paint)


def _least_known(spectrum: Spectrum, ids: Sequence[int]) -> float:
    """The smallest sigma of a line's amplitude, in the spectrum's unit; 0 where none is known."""
    lines = (line for i, line in zip(spectrum.ids, spectrum.lines, strict=True) if i in ids)
    sigmas = np.concatenate([line.amplitude_sigma for line in lines])
    sigmas = sigmas[np.isfinite(sigmas) & (sigmas > 0)]
    return float(sigmas.min()) if sigmas.size else 0.0


def _limits(
    spectrum: Spectrum, values: Floats, ids: Sequence[int], band: Band, least: float
) -> tuple[float, float]:
    """Lowest and highest value worth drawing of spectra (F, M, …) of these markers."""
    drawn = (spectrum.f_hz > 0) & (spectrum.f_hz <= band.top_hz)
    values = values[np.ix_(drawn, np.isin(spectrum.ids, ids))]
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return 1e-3, 1.0
    top = float(positive.max()) * 2
    low = max(float(np.percentile(positive, 2)) / 2, top * 1e-9)
    return (min(max(low, _BELOW * least), top / 100) if band.fitted else low), top


def _curve(
    ax: Axes, spectrum: Spectrum, values: Floats, at: tuple[Line, Band], colour: str
) -> float:
    """One spectrum (F,) with the upright of its line; returns where that is.

    What was measured also has its noise floor.
    """
    line, band = at
    drawn = slice(1, int(np.searchsorted(spectrum.f_hz, band.top_hz)) + 1)
    shown = np.where(values > 0, values, np.nan)
    ax.semilogy(*canvas.thin(spectrum.f_hz[drawn], shown[drawn], MOST), color=colour, lw=0.8)
    where = folded_hz(line.f_hz, band.half_hz)
    level = spectrum.quantity == "displacement" and not band.fitted  # elsewhere it is not level
    floor = noise_floor(spectrum.f_hz, values, where, spectrum.resolution_hz) if level else 0.0
    if floor > 0:
        ax.axhline(floor, color=canvas.QUIET, lw=0.7, ls=(0, (1, 2)))
    if np.isfinite(where):
        ax.axvline(where, color=canvas.MARK, lw=0.7, ls=(0, (4, 2)), zorder=1)
    ax.axvline(band.top_hz, color=canvas.QUIET, lw=0.8)
    ax.set_xlim(0, band.top_hz)
    return where


def _scales(ax: Axes, limits: tuple[float, float], band: Band, *, left: bool, bottom: bool) -> None:
    ax.set_ylim(limits)
    x = MaxNLocator(7, prune="upper").tick_values(*ax.get_xlim())
    y = LogLocator(numticks=4).tick_values(*limits)
    canvas.light_ticks(ax, x, y, left=left, bottom=bottom)
    if bottom:
        ax.set_xlabel(band.axis)
