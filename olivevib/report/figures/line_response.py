"""How much of the reference's motion arrives at each marker at the lines of a fitted motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.report.figures import canvas
from olivevib.report.words import number
from olivevib.vibration import Transmission

MOST = 4  # markers side by side
_SHAPES = ("o", "s", "^")
_APART = 0.22  # of the distance between two lines: x, y, z side by side
_LOST = 1.0  # relative sigma and rad: a phase less sure than that is not drawn


def at_lines(found: Sequence[Transmission], most: int = MOST) -> list[Transmission]:
    """The responses that stand at lines only and are known best there, by marker id."""
    good = [t for t in found if not t.curve.segments and np.isfinite(t.curve.h1).any()]
    ranked = sorted(good, key=lambda t: float(np.nanmin(t.curve.sigma)))[:most]
    return sorted(ranked, key=lambda t: t.response)


def line_responses(found: Sequence[Transmission], names: Mapping[int, str]) -> str:
    """A column a marker; rows: size of the ratio, its phase; a place a line, x, y, z in it."""
    columns = max(2, len(found))

    def paint(figure: Figure) -> None:
        side = (canvas.WIDTH_IN - 0.72 - 0.1 - 0.25 * (columns - 1)) / columns
        right = 0.1 + (columns - len(found)) * (side + 0.25)
        grid = canvas.rows_and_columns(
            figure, 2, len(found), margins_in=(0.72, right, 0.55, 0.42), gaps_in=(0.25, 0.14),
            light=True,
        )  # fmt: skip
        limits, ticks = _limits(found)
        for c, one in enumerate(found):
            top, low = grid[0][c], grid[1][c]
            for ax in (top, low):
                ax.set_xlim(-0.5, one.curve.f_hz.size - 0.5)
            top.set_yscale("log")
            top.set_ylim(*limits)
            low.set_ylim(-200, 200)
            for k in range(3):
                _axis(top, low, one, k)
            top.axhline(100, color=canvas.QUIET, lw=0.8, ls=(0, (4, 2)))
            canvas.light_ticks(top, [], ticks, left=c == 0, bottom=False)
            canvas.light_ticks(low, [], [-180, -90, 0, 90, 180], left=c == 0, bottom=False)
            for at, f_hz in enumerate(one.curve.f_hz):
                low.annotate(f"{number(f_hz, 4)} Hz", (at, 0), (0, -4.5), fontsize=7, ha="center",
                             va="top", color=canvas.QUIET, annotation_clip=False,
                             xycoords=low.get_xaxis_transform(),
                             textcoords="offset points")  # fmt: skip
            top.set_title(names[one.response], loc="left", pad=3, fontsize=7.5, fontweight="bold")
        for ax, words in ((grid[0][0], "size, %"), (grid[1][0], "phase, °")):
            ax.set_ylabel(words)
            ax.yaxis.labelpad = 26
        how = [{"color": c, "marker": s, "lw": 0, "ms": 4}
               for c, s in zip(canvas.AXIS_COLOURS, _SHAPES, strict=True)]  # fmt: skip
        canvas.key(figure, 0.72, 0.16, list(zip("xyz", how, strict=True)))

    title = f"Response of {len(found)} markers at the lines"
    return canvas.draw("response", title, 3.1, paint)


def _axis(top: Axes, low: Axes, one: Transmission, k: int) -> None:
    h1, sigma = one.curve.h1[:, k], one.curve.sigma[:, k]
    at = np.arange(h1.size) + _APART * (k - 1)
    colour = canvas.AXIS_COLOURS[k]
    size = 100 * np.abs(h1)
    known = np.isfinite(size) & np.isfinite(sigma)
    sure = known & (sigma < _LOST)
    degrees, away = np.degrees(np.angle(h1)), np.degrees(sigma)
    for ax, values, lowest, highest, shown in (
        (top, size, size / (1 + sigma), size * (1 + sigma), known),  # factors: a logarithmic axis
        (low, degrees, degrees - away, degrees + away, sure),
    ):
        ax.vlines(at[shown], lowest[shown], highest[shown], color=colour, lw=1)
        ax.plot(at[shown], values[shown], _SHAPES[k], color=colour, ms=4, mew=0.9)


def _limits(found: Sequence[Transmission]) -> tuple[tuple[float, float], list[float]]:
    """Both ends of the size in %, and ticks at 1, 2, 5, 10, … within."""
    ends: list[Floats] = [np.full(1, 100.0)]
    for t in found:
        size, sigma = 100 * np.abs(t.curve.h1), t.curve.sigma
        ends += [(size / (1 + sigma)).ravel(), (size * (1 + sigma)).ravel()]
    values = np.concatenate(ends)
    values = values[np.isfinite(values) & (values > 0)]
    low, high = float(values.min()) / 1.3, float(values.max()) * 1.3
    steps = (1, 2, 5) if high / low < 300 else (1,)
    ticks = [s * 10.0**d for d in range(-6, 6) for s in steps if low <= s * 10.0**d <= high]
    return (low, high), ticks
