"""Distances between markers: what a rigid body keeps constant shows the quality of it all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from olivevib.arrays import Floats
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas
from olivevib.report.figures.motion import whole

FEWEST = 5  # frames in which both markers must have been seen


@dataclass(frozen=True)
class Distance:
    """The distance of one pair of markers: mean and standard deviation over ``frames`` frames."""

    first: int
    second: int
    mean_mm: float
    sd_mm: float
    frames: int
    series_mm: Floats  # (N,) NaN where one of the two was not seen


def pair_distances(trajectory: Trajectory) -> list[Distance]:
    """Every pair of markers that was seen together in at least FEWEST frames, by marker ids."""
    out: list[Distance] = []
    order = np.argsort(trajectory.ids)
    for place, a in enumerate(order):
        for b in order[place + 1 :]:
            gap = np.linalg.norm(trajectory.xyz_mm[:, a] - trajectory.xyz_mm[:, b], axis=1)
            good = np.isfinite(gap)
            if good.sum() >= FEWEST:
                ids = int(trajectory.ids[a]), int(trajectory.ids[b])
                spread = float(gap[good].std(ddof=1))
                out.append(Distance(*ids, float(gap[good].mean()), spread, int(good.sum()), gap))
    return out


def chosen(pairs: Sequence[Distance], most: int = 8) -> list[Distance]:
    """At most ``most`` pairs for drawing: the steadiest, the least steady and those between."""
    ranked = sorted(pairs, key=lambda p: p.sd_mm)
    if len(ranked) <= most:
        return ranked
    return [ranked[i] for i in np.linspace(0, len(ranked) - 1, most).round().astype(int)]


def distances(trajectory: Trajectory, pairs: Sequence[Distance], names: Mapping[int, str]) -> str:
    """Left: the spread of every pair as a map. Right: some distances over time, less their mean."""
    shown = chosen(pairs)
    height = max(3.2, 0.75 + 0.36 * len(shown))

    def paint(figure: Figure) -> None:
        size = figure.get_size_inches()
        ids = sorted({p.first for p in pairs} | {p.second for p in pairs})
        side = min(2.35, height - 0.95)
        box = (0.55 / size[0], (height - 0.42 - side) / size[1], side / size[0], side / size[1])
        _map(figure.add_axes(box), pairs, ids)
        span = _round_up(max(*(4.5 * p.sd_mm for p in shown), 1e-6))
        left = 0.55 + side + 1.35
        box = (left / size[0], 0.4 / size[1], 1 - (left + 0.75) / size[0], 1 - 0.75 / size[1])
        ax = figure.add_axes(box)
        for row, pair in enumerate(shown):
            t, gap = canvas.thin(trajectory.t_s, pair.series_mm - pair.mean_mm, 800)
            ax.axhline(row, color=canvas.GRID, lw=0.5)
            ax.plot(t, row - gap / span, lw=0.7, color=canvas.LEFT)
            ax.text(1.01, row, f"± {pair.sd_mm:.3g}", transform=ax.get_yaxis_transform(),
                    va="center", fontsize=7)  # fmt: skip
        ax.set_yticks(
            range(len(shown)), [f"{p.first}–{p.second}: {p.mean_mm:.2f} mm" for p in shown]
        )
        ax.tick_params(axis="y", length=0, labelcolor=canvas.INK)
        ax.set_ylim(len(shown) - 0.4, -0.6)
        window = whole(trajectory)
        ax.set_xlim(window.start_s, window.end_s)
        ax.set_xlabel("trial clock, s")
        ax.spines["left"].set_visible(False)
        ax.set_title(f"distance less its mean; one row = {span:.3g} mm; ± standard deviation, mm",
                     loc="left", fontsize=7.5)  # fmt: skip

    return canvas.draw("distances", "Distances between markers", height, paint)


def _round_up(value: float) -> float:
    """The next of 1, 1.5, 2, 3, 5, 7.5, 10, … that is not below ``value``."""
    decade = 10.0 ** np.floor(np.log10(value))
    return float(
        min(s * decade for s in (1, 1.5, 2, 3, 5, 7.5, 10) if s * decade >= value * 0.9999)
    )


def _map(ax: Axes, pairs: Sequence[Distance], ids: Sequence[int]) -> None:
    """A triangle of numbers: standard deviation of each pair, darker squares = larger."""
    at = {marker_id: place for place, marker_id in enumerate(ids)}
    largest = max(*(p.sd_mm for p in pairs), 1e-9)
    small = len(ids) > 12
    for pair in pairs:
        x, y = at[pair.first], at[pair.second]
        ax.add_patch(_square(x, y, pair.sd_mm / largest))
        if not small:
            ax.text(x, y, f"{pair.sd_mm:.2g}", ha="center", va="center",
                    fontsize=6.5 if len(ids) <= 8 else 5)  # fmt: skip
    ax.set_xticks(range(len(ids)), [str(i) for i in ids], rotation=90 if small else 0)
    ax.set_yticks(range(len(ids)), [str(i) for i in ids])
    ax.set(xlim=(-0.6, len(ids) - 1.4), ylim=(len(ids) - 0.4, 0.4))
    ax.tick_params(length=0, labelcolor=canvas.INK)
    ax.set_title("spread of each distance, mm", loc="left", fontsize=7.5)
    ax.set_xlabel("marker")
    ax.set_ylabel("marker")
    for spine in ax.spines.values():
        spine.set_visible(False)


def _square(x: float, y: float, share: float) -> Rectangle:
    """A square that holds its number, the darker the larger ``share`` (0…1) is."""
    place = (x - 0.47, y - 0.47)
    return Rectangle(place, 0.94, 0.94, facecolor=canvas.SECOND, alpha=0.06 + 0.6 * share, lw=0)
