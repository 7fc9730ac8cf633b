"""Camera against accelerometer over all trials of a season: every common line, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from olivevib.report.figures import canvas

FEWEST = 3  # lines from which limits of agreement are drawn
MOST_SIGMA = 0.05  # of a line that counts in them: each sigma over its amplitude


@dataclass(frozen=True)
class CommonLine:
    """One line of one trial as both saw it: peak accelerations with sigmas, m/s².

    decided: the trial's comparison came to a verdict (agrees, differs).
    """

    trial: str
    f_hz: float
    optical_m_s2: float
    optical_sigma_m_s2: float
    sensor_m_s2: float
    sensor_sigma_m_s2: float
    decided: bool = True


def counts(line: CommonLine) -> bool:
    """Whether both know the line's amplitude to MOST_SIGMA, in a comparison that is decided.

    A percentage of a harmonic near the noise says nothing of how well both agree: a hundredth of
    the main line may be off by its own size.
    """
    known = line.decided and line.optical_sigma_m_s2 <= MOST_SIGMA * line.optical_m_s2
    return known and line.sensor_sigma_m_s2 <= MOST_SIGMA * line.sensor_m_s2


def limits_of_agreement(lines: Sequence[CommonLine]) -> tuple[float, float, float]:
    """Mean difference and its 95 % limits in % of the mean of both (Bland and Altman 1986)."""
    each = _differences(lines)
    middle, spread = float(each.mean()), float(each.std(ddof=1)) if each.size > 1 else float("nan")
    return middle, middle - 1.96 * spread, middle + 1.96 * spread


def _differences(lines: Sequence[CommonLine]) -> np.ndarray:
    a = np.array([line.optical_m_s2 for line in lines])
    b = np.array([line.sensor_m_s2 for line in lines])
    return np.asarray(200 * (a - b) / (a + b))


def agreement(lines: Sequence[CommonLine]) -> str:
    """Left: one against the other with the line of equality. Right: difference over the mean.

    Lines that do not count (``counts``) are hollow, and left alone.
    """
    strong = [line for line in lines if counts(line)]
    full = np.array([counts(line) for line in lines])
    a = np.array([line.optical_m_s2 for line in lines])
    b = np.array([line.sensor_m_s2 for line in lines])
    sigma_a = np.array([line.optical_sigma_m_s2 for line in lines])
    sigma_b = np.array([line.sensor_sigma_m_s2 for line in lines])

    def paint(figure: Figure) -> None:
        left, right = canvas.rows_and_columns(
            figure, 1, 2, margins_in=(0.65, 0.55, 0.3, 0.45), gaps_in=(0.8, 0)
        )[0]
        low, high = 0.7 * min(a.min(), b.min()), 1.4 * max(a.max(), b.max())
        left.plot([low, high], [low, high], color=canvas.QUIET, lw=0.8, ls=(0, (4, 2)))
        for these, face in ((full, canvas.LEFT), (~full, "white")):
            xerr, yerr = np.nan_to_num(sigma_b[these]), np.nan_to_num(sigma_a[these])
            left.errorbar(b[these], a[these], xerr=xerr, yerr=yerr, fmt="o", color=canvas.LEFT,
                          markerfacecolor=face, mew=0.8, ms=4, elinewidth=0.8)  # fmt: skip
        left.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high))
        left.set_xlabel("accelerometer, peak of the line, m/s²")
        left.set_ylabel("camera, m/s²")
        for axis in (left.xaxis, left.yaxis):
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("")
        left.grid(which="major")
        each, size = _differences(strong), ((a + b) / 2)[full]
        right.axhline(0, color=canvas.QUIET, lw=0.8, ls=(0, (4, 2)))
        right.plot(size, each, "o", color=canvas.LEFT, ms=3.5, mew=0)
        if len(strong) >= FEWEST:
            for at, style in zip(limits_of_agreement(strong), ("-", ":", ":"), strict=True):
                right.axhline(at, color=canvas.MARK, lw=1, ls=style)
                right.text(1.01, at, f"{at:+.2g} %", transform=right.get_yaxis_transform(),
                           va="center", fontsize=6.5)  # fmt: skip
        if size.size and size.max() > 10 * size.min():  # within a decade a log axis has no labels
            right.set_xscale("log")
            right.xaxis.set_minor_formatter("")
        right.xaxis.set_major_formatter("{x:g}")
        right.set_xlabel("mean of both, m/s²")
        right.set_ylabel("camera less sensor, % of the mean")
        right.grid(axis="y")

    return canvas.draw("agreement", "Camera against accelerometer, all trials", 3.2, paint)
