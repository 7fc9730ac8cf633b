"""How much of the reference's motion arrives at each marker at the lines of a fitted motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

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
            figure, 2, len(found), margins_in=(0.72, right, 0.55, 0.42), gaps_in=(0.25, 0.14)
        )
        limits, ticks = _limits(found)
        for c, one in enumerate(found):
            top, low = grid[0][c], grid[1][c]
            for k in range(3):
                _axis(top, low, one, k)
            top.set_yscale("log")
            top.set_ylim(*limits)
            top.set_yticks(ticks, [f"{100 * t:g}" for t in ticks] if c == 0 else [])
            top.minorticks_off()
            top.axhline(1.0, color=canvas.QUIET, lw=0.8, ls=(0, (4, 2)))
            low.set_ylim(-200, 200)
            low.set_yticks([-180, -90, 0, 90, 180], None if c == 0 else [])
            for ax, words in ((top, []), (low, [f"{number(f, 4)} Hz" for f in one.curve.f_hz])):
                ax.set_xlim(-0.5, one.curve.f_hz.size - 0.5)
                ax.set_xticks(range(one.curve.f_hz.size), words or [""] * one.curve.f_hz.size)
                ax.grid(axis="y")
            top.set_title(names[one.response], loc="left", pad=3, fontsize=7.5, fontweight="bold")
        grid[0][0].set_ylabel("size, %")
        grid[1][0].set_ylabel("phase, °")
        how = [{"color": c, "marker": s, "lw": 0, "ms": 4}
               for c, s in zip(canvas.AXIS_COLOURS, _SHAPES, strict=True)]  # fmt: skip
        canvas.key(figure, 0.72, 0.16, list(zip("xyz", how, strict=True)))

    title = f"Response of {len(found)} markers at the lines"
    return canvas.draw("response", title, 3.1, paint)


def _axis(top: Axes, low: Axes, one: Transmission, k: int) -> None:
    h1, sigma = one.curve.h1[:, k], one.curve.sigma[:, k]
    at = np.arange(h1.size) + _APART * (k - 1)
    how: dict[str, Any] = {"fmt": _SHAPES[k], "color": canvas.AXIS_COLOURS[k], "ms": 4,
                           "capsize": 2, "elinewidth": 1, "mew": 0.9}  # fmt: skip
    size = np.abs(h1)
    known = np.isfinite(size) & np.isfinite(sigma)
    ends = np.array([size - size / (1 + sigma), size * sigma])  # factors on a logarithmic axis
    top.errorbar(at[known], size[known], yerr=ends[:, known], **how)
    sure = known & (sigma < _LOST)
    degrees = np.degrees(np.angle(h1))
    low.errorbar(at[sure], degrees[sure], yerr=np.degrees(sigma[sure]), **how)


def _limits(found: Sequence[Transmission]) -> tuple[tuple[float, float], list[float]]:
    """Both ends of the size, and ticks at 1, 2, 5, 10, … within."""
    ends: list[Floats] = [np.ones(1)]
    for t in found:
        size, sigma = np.abs(t.curve.h1), t.curve.sigma
        ends += [(size / (1 + sigma)).ravel(), (size * (1 + sigma)).ravel()]
    values = np.concatenate(ends)
    values = values[np.isfinite(values) & (values > 0)]
    low, high = float(values.min()) / 1.3, float(values.max()) * 1.3
    steps = (1, 2, 5) if high / low < 300 else (1,)
    ticks = [s * 10.0**d for d in range(-6, 6) for s in steps if low <= s * 10.0**d <= high]
    return (low, high), ticks
