"""Where in space this rig measures well: the predicted sigma of a position, seen from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from olivevib.arrays import Floats
from olivevib.geometry import CameraModel, StereoRig
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.figures import canvas

GRID = 48  # points along each side
_PANELS = ("across (x and y together)", "in depth (z)")


@dataclass(frozen=True)
class SigmaMap:
    """Sigma over a horizontal plane: x_mm (X,), z_mm (Z,), across_mm and depth_mm (Z, X).

    NaN where not both cameras see the place. Scaled so that it meets the median sigma of the
    markers: what stands there is this trial's image noise, carried to other places.
    """

    x_mm: Floats
    z_mm: Floats
    across_mm: Floats
    depth_mm: Floats


def sigma_map(rig: StereoRig, trajectory: Trajectory) -> SigmaMap | None:
    """The map around the markers, at their median height; None without a located marker."""
    seen = trajectory.seen
    places = [
        trajectory.xyz_mm[seen[:, m], m].mean(axis=0)
        for m in range(trajectory.ids.size)
        if seen[:, m].any()
    ]
    sigma = trajectory.sigma_xyz_mm[seen]
    sigma = sigma[np.isfinite(sigma).all(axis=1) & (sigma > 0).all(axis=1)]
    if not places or not sigma.size:
        return None
    at = np.array(places)
    unit = _sigmas(rig, at)
    scale = float(np.median(sigma[:, 2]) / np.nanmedian(unit[:, 2]))
    if not np.isfinite(scale):
        return None
    pad = 0.25 * float(np.median(at[:, 2]))
    x = np.linspace(at[:, 0].min() - pad, at[:, 0].max() + pad, GRID)
    z = np.linspace(max(0.3 * at[:, 2].min(), at[:, 2].min() - pad), at[:, 2].max() + pad, GRID)
    points = np.stack(np.meshgrid(x, z, indexing="xy"), axis=-1).reshape(-1, 2)
    height = np.full(len(points), float(np.median(at[:, 1])))
    found = scale * _sigmas(rig, np.column_stack([points[:, 0], height, points[:, 1]]))
    across = np.hypot(found[:, 0], found[:, 1]).reshape(GRID, GRID)
    return SigmaMap(x, z, across, found[:, 2].reshape(GRID, GRID))


def _sigmas(rig: StereoRig, points_mm: Floats) -> Floats:
    """Sigma (N, 3) of points (N, 3) for an image noise of 1 px in both cameras; NaN: not seen."""
    information = np.zeros((len(points_mm), 3, 3))
    good = np.ones(len(points_mm), dtype=bool)
    for camera, points, R in (
        (rig.left, points_mm, np.eye(3)),
        (rig.right, rig.to_right(points_mm), rig.R_right_left),
    ):
        px, by_point, _ = camera.project_jacobian(points)
        good &= _inside(camera, px)
        by_left = np.where(np.isfinite(by_point), by_point, 0.0) @ R
        information += np.swapaxes(by_left, 1, 2) @ by_left
    out = np.full((len(points_mm), 3), np.nan)
    if good.any():
        covariance = np.linalg.inv(information[good])
        out[good] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return out


def _inside(camera: CameraModel, px: Floats) -> np.ndarray:
    width, height = camera.size_px
    x, y = np.nan_to_num(px, nan=-1e9).T
    return np.asarray((x >= 0) & (x < width) & (y >= 0) & (y < height))


def sigma_maps(found: SigmaMap, trajectory: Trajectory) -> str:
    """Two plans: across the line of sight and in depth, lines of equal sigma in mm, markers."""

    def paint(figure: Figure) -> None:
        grid = canvas.rows_and_columns(
            figure, 1, 2, margins_in=(0.62, 0.15, 0.35, 0.42), gaps_in=(0.6, 0)
        )[0]
        for ax, title, values in zip(grid, _PANELS, (found.across_mm, found.depth_mm), strict=True):
            _plan(ax, found, values)
            _markers(ax, trajectory)
            ax.set_title(f"sigma {title}, mm", loc="left", fontsize=7.5)
            ax.set_xlabel("x, mm")
        grid[0].set_ylabel("distance z, mm")

    return canvas.draw("sigmamap", "Map of the standard deviation", 3.3, paint)


def _plan(ax: Axes, found: SigmaMap, values: Floats) -> None:
    known = values[np.isfinite(values)]
    ax.set(xlim=found.x_mm[[0, -1]], ylim=found.z_mm[[0, -1]])
    outside = np.where(np.isfinite(values), np.nan, 1.0)
    ax.contourf(found.x_mm, found.z_mm, np.nan_to_num(outside, nan=0.0), levels=[0.5, 1.5],
                colors=[canvas.SHADE])  # fmt: skip
    if known.size < 4 or known.max() <= known.min():
        return
    steps = [s * 10.0**d for d in range(-6, 4) for s in (1, 1.5, 2, 3, 5, 7)]
    levels = [v for v in steps if known.min() < v < known.max()]
    if not levels:
        levels = [float(np.median(known))]
    lines = ax.contour(found.x_mm, found.z_mm, values, levels=levels, colors=[canvas.LEFT],
                       linewidths=0.8)  # fmt: skip
    ax.clabel(lines, fmt=lambda v: f"{v:.3g}", fontsize=6.5, inline=True)


def _markers(ax: Axes, trajectory: Trajectory) -> None:
    for m, marker_id in enumerate(trajectory.ids):
        seen = trajectory.seen[:, m]
        if seen.any():
            x, _, z = trajectory.xyz_mm[seen, m].mean(axis=0)
            ax.plot(x, z, "o", color=canvas.MARK, ms=4, mew=0)
            ax.annotate(str(int(marker_id)), (x, z), xytext=(4, 3), textcoords="offset points",
                        fontsize=7, color=canvas.INK)  # fmt: skip
