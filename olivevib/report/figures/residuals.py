"""What the calibration leaves over: residuals in each picture, and errors of known distances."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.report.figures import canvas
from olivevib.trial.records.calibration import CalibrationRecord


def residual_map(record: CalibrationRecord, sizes_px: Mapping[str, tuple[int, int]]) -> str:
    """Residuals of all board points in both pictures, as needles drawn to one enlarged scale."""
    everything = np.concatenate([record.residuals_left, record.residuals_right])
    typical = float(np.sqrt(np.mean(np.sum(everything[:, 2:] ** 2, axis=1)))) or 1e-9
    widest = max(sizes_px["left"][0], sizes_px["right"][0])
    gain = _round_gain(0.018 * widest / typical)
    aspect = max(h / w for w, h in sizes_px.values())
    height = 0.9 + (canvas.WIDTH_IN - 1.1) / 2 * aspect

    def paint(figure: Figure) -> None:
        row = canvas.rows_and_columns(
            figure, 1, 2, margins_in=(0.55, 0.1, 0.42, 0.42), gaps_in=(0.5, 0)
        )[0]
        for ax, side in zip(row, ("left", "right"), strict=True):
            points = record.residuals_left if side == "left" else record.residuals_right
            colour = canvas.LEFT if side == "left" else canvas.RIGHT
            rms = float(np.sqrt(np.mean(points[:, 2:] ** 2))) if len(points) else float("nan")
            _needles(ax, points, gain, colour)
            width, tall = sizes_px[side]
            ax.set(xlim=(0, width), ylim=(tall, 0), xlabel="column, px")
            ax.set_aspect("equal")
            words = f"{side}: {rms:.3f} px rms per coordinate, {len(points)} points"
            ax.set_title(words, loc="left", fontsize=7.5)
        row[0].set_ylabel("row, px")
        canvas.note(figure, 0.55, 0.13, f"needles {gain:g} times enlarged", fontsize=7, va="center")

    return canvas.draw("residuals", "Calibration residuals", height, paint)


def _round_gain(gain: float) -> float:
    """The next lower of 1, 2, 5, 10, 20, … so that a reader can divide by it."""
    decade = 10.0 ** np.floor(np.log10(gain))
    return float(max(step * decade for step in (1, 2, 5) if step * decade <= gain * 1.0001))


def _needles(ax: Axes, points: Floats, gain: float, colour: str, most: int = 1500) -> None:
    step = max(1, len(points) // most)
    p = points[::step]
    x = np.column_stack([p[:, 0], p[:, 0] + gain * p[:, 2], np.full(len(p), np.nan)]).ravel()
    y = np.column_stack([p[:, 1], p[:, 1] + gain * p[:, 3], np.full(len(p), np.nan)]).ravel()
    ax.plot(x, y, color=colour, lw=0.6)
    canvas.dots(ax, p[:, 0], p[:, 1], 1.2, canvas.INK)


def holdout(record: CalibrationRecord) -> str:
    """Errors of known distances on frames that the calibration never saw."""
    true, error = record.holdout_mm.T

    def paint(figure: Figure) -> None:
        left, right = canvas.rows_and_columns(
            figure, 1, 2, margins_in=(0.6, 0.1, 0.3, 0.42), gaps_in=(0.65, 0)
        )[0]
        rms = float(np.sqrt(np.mean(error**2)))
        reach = 1.05 * float(np.abs(error).max()) or 1.0
        left.hist(error, bins=np.linspace(-reach, reach, 42).tolist(), color=canvas.SECOND, lw=0)
        for at in (-rms, rms):
            left.axvline(at, color=canvas.MARK, lw=0.9, ls=(0, (4, 2)))
        left.set(xlabel="measured less true distance, mm", ylabel="distances")
        left.set_title(f"{error.size} distances, rms {rms:.3f} mm (dashed)", loc="left")
        step = max(1, error.size // 2000)
        canvas.dots(right, true[::step], error[::step], 1.6, canvas.LEFT)
        pad = 0.05 * float(np.ptp(true)) or 1.0
        right.set_xlim(float(true.min()) - pad, float(true.max()) + pad)
        right.axhline(0, color=canvas.QUIET, lw=0.6)
        right.set(xlabel="true distance, mm", ylabel="error, mm", ylim=(-reach, reach))
        share = float(np.sqrt(np.mean((error / true) ** 2)))
        right.set_title(f"against the distance: rms {share:.2%}", loc="left")
        right.grid(axis="y")

    return canvas.draw("holdout", "Distances on left-out frames", 2.5, paint)
