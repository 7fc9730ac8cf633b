"""Box plots of one quantity by a factor of the session record: cultivar, machine, marker place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.report.clean import clean
from olivevib.report.figures import canvas

FEWEST = 5  # values from which a box says more than the dots alone


def boxes(name: str, quantity: str, groups: Mapping[str, Sequence[float]]) -> str:
    """One row a group: every value as a dot; from five on also median, quartiles and range.

    Whiskers reach to the last value within 1.5 interquartile ranges of the box (Tukey).
    """
    height = 0.65 + 0.3 * len(groups)

    def paint(figure: Figure) -> None:
        ax = canvas.rows_and_columns(
            figure, 1, 1, margins_in=(2.0, 0.5, 0.1, 0.45), gaps_in=(0, 0)
        )[0][0]
        for row, values in enumerate(groups.values()):
            x = np.asarray(values, dtype=np.float64)
            if x.size >= FEWEST:
                _box(ax, row, x)
            canvas.dots(ax, x, row + _spread(x.size), 3.0, canvas.LEFT)
            ax.text(1.01, row, f"n = {x.size}", transform=ax.get_yaxis_transform(),
                    va="center", fontsize=7, color=canvas.QUIET)  # fmt: skip
        everything = np.concatenate([np.asarray(v, dtype=np.float64) for v in groups.values()])
        low, high = float(everything.min()), float(everything.max())
        pad = 0.06 * (high - low) or 0.1 * abs(high) or 1.0
        ax.set(xlim=(low - pad, high + pad), ylim=(len(groups) - 0.4, -0.6), xlabel=quantity)
        ax.set_yticks(range(len(groups)), [clean(g, 34) for g in groups])
        ax.tick_params(axis="y", length=0, labelsize=7.5, labelcolor=canvas.INK)
        ax.grid(axis="x")
        ax.set_axisbelow(True)

    return canvas.draw(name, f"{quantity} by group", height, paint)


def _spread(n: int) -> Floats:
    """A fixed zigzag, so that dots of equal values lie side by side."""
    pattern = np.array([0.0, 0.14, -0.14, 0.24, -0.24])
    return np.resize(pattern, n)


def _box(ax: Axes, row: int, x: Floats) -> None:
    low, middle, high = np.percentile(x, [25, 50, 75])
    reach = 1.5 * (high - low)
    inside = x[(x >= low - reach) & (x <= high + reach)]
    ax.plot([inside.min(), low], [row, row], color=canvas.QUIET, lw=0.9)
    ax.plot([high, inside.max()], [row, row], color=canvas.QUIET, lw=0.9)
    ax.broken_barh([(low, high - low)], (row - 0.3, 0.6), facecolor=canvas.SHADE,
                   edgecolor=canvas.QUIET, lw=0.8)  # fmt: skip
    ax.plot([middle, middle], [row - 0.3, row + 0.3], color=canvas.MARK, lw=1.6)
