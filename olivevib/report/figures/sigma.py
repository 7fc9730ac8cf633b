"""How well each position is known: standard deviation of x, y and z for each marker."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas

_SHAPES = ("o", "s", "^")


def sigmas(trajectory: Trajectory, names: Mapping[int, str]) -> str:
    """Median (symbol) and 5…95 % of the frames (bar) of sigma in x, y, z, mm, a row a marker."""
    order = [int(m) for m in np.argsort(trajectory.ids) if trajectory.seen[:, m].any()]
    height = 0.85 + 0.27 * len(order)

    def paint(figure: Figure) -> None:
        ax = canvas.rows_and_columns(
            figure, 1, 1, margins_in=(1.75, 0.25, 0.38, 0.42), gaps_in=(0, 0)
        )[0][0]
        for row, m in enumerate(order):
            ax.axhline(row, color=canvas.GRID, lw=0.5, zorder=0)
            for k in range(3):
                values = trajectory.sigma_xyz_mm[:, m, k]
                values = values[np.isfinite(values) & (values > 0)]
                if not values.size:
                    continue
                low, middle, high = np.percentile(values, [5, 50, 95])
                y = row + (k - 1) * 0.24
                ax.plot([low, high], [y, y], color=canvas.AXIS_COLOURS[k], lw=1.6, alpha=0.55)
                ax.plot(middle, y, _SHAPES[k], color=canvas.AXIS_COLOURS[k], ms=4, mew=0)
        ax.set_xscale("log")
        ax.set_yticks(range(len(order)), [names[int(trajectory.ids[m])] for m in order])
        ax.set_ylim(len(order) - 0.4, -0.6)
        ax.tick_params(axis="y", length=0, labelsize=7.5, labelcolor=canvas.INK)
        ax.set_xlabel("standard deviation of one position, mm (logarithmic)")
        ax.grid(axis="x")
        canvas.log_ticks(ax, *ax.get_xlim())
        how = [{"color": c, "marker": s, "lw": 1.6, "ms": 4}
               for c, s in zip(canvas.AXIS_COLOURS, _SHAPES, strict=True)]  # fmt: skip
        canvas.key(figure, 1.75, 0.18, list(zip(("x", "y", "z"), how, strict=True)))

    return canvas.draw("sigma", "Standard deviation of the positions", height, paint)
