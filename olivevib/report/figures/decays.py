"""Free decays: what was measured as dots, the fitted decay and its envelope as curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from olivevib.report.decay import FreeDecay
from olivevib.report.figures import canvas

MOST = 4  # markers in the figure


def chosen(found: Sequence[FreeDecay], most: int = MOST) -> list[FreeDecay]:
    """The decays that begin largest, by marker id."""
    ranked = sorted(found, key=lambda d: -float(np.nanmax(np.abs(d.xyz_mm))))[:most]
    return sorted(ranked, key=lambda d: d.found.id)


def decays(found: Sequence[FreeDecay], names: Mapping[int, str]) -> str:
    """A panel a marker, along its axis of largest motion, each on its own scale."""
    shown = chosen(found)
    rows = -(-len(shown) // 2)
    height = 0.65 + 1.35 * rows

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, rows, 2, margins_in=(0.6, 0.12, 0.3, 0.42), gaps_in=(0.6, 0.36)
        )
        panels = [ax for row in grid for ax in row]
        for ax, one in zip(panels, shown, strict=False):
            k = int(np.argmax(one.cosine**2 + one.sine**2))
            t = np.linspace(one.t_s[0], one.t_s[-1], 400)
            size = float(np.hypot(one.cosine[k], one.sine[k]))
            envelope = size * np.exp(-one.fall * (t - t[0]))
            for sign in (-1, 1):
                ax.plot(
                    t, one.rest[k] + sign * envelope, color=canvas.QUIET, lw=0.7, ls=(0, (4, 2))
                )
            ax.plot(t, one.curve(t)[:, k], color=canvas.MARK, lw=0.9)
            canvas.dots(ax, one.t_s, one.xyz_mm[:, k], 2.6, canvas.AXIS_COLOURS[k])
            reach = 1.1 * max(float(np.nanmax(np.abs(one.xyz_mm[:, k]))), size)
            ax.set(xlim=(t[0], t[-1]), ylim=(-reach, reach), ylabel=f"{'xyz'[k]}, mm")
            ax.set_title(names[one.found.id], loc="left", pad=3, fontweight="bold", fontsize=7.5)
            ax.grid(axis="y")
            ax.locator_params(axis="both", nbins=5)
        for ax in panels[len(shown) :]:
            ax.remove()
        for ax in panels[max(0, len(shown) - 2) : len(shown)]:
            ax.set_xlabel("trial clock, s")

    return canvas.draw("decay", "Free decay", height, paint)
