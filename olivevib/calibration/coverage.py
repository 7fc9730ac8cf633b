"""What the views cover: cells of the image, tilts, distances; the same code live and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.calibration.bundle import State
from olivevib.calibration.views import BoardView

CELLS = (8, 5)  # columns, rows of the image
FRONTAL_DEG = 15.0


@dataclass(frozen=True)
class Coverage:
    """What one camera saw: points in each cell of the image (rows, columns), and board poses.

    tilt_deg (V,): between the board's normal and the line of sight; azimuth_deg (V,): to which
    side it leans; distance_mm (V,).
    """

    cells: Ints
    tilt_deg: Floats
    azimuth_deg: Floats
    distance_mm: Floats

    @property
    def filled(self) -> float:
        """Share of the image's cells that hold points."""
        return float((self.cells > 0).mean())

    @property
    def frontal(self) -> float:
        """Share of the views tilted by less than 15 degrees."""
        return float((self.tilt_deg < FRONTAL_DEG).mean())

    @property
    def far_to_near(self) -> float:
        """Largest over smallest distance (5 % of the views left out at both ends)."""
        low, high = np.quantile(self.distance_mm, [0.05, 0.95])
        return float(high / low)

    def emptiest(self) -> str:
        """The ninth of the image with the fewest points, in words."""
        thirds = [np.array_split(row, 3, axis=1) for row in np.array_split(self.cells, 3, axis=0)]
        means = np.array([[part.mean() for part in row] for row in thirds])
        row, column = np.unravel_index(int(means.argmin()), means.shape)
        height = ("upper", "middle", "lower")[int(row)]
        side = ("left", "centre", "right")[int(column)]
        return "centre" if (height, side) == ("middle", "centre") else f"{height} {side}"


def cover(
    views: Sequence[BoardView],
    size_px: tuple[int, int],
    state: State,
    centre_mm: Floats,
) -> Coverage:
    """Coverage of one camera from its views and the board poses of ``state``, one a view."""
    R, t_mm = state.R_pose, state.t_pose_mm
    px = np.concatenate([view.px for view in views])
    x = np.clip(px[:, 0] / size_px[0] * CELLS[0], 0, CELLS[0] - 1).astype(np.int64)
    y = np.clip(px[:, 1] / size_px[1] * CELLS[1], 0, CELLS[1] - 1).astype(np.int64)
    cells = np.zeros((CELLS[1], CELLS[0]), dtype=np.int64)
    np.add.at(cells, (y, x), 1)
    middle = R @ np.append(centre_mm, 0.0) + t_mm
    distance = np.linalg.norm(middle, axis=1)
    normal = R[:, :, 2]
    cosine = np.abs((normal * middle).sum(axis=1)) / distance
    azimuth = np.degrees(np.arctan2(normal[:, 1], normal[:, 0]))
    return Coverage(cells, np.degrees(np.arccos(np.clip(cosine, 0, 1))), azimuth, distance)
