"""The frequency of each marker's dominant line: known, or the candidates that remain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.report.figures import canvas
from olivevib.report.lines import KNOWN, OPEN, describe
from olivevib.vibration import Line, LineStatus, Spectrum

MOST_FOLDS = 6  # multiples of half the frame rate that are labelled


def frequencies(spectrum: Spectrum, names: Mapping[int, str], nyquist_hz: float) -> str:
    """One row a marker on one frequency axis: filled = known, open = candidate, bar = sigma.

    Uprights stand at multiples of half the sampling rate, where the true frequency folds.
    """
    height = 0.75 + 0.2 * len(spectrum.lines)
    nyquist = nyquist_hz
    highest = max((f for line in spectrum.lines for f in _all(line)), default=nyquist)
    top = max(nyquist, highest) * 1.05

    def paint(figure: Figure) -> None:
        ax = canvas.rows_and_columns(
            figure, 1, 1, margins_in=(1.75, 2.35, 0.25, 0.45), gaps_in=(0, 0)
        )[0][0]
        folds = int(top / nyquist)
        for k in range(1, folds + 1):
            ax.axvline(k * nyquist, color=canvas.GRID, lw=0.9)
            words = f"half the frame rate, {nyquist:.4g} Hz" if k == 1 else f"{k * nyquist:.4g} Hz"
            if k == 1 or folds <= MOST_FOLDS:
                side = "left" if k == 1 and nyquist < 0.3 * top else "center"
                ax.text(k * nyquist, -0.75, words, ha=side, va="bottom", fontsize=6.5,
                        color=canvas.QUIET)  # fmt: skip
        ax.axvspan(nyquist, top, color=canvas.SHADE, lw=0, zorder=0)
        for row, line in enumerate(spectrum.lines):
            _line(ax, row, line)
            words = describe(line)
            ax.text(
                1.015, row, words, transform=ax.get_yaxis_transform(), va="center", fontsize=7.5
            )
        ax.set_yticks(range(len(spectrum.lines)), [names[int(i)] for i in spectrum.ids])
        ax.tick_params(axis="y", length=0, labelsize=7.5, labelcolor=canvas.INK)
        ax.set(xlim=(0, top), ylim=(len(spectrum.lines) - 0.4, -0.6), xlabel="true frequency, Hz")

    return canvas.draw("frequency", "Dominant frequency of each marker", height, paint)


def _all(line: Line) -> Sequence[float]:
    """The frequencies that are drawn for a line."""
    drawn = line.candidates_hz if line.status in OPEN else (line.f_hz,)
    return [f for f in drawn if np.isfinite(f)] if line.status in (*KNOWN, *OPEN) else []


def _line(ax: Axes, row: int, line: Line) -> None:
    colour = canvas.MARK
    if line.status in OPEN and line.candidates_hz:
        f = np.array(line.candidates_hz)
        ax.plot(f, np.full(f.size, row), ls=(0, (1, 2)), color=colour, lw=0.8)
        ax.plot(f, np.full(f.size, row), "o", mfc="none", mec=colour, ms=5, mew=1)
        for where, share in zip(line.candidates_hz, line.probabilities, strict=False):
            ax.text(where, row - 0.2, f"{share:.0%}", fontsize=6, ha="center", va="bottom")
    elif line.status in KNOWN and np.isfinite(line.f_hz):
        sigma = line.f_sigma_hz if np.isfinite(line.f_sigma_hz) else None
        sure = line.status in (LineStatus.DIRECT, LineStatus.CONFIRMED)
        face = colour if sure else "none"
        ax.errorbar(line.f_hz, row, xerr=sigma, fmt="o", color=colour, ms=5, mfc=face, mec=colour,
                    ecolor=colour, elinewidth=1, capsize=2)  # fmt: skip
