"""Orbits: the path of each marker about its mean position, in three projections, on one scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from olivevib.arrays import Floats
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas
from olivevib.report.figures.motion import displacement_mm
from olivevib.vibration.types import Line

PLANES = (("x", "y"), ("x", "z"), ("y", "z"))
MOST = 600  # frames drawn of one marker
MOST_ACROSS = 8  # markers side by side in one figure


def orbit_reach_mm(trajectory: Trajectory, ids: Sequence[int]) -> float:
    """The half width of the common scale: the 99.5th percentile of all displacements, mm."""
    parts = [np.abs(displacement_mm(trajectory, i)[1]).ravel() for i in ids]
    finite = np.concatenate(parts)[np.isfinite(np.concatenate(parts))] if parts else np.empty(0)
    return float(np.percentile(finite, 99.5)) * 1.1 if finite.size else 1.0


def orbits(
    trajectory: Trajectory,
    names: Mapping[int, str],
    ids: Sequence[int],
    reach_mm: float,
    lines: Mapping[int, Line] | None = None,
) -> str:
    """Small multiples: a column a marker, a row a projection, every panel on the same mm scale."""
    across = max(4, len(ids))
    side = (canvas.WIDTH_IN - 0.62 - 0.08 - 0.1 * (across - 1)) / across
    height = 0.4 + 0.4 + 3 * side + 2 * 0.1

    def paint(figure: Figure) -> None:
        right = 0.08 + (across - len(ids)) * (side + 0.1)
        grid = canvas.rows_and_columns(
            figure, 3, len(ids), margins_in=(0.62, right, 0.4, 0.4), gaps_in=(0.1, 0.1), light=True
        )
        for c, marker_id in enumerate(ids):
            _, xyz = displacement_mm(trajectory, marker_id)
            line = (lines or {}).get(marker_id)
            for r, plane in enumerate(PLANES):
                _panel(grid[r][c], xyz, plane, line)
                down = -1 if plane[1] == "y" and trajectory.frame == "left camera" else 1
                grid[r][c].set_xlim(-reach_mm, reach_mm)
                grid[r][c].set_ylim(-reach_mm * down, reach_mm * down)
                ticks = MaxNLocator(4).tick_values(-reach_mm, reach_mm)
                canvas.light_ticks(grid[r][c], ticks, ticks, left=c == 0, bottom=r == 2)
            grid[0][c].set_title(_two_lines(names[marker_id]), fontsize=7, pad=3)
        for r, (_, up) in enumerate(PLANES):
            over = PLANES[r][0]
            grid[r][0].set_ylabel(f"{over}{up}:  {up}, mm")
        for ax in grid[2]:
            ax.set_xlabel("mm")

    return canvas.draw(f"orbits{ids[0]}", f"Orbits of {len(ids)} markers", height, paint)


def _two_lines(name: str) -> str:
    """The id, and below it as much of the place as fits above a small panel."""
    marker_id, _, place = name.partition(" · ")
    return f"{marker_id}\n{place if len(place) <= 15 else place[:14].rstrip(', ') + '…'}"


def _panel(ax: Axes, xyz: Floats, plane: tuple[str, str], line: Line | None) -> None:
    i, j = ("xyz".index(axis) for axis in plane)
    ax.axhline(0, color=canvas.GRID, lw=0.5)
    ax.axvline(0, color=canvas.GRID, lw=0.5)
    step = canvas.stride(len(xyz), MOST)
    if step == 1:  # samples that follow each other
        ax.plot(xyz[:, i], xyz[:, j], color=canvas.SECOND, lw=0.4)
    xyz = xyz[::step]
    canvas.dots(ax, xyz[:, i], xyz[:, j], 1.3, canvas.LEFT)
    if line is not None and np.isfinite(line.amplitude).all():
        turn = np.linspace(0, 2 * np.pi, 73)
        ellipse = line.amplitude * np.cos(turn[:, None] + line.phase_rad)
        ax.plot(ellipse[:, i], ellipse[:, j], color=canvas.MARK, lw=1.2)
    ax.set_aspect("equal")
    for side in ("top", "right"):
        ax.spines[side].set_visible(True)
