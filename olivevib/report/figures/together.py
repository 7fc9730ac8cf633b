"""How markers go together: response over frequency with phase and coherence, shape, rotation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from olivevib.arrays import Floats
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas
from olivevib.report.figures.motion import time_ticks, whole
from olivevib.report.words import number
from olivevib.vibration import Attitude, Deflection, Transmission

MOST = 4  # markers side by side
TRUSTED = 0.8  # coherence from which a response is drawn in full
_POINTS = 400
_SIZE = 0.16  # of the scene: the largest motion as it is drawn


def shown_responses(found: Sequence[Transmission], most: int = MOST) -> list[Transmission]:
    """The responses whose coherence at the line is largest, by marker id; none without a curve."""
    good = [t for t in found if np.isfinite(t.curve.coherence).any() and t.curve.f_hz.size > 3]
    ranked = sorted(good, key=lambda t: -float(np.nansum(t.coherence)))[:most]
    return sorted(ranked, key=lambda t: t.response)


def responses(found: Sequence[Transmission], names: Mapping[int, str]) -> str:
    """A column a marker; rows: |H1|, its phase, coherence; the three axes by colour and style."""
    columns = max(2, len(found))

    def paint(figure: Figure) -> None:
        side = (canvas.WIDTH_IN - 0.62 - 0.1 - 0.2 * (columns - 1)) / columns
        right = 0.1 + (columns - len(found)) * (side + 0.2)
        grid = canvas.rows_and_columns(
            figure, 3, len(found), margins_in=(0.62, right, 0.55, 0.42), gaps_in=(0.2, 0.12),
            light=True,
        )  # fmt: skip
        limits = _size_limits(found)
        for c, one in enumerate(found):
            top, middle, low = (row[c] for row in grid)
            for k in range(3):
                _response(top, middle, low, one, k)
            _finish(top, one.curve.f_hz, limits, c == 0, bottom=False)
            _finish(middle, one.curve.f_hz, (-180.0, 180.0), c == 0, bottom=False)
            _finish(low, one.curve.f_hz, (0.0, 1.0), c == 0, bottom=True)
            low.axhline(TRUSTED, color=canvas.QUIET, lw=0.6, ls=(0, (1, 2)))
            low.set_xlabel("frequency as sampled, Hz")
            top.set_title(names[one.response], loc="left", pad=3, fontsize=7.5, fontweight="bold")
        for row, label in zip(grid, ("|H1|", "phase, °", "coherence"), strict=True):
            row[0].set_ylabel(label)
        how = [{"color": c, "ls": s, "lw": 1.2}
               for c, s in zip(canvas.AXIS_COLOURS, canvas.AXIS_STYLES, strict=True)]  # fmt: skip
        canvas.key(figure, 0.62, 0.16, list(zip("xyz", how, strict=True)))

    title = f"Frequency response of {len(found)} markers"
    return canvas.draw("response", title, 4.3, paint)


def _size_limits(found: Sequence[Transmission]) -> tuple[float, float]:
    """Both ends of |H1|: of what is coherent, else of all."""
    sizes = np.concatenate([np.abs(t.curve.h1).ravel() for t in found])
    sure = np.concatenate([t.curve.coherence.ravel() for t in found]) >= TRUSTED
    kept = sizes[sure & np.isfinite(sizes) & (sizes > 0)]
    kept = kept if kept.size else sizes[np.isfinite(sizes) & (sizes > 0)]
    if not kept.size:
        return 0.1, 10.0
    return float(kept.min()) / 2, float(kept.max()) * 2


def _response(top: Axes, middle: Axes, low: Axes, one: Transmission, k: int) -> None:
    f_hz, h1, coherence = one.curve.f_hz, one.curve.h1[:, k], one.curve.coherence[:, k]
    colour, style = canvas.AXIS_COLOURS[k], canvas.AXIS_STYLES[k]
    sure = coherence >= TRUSTED
    size = np.where(np.abs(h1) > 0, np.abs(h1), np.nan)
    phase = np.degrees(np.angle(h1))
    phase = np.where(np.abs(np.diff(phase, prepend=phase[:1])) > 180, np.nan, phase)
    for ax, values in ((top, size), (middle, phase)):
        ax.plot(f_hz, values, color=canvas.SECOND, lw=0.4)
        ax.plot(f_hz, np.where(sure, values, np.nan), color=colour, lw=1.2, ls=style,
                marker=".", ms=2.2)  # fmt: skip
    low.plot(f_hz, coherence, color=colour, lw=0.9, ls=style)


def _finish(
    ax: Axes, f_hz: Floats, limits: tuple[float, float], left: bool, *, bottom: bool
) -> None:
    logarithmic = limits[0] > 0
    if logarithmic:
        ax.set_yscale("log")
    ax.set_xlim(0.0, float(f_hz[-1]))
    ax.set_ylim(*limits)
    x = MaxNLocator(5, prune="upper").tick_values(*ax.get_xlim())
    if logarithmic:
        y = [s * 10.0**d for d in range(-4, 5) for s in (1, 2, 5)]
    else:
        y = list(np.linspace(*limits, 5))
    canvas.light_ticks(ax, x, y, left=left, bottom=bottom)
    ax.yaxis.labelpad = 26


def deflection(shape: Deflection, path: Trajectory, names: Mapping[int, str]) -> str:
    """The shape in which the markers move at their common line, from the front and from above.

    Each marker's ellipse about its place, enlarged alike; the dot and the line to it show all
    markers at one instant.
    """
    shape = _placed(shape, path)
    place = _places(shape, path)
    factor = _enlarged(shape, place)

    def paint(figure: Figure) -> None:
        axes = canvas.rows_and_columns(
            figure, 1, 2, margins_in=(0.62, 0.15, 0.4, 0.42), gaps_in=(0.7, 0)
        )[0]
        for ax, (i, j), down in zip(axes, ((0, 1), (0, 2)), (True, False), strict=True):
            for row, marker_id in enumerate(shape.ids):
                _ellipse(ax, place[row], factor * shape.shape[row], (i, j), int(marker_id))
            ax.set_aspect("equal", adjustable="datalim")
            ax.margins(0.12)
            if down and path.frame == "left camera":
                ax.invert_yaxis()
            ax.set_xlabel(f"{'xyz'[i]}, mm")
            ax.set_ylabel(f"{'xyz'[j]}, mm")
            ax.locator_params(nbins=5)
            ax.grid()
        words = f"motion drawn {number(factor, 2)} times its size"
        axes[0].set_title(f"in the picture: {words}", loc="left", fontsize=7.5)
        axes[1].set_title("from above", loc="left", fontsize=7.5)

    return canvas.draw("deflection", f"Deflection shape of {len(shape.ids)} markers", 3.6, paint)


def _placed(shape: Deflection, path: Trajectory) -> Deflection:
    """The shape without markers that have no place in these paths."""
    seen = dict(zip(path.ids.tolist(), np.logical_or.reduce(path.seen, axis=0), strict=True))
    rows = [k for k, i in enumerate(shape.ids) if seen.get(i, False)]
    return replace(shape, ids=tuple(shape.ids[k] for k in rows), shape=shape.shape[rows])


def _places(shape: Deflection, path: Trajectory) -> Floats:
    """(M, 3) mean place of each marker of the shape."""
    at = [int(np.flatnonzero(path.ids == i)[0]) for i in shape.ids]
    return np.asarray(np.nanmean(path.xyz_mm[:, at], axis=0))


def _enlarged(shape: Deflection, place: Floats) -> float:
    """The factor, 1, 2 or 5 times a power of ten, that makes the largest motion well visible."""
    extent = float(np.ptp(place, axis=0).max()) if len(place) > 1 else 0.0
    size = float(np.nanmax(np.linalg.norm(shape.shape, axis=1)))
    if not (extent > 0 and size > 0):
        return 1.0
    wanted = _SIZE * extent / size
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(s * power for s in (1, 2, 5) if s * power <= wanted))


def _ellipse(
    ax: Axes, place: Floats, moved: np.ndarray, plane: tuple[int, int], marker_id: int
) -> None:
    pair = list(plane)
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 73))
    round_ = place[pair] + (moved[pair] * turn[:, None]).real
    now = place[pair] + moved[pair].real
    ax.plot(round_[:, 0], round_[:, 1], color=canvas.LEFT, lw=0.9)
    ax.plot([place[pair[0]], now[0]], [place[pair[1]], now[1]], color=canvas.MARK, lw=1.1)
    ax.plot(*now, "o", color=canvas.MARK, ms=3.4, mew=0)
    ax.plot(*place[pair], "s", mfc="none", mec=canvas.INK, ms=3, mew=0.7)
    ax.annotate(str(marker_id), (round_[:, 0].max(), place[pair[1]]), (3, 2),
                textcoords="offset points", fontsize=6.5)  # fmt: skip


def rotations(path: Trajectory, names: Mapping[int, str], ids: Sequence[int]) -> str:
    """Turn of each marker about its mean attitude over time: a row a marker, a column an axis."""
    window = whole(path)

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, len(ids), 3, margins_in=(0.55, 0.12, 0.38, 0.4), gaps_in=(0.16, 0.24),
            light=True,
        )  # fmt: skip
        for row, marker_id in zip(grid, ids, strict=True):
            turns = turns_of(path, marker_id)
            if turns is None:
                continue
            t_s, mrad = turns
            reach = float(np.nanpercentile(np.abs(mrad), 99.8)) * 1.15
            for k, ax in enumerate(row):
                ax.plot(*canvas.thin(t_s, mrad[:, k]), color=canvas.AXIS_COLOURS[k], lw=0.8)
                ax.set_xlim(window.start_s, window.end_s)
                ax.set_ylim(-reach, reach)
        canvas.row_names(figure, grid, [names[i] for i in ids])
        canvas.column_heads(figure, grid, ["about x, mrad", "about y, mrad", "about z, mrad"])
        time_ticks(grid)

    title = f"Rotation of {len(ids)} markers over time"
    return canvas.draw("rotation", title, 0.58 + 0.74 * len(ids), paint)


def turns_of(path: Trajectory, marker_id: int) -> tuple[Floats, Floats] | None:
    """Times (N,) and turns (N, 3) in mrad at all frames, NaN where not known; None: too few."""
    m = int(np.flatnonzero(path.ids == marker_id)[0])
    seen = path.seen[:, m]
    attitude = Attitude(path.sample_t_s[seen, m], path.rotation_rad[seen, m])
    if not attitude.known:
        return None
    turns = attitude.turns()
    mrad = np.full((path.t_s.size, 3), np.nan)
    mrad[np.flatnonzero(seen)[np.isfinite(attitude.rotation_rad).all(axis=1)]] = turns.values
    return path.t_s, mrad
