"""Curves of a study over one axis, told apart by dash and symbol as well as by colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.report.figures import canvas

_COLOURS = (*canvas.AXIS_COLOURS, canvas.MARK, canvas.INK, canvas.SECOND)
_DASHES = ("-", (0, (4, 1.4)), (0, (1.2, 1.2)), (0, (6, 1.2, 1.2, 1.2)))
_SHAPES = "os^Dv*"


def chart_figure(
    name: str,
    labels: tuple[str, str, str],
    curves: Sequence[tuple[str, Floats, Floats]],
    log_y: bool = False,
) -> str:
    """An SVG: ``labels`` are title, x axis, y axis; ``curves`` are label, x (N,), y (N,)."""
    rows = -(-len(curves) // 3)

    def paint(figure: Figure) -> None:
        top = 0.2 + 0.17 * rows
        ax = canvas.rows_and_columns(
            figure, 1, 1, margins_in=(0.75, 0.25, top, 0.45), gaps_in=(0, 0)
        )[0][0]
        styles: list[dict[str, Any]] = [
            {
                "color": _COLOURS[k % len(_COLOURS)],
                "ls": _DASHES[k % len(_DASHES)],
                "marker": _SHAPES[k % len(_SHAPES)],
                "ms": 3.5,
                "lw": 1.1,
            }
            for k in range(len(curves))
        ]
        for (_, x, y), how in zip(curves, styles, strict=True):
            ax.plot(x, y, **how)
        if log_y:
            ax.set_yscale("log")
        ax.set_xlabel(labels[1])
        ax.set_ylabel(labels[2])
        ax.grid(which="major")
        for row in range(rows):
            part = slice(3 * row, 3 * row + 3)
            words = [label for label, _, _ in curves[part]]
            canvas.key(figure, 0.75, 0.15 + 0.17 * row, list(zip(words, styles[part], strict=True)))

    return canvas.draw(name, labels[0], 3.0 + 0.17 * rows, paint)
