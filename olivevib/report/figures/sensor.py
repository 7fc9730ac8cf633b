"""The accelerometer and the camera laid over each other, and what is left between them."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.comparison import Comparison
from olivevib.report.figures import canvas


def overlay_window(comparison: Comparison, wanted_s: float = 1.5) -> tuple[float, float]:
    """The stretch of the overlay with the strongest motion, at most ``wanted_s`` long."""
    t_s, power = comparison.overlay_t_s, np.nansum(comparison.optical_mm**2, axis=1)
    if t_s.size < 2 or t_s[-1] - t_s[0] <= wanted_s:
        return (float(t_s[0]), float(t_s[-1])) if t_s.size else (0.0, 1.0)
    starts = t_s[t_s <= t_s[-1] - wanted_s]
    sums = [float(power[(t_s >= s) & (t_s <= s + wanted_s)].sum()) for s in starts]
    start = float(starts[int(np.argmax(sums))])
    return start, start + wanted_s


def overlay(comparison: Comparison, part: int = 0) -> str:
    """Left: a stretch with both, axis by axis. Right: camera less sensor over the whole record."""
    window = overlay_window(comparison)

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, 3, 2, margins_in=(0.6, 0.12, 0.55, 0.4), gaps_in=(0.65, 0.16)
        )
        residual = comparison.optical_mm - comparison.sensor_mm
        reach = _reach(comparison.optical_mm, comparison.sensor_mm)
        rest = _reach(residual)
        t_s = comparison.overlay_t_s
        for k, (ax, right) in enumerate(grid):
            ax.plot(t_s, comparison.sensor_mm[:, k], color=canvas.QUIET, lw=1.0)
            canvas.dots(ax, t_s, comparison.optical_mm[:, k], 2.6, canvas.AXIS_COLOURS[k])
            ax.set(xlim=window, ylim=(-reach, reach))
            right.plot(*canvas.thin(t_s, residual[:, k]), color=canvas.AXIS_COLOURS[k], lw=0.7)
            right.set_ylim(-rest, rest)
            if t_s.size > 1:
                right.set_xlim(t_s[0], t_s[-1])
            ax.set_ylabel(f"{'xyz'[k]}, mm")
            for each in (ax, right):
                each.grid(axis="y")
                each.tick_params(labelbottom=k == 2)
                each.locator_params(axis="y", nbins=4)
        grid[0][0].set_title("displacement at the camera's instants", loc="left")
        grid[0][1].set_title("camera less sensor, mm", loc="left")
        for ax in grid[2]:
            ax.set_xlabel("trial clock, s")
        entries = [("accelerometer, integrated twice", {"color": canvas.QUIET, "lw": 1.0}),
                   ("camera", {"color": canvas.INK, "marker": "o", "lw": 0, "ms": 3})]  # fmt: skip
        canvas.key(figure, 0.6, 0.14, entries)

    return canvas.draw(f"sensor{part}", "Camera and accelerometer", 3.7, paint)


def _reach(*values: Floats) -> float:
    largest = max((float(np.nanmax(np.abs(v))) for v in values if np.isfinite(v).any()), default=0)
    return largest * 1.08 if largest > 0 else 1.0
