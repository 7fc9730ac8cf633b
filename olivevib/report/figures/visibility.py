"""When each marker was seen: one strip a marker and camera, each state with its own shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from olivevib.arrays import Floats, Ints
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas
from olivevib.signals import State
from olivevib.tracking import Track

Strip = tuple[str, Floats, Ints]  # label, times (N,), states (N,)
# height and colour of each state: full and dark = seen; the lower and thinner, the less is known
_SHAPES: dict[State, tuple[float, dict[str, Any]]] = {
    State.SEEN: (0.7, {"facecolor": canvas.LEFT}),
    State.FLAGGED: (0.7, {"facecolor": "none", "edgecolor": canvas.LEFT, "hatch": "///"}),
    State.HIDDEN: (0.3, {"facecolor": canvas.AXIS_COLOURS[1]}),
    State.OUTSIDE: (0.3, {"facecolor": canvas.SECOND}),
    State.LOST: (0.3, {"facecolor": canvas.MARK}),
    State.DAMAGED: (0.7, {"facecolor": "none", "edgecolor": canvas.MARK, "hatch": "xxx"}),
    State.DROPPED: (0.08, {"facecolor": canvas.INK}),
}


def strips(
    tracks: Sequence[Track], trajectory: Trajectory | None, names: Mapping[int, str]
) -> list[Strip]:
    """The states to draw: left, right and 3-D of each marker, in that order."""
    out: list[Strip] = []
    for marker_id, name in names.items():
        own = [(t.camera, t.t_s, t.state) for t in tracks if t.id == marker_id]
        own.sort(key=lambda strip: strip[0])
        if trajectory is not None and marker_id in trajectory.ids:
            m = int(np.flatnonzero(trajectory.ids == marker_id)[0])
            own.append(("3-D", trajectory.t_s, trajectory.state[:, m]))
        if own:
            first, t_s, state = own[0]
            out += [(f"{name} — {first}", t_s, state), *own[1:]]
    return out


def visibility(rows: Sequence[Strip], part: int = 0) -> str:
    """State strips over the trial clock with a key of the states that occur."""
    occurring = [s for s in State if any((state == s).any() for _, _, state in rows)]
    height = 0.8 + 0.105 * len(rows)

    def paint(figure: Figure) -> None:
        ax = canvas.rows_and_columns(
            figure, 1, 1, margins_in=(2.0, 0.1, 0.35, 0.4), gaps_in=(0, 0)
        )[0][0]
        for y, (_, t_s, state) in enumerate(rows):
            step = float(np.median(np.diff(t_s))) if t_s.size > 1 else 1.0
            for s in occurring:
                tall, how = _SHAPES[s]
                bars = [
                    (t_s[a] - step / 2, t_s[b - 1] - t_s[a] + step)
                    for a, b in canvas.runs(state == s)
                ]
                if bars:
                    ax.broken_barh(bars, (y - tall / 2, tall), lw=0, **how)
        starts = [r[1][0] for r in rows if r[1].size]
        ends = [r[1][-1] for r in rows if r[1].size]
        ax.set_xlim(min(starts, default=0.0), max(ends, default=1.0))
        ax.set_ylim(len(rows) - 0.4, -0.6)
        ax.set_yticks(range(len(rows)), [label for label, _, _ in rows])
        ax.tick_params(axis="y", length=0, labelsize=6, labelcolor=canvas.INK)
        ax.spines["left"].set_visible(False)
        ax.set_xlabel("trial clock, s")
        _key(figure, occurring)

    return canvas.draw(f"seen{part}", "State of each marker over time", height, paint)


def _key(figure: Figure, occurring: Sequence[State]) -> None:
    width, height = figure.get_size_inches()
    x = 2.0
    for state in occurring:
        tall, how = _SHAPES[state]
        tall = tall * 0.15
        place = (x / width, 1 - (0.16 + tall / 2) / height)
        box = Rectangle(
            place, 0.3 / width, tall / height, lw=0, transform=figure.transFigure, **how
        )
        figure.add_artist(box)
        canvas.note(figure, x + 0.36, 0.16, state.word, va="center", fontsize=7)
        x += 0.55 + 0.06 * len(state.word)
