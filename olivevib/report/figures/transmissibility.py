"""How much of the trunk's motion arrives at each marker, at the dominant line."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.report.figures import canvas
from olivevib.report.words import number
from olivevib.vibration import LineRatio

_SHAPES = ("o", "s", "^")


def transmissibilities(
    ratios: Mapping[int, LineRatio], names: Mapping[int, str], reference: int
) -> str:
    """One row a marker on a logarithmic axis: the resultant with its sigma, x, y, z small."""
    height = 0.85 + 0.27 * len(ratios)

    def paint(figure: Figure) -> None:
        ax = canvas.rows_and_columns(
            figure, 1, 1, margins_in=(1.75, 0.95, 0.38, 0.42), gaps_in=(0, 0)
        )[0][0]
        for row, ratio in enumerate(ratios.values()):
            ax.axhline(row, color=canvas.GRID, lw=0.5, zorder=0)
            for k in range(3):
                if np.isfinite(ratio.ratio[k]) and ratio.ratio[k] > 0:
                    ax.plot(100 * ratio.ratio[k], row, _SHAPES[k], color=canvas.AXIS_COLOURS[k],
                            ms=4, mfc="none", mew=0.9)  # fmt: skip
            sigma = 100 * ratio.ratio_total_sigma
            ax.errorbar(100 * ratio.ratio_total, row, xerr=sigma if np.isfinite(sigma) else None,
                        fmt="D", color=canvas.INK, ms=4.5, capsize=2, elinewidth=1)  # fmt: skip
            words = f"{number(100 * ratio.ratio_total, 3)} %"
            ax.text(1.015, row, words, transform=ax.get_yaxis_transform(), va="center", fontsize=7)
        ax.axvline(100, color=canvas.QUIET, lw=0.8, ls=(0, (4, 2)))
        ax.set_xscale("log")
        _limits(ax, ratios)
        ax.set_yticks(range(len(ratios)), [names[i] for i in ratios])
        ax.set_ylim(len(ratios) - 0.4, -0.6)
        ax.tick_params(axis="y", length=0, labelsize=7.5, labelcolor=canvas.INK)
        ax.set_xlabel(f"amplitude of the dominant line, % of marker {reference} (logarithmic)")
        ax.grid(axis="x", which="major")
        how = [{"color": c, "marker": s, "lw": 0, "ms": 4, "mfc": "none"}
               for c, s in zip(canvas.AXIS_COLOURS, _SHAPES, strict=True)]  # fmt: skip
        whole = {"color": canvas.INK, "marker": "D", "lw": 1, "ms": 4.5}
        heads = ("all axes", "x", "y", "z")
        canvas.key(figure, 1.75, 0.18, list(zip(heads, [whole, *how], strict=True)))

    title = f"Transmissibility from marker {reference}"
    return canvas.draw("transmissibility", title, height, paint)


def _limits(ax: Axes, ratios: Mapping[int, LineRatio]) -> None:
    """Both ends of the axis, and ticks at 1, 2, 5, 10, … per cent."""
    values = np.concatenate([[r.ratio_total, *r.ratio, 1.0] for r in ratios.values()]) * 100
    values = values[np.isfinite(values) & (values > 0)]
    low, high = values.min() / 1.3, values.max() * 1.3
    ax.set_xlim(low, high)
    canvas.log_ticks(ax, low, high)
