"""The scene in space: both cameras with what they see, the markers and their paths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.geometry import CameraModel, StereoRig
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas

MOST = 800  # samples drawn of one path


@dataclass(frozen=True)
class _View:
    """Two unit vectors of the scene, drawn to the right and upwards."""

    right: Floats
    up: Floats

    def flat(self, points: Floats) -> Floats:
        """Points (N, 3) as drawn (N, 2)."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


_FROM_ABOVE = _View(np.array([1.0, 0, 0]), np.array([0.0, 0, 1]))


def _oblique(turn_deg: float = 32.0, tilt_deg: float = 24.0) -> _View:
    """From behind the cameras, to the right and above: x right, y down, z forward."""
    a, b = np.radians([turn_deg, tilt_deg])
    right = np.array([np.cos(a), 0, np.sin(a)])
    forward = np.array([-np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
    return _View(right, -np.cross(forward, right))


def scene(rig: StereoRig, trajectory: Trajectory | None, names: Mapping[int, str]) -> str:
    """An oblique view and a plan, both in millimetres of the left camera's frame."""
    far = _distance_mm(trajectory)

    def paint(figure: Figure) -> None:
        oblique, plan = canvas.rows_and_columns(
            figure, 1, 2, margins_in=(0.1, 0.1, 0.35, 0.45), gaps_in=(0.75, 0)
        )[0]
        view = _oblique()
        for ax, how in ((oblique, view), (plan, _FROM_ABOVE)):
            for side, camera, place in _cameras(rig):
                _frustum(ax, how, camera, place, (side, 0.22 * far))
            if trajectory is not None:
                _paths(ax, how, trajectory, names)
            _frame(ax, figure)
        _triad(oblique, view)
        oblique.set_axis_off()
        oblique.set_title("seen from behind the cameras", loc="left")
        _plan(plan, rig)

    return canvas.draw("scene", "Cameras, markers and paths in space", 4.3, paint)


def _distance_mm(trajectory: Trajectory | None) -> float:
    """How far the scene reaches: the median distance of what was seen, mm."""
    if trajectory is None or not trajectory.seen.any():
        return 1000.0
    return float(np.median(np.linalg.norm(trajectory.left_camera_mm[trajectory.seen], axis=1)))


def _cameras(rig: StereoRig) -> tuple[tuple[str, CameraModel, tuple[Floats, Floats]], ...]:
    """Each camera with its rotation to the scene and its centre, mm."""
    R = rig.R_right_left.T
    here = (np.eye(3), np.zeros(3))
    return ("left", rig.left, here), ("right", rig.right, (R, -R @ rig.t_right_left_mm))


def _frustum(
    ax: Axes,
    view: _View,
    camera: CameraModel,
    place: tuple[Floats, Floats],
    drawn: tuple[str, float],
) -> None:
    """The pyramid of what a camera sees, cut at ``drawn[1]`` mm before it."""
    side, depth_mm = drawn
    R, centre = place
    w, h = camera.size_px
    rays = camera.ray([[0, 0], [w - 1, 0], [w - 1, h - 1], [0, h - 1]])
    corners = centre + depth_mm * rays @ R.T
    colour = canvas.LEFT if side == "left" else canvas.RIGHT
    style = "-" if side == "left" else (0, (4, 1.4))
    rim = view.flat(np.vstack([corners, corners[:1]]))
    ax.plot(rim[:, 0], rim[:, 1], color=colour, lw=1.0, ls=style)
    for corner in corners:
        edge = view.flat(np.array([centre, corner]))
        ax.plot(edge[:, 0], edge[:, 1], color=colour, lw=0.8, ls=style)
    axis = view.flat(np.array([centre, centre + 5 * depth_mm * R[:, 2]]))
    ax.plot(axis[:, 0], axis[:, 1], color=colour, lw=0.5, ls=(0, (1, 3)))
    x, y = view.flat(centre[None])[0]
    ax.plot(x, y, "s", color=colour, ms=4.5, mew=0)
    if view is not _FROM_ABOVE:
        low, high = np.vstack([rim, [[x, y]]]).min(axis=0), np.vstack([rim, [[x, y]]]).max(axis=0)
        ax.annotate(f"{side} camera", ((low[0] + high[0]) / 2, low[1]), (0, -8), color=colour,
                    textcoords="offset points", ha="center", va="center", fontsize=7)  # fmt: skip


def _frame(ax: Axes, figure: Figure) -> None:
    """Equal scales on both axes and room for names around all that is drawn."""
    width, height = figure.get_size_inches() * ax.get_position().size
    (x0, y0), (x1, y1) = ax.dataLim.get_points()
    scale = max((x1 - x0) / (width - 0.8), (y1 - y0) / (height - 0.6))  # mm an inch
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    ax.set_xlim(x - scale * width / 2, x + scale * width / 2)
    ax.set_ylim(y - scale * height / 2, y + scale * height / 2)


def _paths(ax: Axes, view: _View, trajectory: Trajectory, names: Mapping[int, str]) -> None:
    for m, marker_id in enumerate(trajectory.ids):
        path = trajectory.left_camera_mm[:, m]
        if not trajectory.seen[:, m].any():
            continue
        middle = view.flat(np.nanmean(path, axis=0)[None])[0]
        flat = view.flat(path[:: canvas.stride(len(path), MOST)])
        ax.plot(flat[:, 0], flat[:, 1], color=canvas.MARK, lw=0.6)
        x, y = middle
        ax.plot(x, y, "o", ms=3, mew=0.6, mfc="none", mec=canvas.INK)
        ax.annotate(str(int(marker_id)), (x, y), (3, 3), textcoords="offset points", fontsize=6.5)


def _triad(ax: Axes, view: _View, at: tuple[float, float] = (0.9, 0.1)) -> None:
    """The directions of the left camera's axes, in a corner of the drawing."""
    for k, axis in enumerate(np.eye(3)):
        direction = view.flat(axis[None])[0]
        arrow = {"arrowstyle": "<-", "color": canvas.AXIS_COLOURS[k], "shrinkA": 5, "shrinkB": 0}
        ax.annotate("xyz"[k], at, tuple(30 * direction), xycoords="axes fraction",
                    textcoords="offset points", ha="center", va="center", fontsize=8,
                    color=canvas.AXIS_COLOURS[k], fontweight="bold", arrowprops=arrow)  # fmt: skip


def _plan(ax: Axes, rig: StereoRig) -> None:
    centre = -rig.R_right_left.T @ rig.t_right_left_mm
    ax.plot([0, centre[0]], [0, centre[2]], color=canvas.INK, lw=0.8, ls=(0, (1, 1.5)))
    outward = 1 if centre[0] > 0 else -1
    for name, (x, z), away, colour in (
        ("left camera", (0.0, 0.0), -outward, canvas.LEFT),
        ("right camera", (centre[0], centre[2]), outward, canvas.RIGHT),
    ):
        ax.annotate(name, (x, z), (5 * away, -6), textcoords="offset points", va="center",
                    ha="left" if away > 0 else "right", fontsize=7, color=colour)  # fmt: skip
    ax.grid()
    ax.set(xlabel="x, mm", ylabel="z (away from the cameras), mm")
    words = f"baseline {rig.baseline_mm:.1f} mm (dotted), optical axes {rig.angle_deg:.1f}° apart"
    ax.set_title(f"seen from above: {words}", loc="left", fontsize=7.5)
