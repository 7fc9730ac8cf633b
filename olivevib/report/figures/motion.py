"""Displacement of each marker over time, axis by axis: gaps stay gaps, phases are shaded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from olivevib.arrays import Floats, Ints
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas
from olivevib.report.lines import KNOWN
from olivevib.signals import State
from olivevib.vibration import Line, Phase

FEWEST = 5  # samples that are worth a close-up


@dataclass(frozen=True)
class Window:
    """The stretch of time that a figure shows; ``close`` draws each sample and the fitted line."""

    start_s: float
    end_s: float
    close: bool = False


def whole(trajectory: Trajectory) -> Window:
    """The window from the first to the last frame in which any marker was located."""
    t_s = trajectory.t_s[trajectory.seen.any(axis=1)]
    return Window(float(t_s[0]), float(t_s[-1])) if t_s.size > 1 else Window(0.0, 1.0)


def close_window(
    trajectory: Trajectory, marker_id: int, span: tuple[float, float], length_s: float
) -> Window | None:
    """A stretch of ``length_s`` within ``span`` with the most samples of a marker; None: too few.

    Among equals the one nearest to the middle of the span.
    """
    m = int(np.flatnonzero(trajectory.ids == marker_id)[0])
    times = trajectory.t_s[trajectory.seen[:, m]]
    times = times[(times >= span[0]) & (times <= span[1])]
    if times.size < FEWEST:
        return None
    middle = (span[0] + span[1]) / 2
    counts = np.searchsorted(times, times + length_s) - np.arange(times.size)
    best = times[counts == counts.max()]
    start = float(best[int(np.argmin(np.abs(best + length_s / 2 - middle)))])
    return Window(start, start + length_s, close=True) if counts.max() >= FEWEST else None


def displacement_mm(trajectory: Trajectory, marker_id: int) -> tuple[Floats, Floats]:
    """Times (N,) and displacement (N, 3) from the mean position, NaN where not seen, mm."""
    m = int(np.flatnonzero(trajectory.ids == marker_id)[0])
    xyz = trajectory.xyz_mm[:, m]
    seen = trajectory.seen[:, m]
    t_s = np.where(
        np.isfinite(trajectory.sample_t_s[:, m]), trajectory.sample_t_s[:, m], trajectory.t_s
    )
    return t_s, xyz - xyz[seen].mean(axis=0) if seen.any() else xyz


def time_series(
    trajectory: Trajectory,
    names: Mapping[int, str],
    ids: Sequence[int],
    window: Window,
    phases: Sequence[Phase] = (),
    lines: Mapping[int, Line] | None = None,
) -> str:
    """Displacement from the mean position: a row a marker, a column an axis, one scale a row."""
    height = 0.58 + 0.74 * len(ids)
    words = "close up" if window.close else "over time"
    title = f"Displacement of {len(ids)} markers {words}"

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, len(ids), 3, margins_in=(0.5, 0.12, 0.38, 0.4), gaps_in=(0.16, 0.24), light=True
        )
        for row, marker_id in zip(grid, ids, strict=True):
            t_s, xyz = displacement_mm(trajectory, marker_id)
            state = trajectory.state[:, int(np.flatnonzero(trajectory.ids == marker_id)[0])]
            _row(row, (t_s, xyz, state), window, phases)
            if window.close and lines and marker_id in lines:
                _fitted(row, lines[marker_id], (t_s, xyz), window)
        canvas.row_names(figure, grid, [names[i] for i in ids])
        canvas.column_heads(figure, grid, ["x, mm", "y, mm", "z, mm"])
        time_ticks(grid)

    return canvas.draw("close" if window.close else f"motion{ids[0]}", title, height, paint)


def _row(
    row: Sequence[Axes], data: tuple[Floats, Floats, Ints], window: Window, phases: Sequence[Phase]
) -> None:
    t_s, xyz, state = data
    inside = (t_s >= window.start_s) & (t_s <= window.end_s)
    shown = np.abs(xyz[inside])
    reach = float(np.nanmax(shown)) * 1.08 if np.isfinite(shown).any() else 1.0
    for k, ax in enumerate(row):
        for span in phases:
            if span.name in ("start-up", "shut-down", "decay"):
                ax.axvspan(span.start_s, span.end_s, color=canvas.SHADE, lw=0, zorder=0)
        if window.close:
            ax.plot(t_s[inside], xyz[inside, k], color=canvas.AXIS_COLOURS[k], lw=0.4)
            canvas.dots(ax, t_s[inside], xyz[inside, k], 2.6, canvas.AXIS_COLOURS[k])
        else:
            ax.plot(*canvas.thin(t_s, xyz[:, k]), color=canvas.AXIS_COLOURS[k], lw=0.8)
        doubtful = inside & (state == State.FLAGGED)
        ax.plot(t_s[doubtful], xyz[doubtful, k], "o", mfc="none", mec=canvas.INK, ms=2.6, mew=0.5)
        gone = canvas.runs(inside & np.isnan(xyz[:, 0]))
        step = float(np.median(np.diff(t_s))) if t_s.size > 1 else 0.0
        bars = [(t_s[a] - step / 2, t_s[b - 1] - t_s[a] + step) for a, b in gone]
        ax.broken_barh(bars, (0, 0.07), transform=ax.get_xaxis_transform(), color=canvas.MARK, lw=0)
        ax.set_xlim(window.start_s, window.end_s)
        ax.set_ylim(-reach, reach)


def _fitted(row: Sequence[Axes], line: Line, data: tuple[Floats, Floats], window: Window) -> None:
    """The fitted line as a thin curve through the samples, where its frequency is known."""
    if line.status not in KNOWN or not np.isfinite(line.f_hz):
        return
    t_s, xyz = data
    inside = (t_s >= window.start_s) & (t_s <= window.end_s)
    if not np.isfinite(xyz[inside, 0]).any():
        return
    t = np.linspace(window.start_s, window.end_s, 600)
    for k, ax in enumerate(row):
        phase = 2 * np.pi * line.f_hz * (t - line.t_ref_s) + line.phase_rad[k]
        curve = line.amplitude[k] * np.cos(phase) + np.nanmean(xyz[inside, k])
        ax.plot(t, curve, color=canvas.QUIET, lw=0.6, zorder=1)


def time_ticks(grid: Sequence[Sequence[Axes]]) -> None:
    """Ticks of light panels over the trial clock, numbers at the left and at the bottom."""
    for r, row in enumerate(grid):
        for k, ax in enumerate(row):
            x = MaxNLocator(6, prune="upper").tick_values(*ax.get_xlim())
            y = MaxNLocator(4).tick_values(*ax.get_ylim())
            canvas.light_ticks(ax, x, y, left=k == 0, bottom=r == len(grid) - 1)
    for ax in grid[-1]:
        ax.set_xlabel("trial clock, s")
