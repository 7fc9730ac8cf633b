"""How the motion's frequencies change in time: a spectrogram on the true times, in grey levels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas
from olivevib.report.figures.motion import whole
from olivevib.vibration import Phase

WINDOW_S = 1.0
MOST = 150  # windows in one picture
FEWEST = 12  # samples that a window needs
RANGE_DB = 50.0  # from the strongest power down to white
BINS_A_WINDOW = 3  # frequencies a resolution width, so that a ridge is smooth


@dataclass(frozen=True)
class Spectrogram:
    """Power over time and frequency: t_s (K,) middles of the windows, f_hz (F,), power (F, K).

    power: mean square displacement of the axes together that a sine takes out, mm²; NaN: too few
    samples. Each window is fitted by least squares on its own times under a Hann weight, so gaps
    and uneven times do no harm. Of samples, frequencies fold at half the frame rate.
    """

    t_s: Floats
    f_hz: Floats
    power: Floats

    @property
    def ridge_hz(self) -> Floats:
        """(K,) the strongest frequency of each window; NaN where it is empty."""
        filled = np.where(np.isfinite(self.power), self.power, -1.0)
        best = self.f_hz[np.argmax(filled, axis=0)]
        return np.where(np.isfinite(self.power).any(axis=0), best, np.nan)


def spectrogram(
    trajectory: Trajectory, marker_id: int, top_hz: float, sway_hz: float = 0.0
) -> Spectrogram | None:
    """The spectrogram of one marker up to top_hz; None where the record is too short.

    sway_hz: motion up to there is sway. It would outshine the line, so the picture begins one
    width of a window's line (1 / its length) above it.
    """
    samples = trajectory.samples(marker_id)
    window = whole(trajectory)
    length = min(WINDOW_S, (window.end_s - window.start_s) / 4)
    if samples.t_s.size < 2 * FEWEST or length * top_hz < 3:
        return None
    count = min(MOST, int((window.end_s - window.start_s - length) / (length / 10)) + 1)
    middles = np.linspace(window.start_s + length / 2, window.end_s - length / 2, count)
    f_hz = np.arange(sway_hz + 1.0 / length, top_hz, 1.0 / (BINS_A_WINDOW * length))
    if count < 2 or f_hz.size < 2:
        return None
    columns = [_column(samples.t_s, samples.values, (at, length), f_hz) for at in middles]
    return Spectrogram(middles, f_hz, np.array(columns).T)


def _column(t_s: Floats, values: Floats, window: tuple[float, float], f_hz: Floats) -> Floats:
    """Power (F,) at each frequency of one window (middle, length); NaN: too few samples."""
    middle, length = window
    first, last = np.searchsorted(t_s, [middle - length / 2, middle + length / 2])
    if last - first < FEWEST:
        return np.full(f_hz.size, np.nan)
    since = t_s[first:last] - middle
    weight = 0.5 + 0.5 * np.cos(2 * np.pi * since / length)
    weight /= weight.sum()
    part = values[first:last] - weight @ values[first:last]
    turns = np.exp(-2j * np.pi * np.outer(f_hz, since)) * weight
    return np.asarray(2 * np.sum(np.abs(turns @ part) ** 2, axis=1))


def spectrograms(
    found: Mapping[int, Spectrogram],
    names: Mapping[int, str],
    phases: Sequence[Phase],
    across: str = "as sampled, Hz",
) -> str:
    """A panel a marker: time to the right, frequency upwards, darker = stronger; its ridge."""
    height = 0.66 + 1.33 * len(found)

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, len(found), 1, margins_in=(0.6, 0.75, 0.3, 0.42), gaps_in=(0, 0.42)
        )
        for row, (marker_id, one) in zip(grid, found.items(), strict=True):
            _panel(row[0], one, phases)
            row[0].set_title(names[marker_id], loc="left", pad=3, fontweight="bold", fontsize=7.5)
            row[0].set_ylabel(across)
        grid[-1][0].set_xlabel("trial clock, s")
        _scale(figure)

    title = f"Spectrogram of {len(found)} markers"
    return canvas.draw("spectrogram", title, height, paint)


def _panel(ax: Axes, one: Spectrogram, phases: Sequence[Phase]) -> None:
    step = one.t_s[1] - one.t_s[0]
    rise = one.f_hz[1] - one.f_hz[0]
    extent = (one.t_s[0] - step / 2, one.t_s[-1] + step / 2,
              one.f_hz[0] - rise / 2, one.f_hz[-1] + rise / 2)  # fmt: skip
    top = float(np.nanmax(one.power))
    level = 10 * np.log10(np.maximum(one.power / max(top, 1e-30), 1e-12))
    ax.imshow(level, origin="lower", aspect="auto", extent=extent, cmap=_greys(),
              vmin=-RANGE_DB, vmax=0, interpolation="nearest")  # fmt: skip
    ax.plot(one.t_s, one.ridge_hz, color="#ffffff", lw=1.8)  # so that it shows on black too
    ax.plot(one.t_s, one.ridge_hz, color=canvas.MARK, lw=0.9, ls=(0, (3, 1.5)))
    for phase in phases:
        for at in (phase.start_s, phase.end_s):
            if extent[0] < at < extent[1]:
                ax.axvline(at, color=canvas.LEFT, lw=0.7, ls=(0, (1, 2)))
    ax.set(xlim=extent[:2], ylim=extent[2:])
    ax.locator_params(axis="y", nbins=5)


def _greys() -> LinearSegmentedColormap:
    """White to black in even steps of lightness: the same in colour, in grey print, for anyone."""
    return LinearSegmentedColormap.from_list("greys", ["#ffffff", "#9a9a9a", "#161616"])


def _scale(figure: Figure) -> None:
    """The scale of the grey levels, at the right of the first panel."""
    width, height = figure.get_size_inches()
    box = (1 - 0.62 / width, 1 - 1.5 / height, 0.1 / width, 1.1 / height)
    ax = figure.add_axes(box)
    ramp = np.linspace(-RANGE_DB, 0, 64)[:, None]
    ax.imshow(ramp, origin="lower", aspect="auto", extent=(0, 1, -RANGE_DB, 0), cmap=_greys())
    ax.set_xticks([])
    ax.set_yticks([-40, -20, 0], ["−40", "−20", "0 dB"])
    ax.yaxis.tick_right()
    ax.tick_params(length=2, labelsize=6)
