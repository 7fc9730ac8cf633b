"""The paper's calibration: Zhang's closed form, no distortion, no refinement; reproducible.

It is kept to reproduce the paper (section 4, Tab. 2) and for comparison. Real webcams distort, and
then it is off by tens of pixels or finds no camera at all: the joint refinement is the result.
Source: Zhang, A flexible new technique for camera calibration, 2000, doi:10.1109/34.888718.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.views import BoardView
from olivevib.errors import InputError
from olivevib.geometry import homography, nearest_rotation

LEAST_VIEWS = 3


@dataclass(frozen=True)
class ClosedForm:
    """One camera in closed form: K (3, 3) with skew, board poses R (V, 3, 3) and t_mm (V, 3)."""

    K: Floats
    R: Floats
    t_mm: Floats

    def projection_matrices(self) -> Floats:
        """The perspective projection matrices K [R | t] of every view (V, 3, 4)."""
        return np.asarray(self.K @ np.concatenate([self.R, self.t_mm[:, :, None]], axis=2))


def closed_form(
    views: Sequence[BoardView], size_px: tuple[int, int], name: str = "camera"
) -> ClosedForm:
    """K and the board poses from at least three views of the flat board.

    Raises InputError where no real K explains the homographies (the image of the absolute conic is
    not positive definite): views too frontal or too few, or a lens that distorts. Degenerates
    where all boards are parallel.
    """
    if len(views) < LEAST_VIEWS:
        raise InputError(
            f"The closed form needs {LEAST_VIEWS} views of the {name}, got {len(views)}.",
            "",
            "Show the board in more places, tilted.",
        )
    homographies = [homography(view.board_mm[:, :2], view.px) for view in views]
    K = _intrinsics(homographies, size_px)
    if K is None:
        raise InputError(
            f"The paper's closed form finds no real camera for the {name}.",
            f"The conic of {len(views)} homographies is not positive definite: the lens distorts, "
            "or the views are too frontal or too few.",
            "Use the joint refinement (leave out --paper), or show the board tilted in more views.",
        )
    poses = [_pose(K, H) for H in homographies]
    return ClosedForm(K, np.array([p[0] for p in poses]), np.array([p[1] for p in poses]))


def _intrinsics(homographies: Sequence[Floats], size_px: tuple[int, int]) -> Floats | None:
    """K (3, 3) of conditioned pixels, brought back; None where the conic is not definite."""
    width, height = size_px
    N = np.array([[2 / width, 0, -1], [0, 2 / width, -height / width], [0, 0, 1.0]])
    rows = []
    for H in homographies:
        h = N @ H
        h = h / np.linalg.norm(h)
        rows += [_row(h[:, 0], h[:, 1]), _row(h[:, 0], h[:, 0]) - _row(h[:, 1], h[:, 1])]
    b = np.linalg.svd(np.array(rows))[2][-1]
    B = np.array([[b[0], b[1], b[3]], [b[1], b[2], b[4]], [b[3], b[4], b[5]]])
    if B[0, 0] < 0:
        B = -B
    if np.linalg.eigvalsh(B)[0] <= 0:
        return None
    K = np.linalg.inv(np.linalg.cholesky(B).T)
    K = np.linalg.inv(N) @ (K / K[2, 2])
    return np.asarray(K / K[2, 2], dtype=np.float64)


def _row(a: Floats, b: Floats) -> Floats:
    """The row v with v . [B11 B12 B22 B13 B23 B33] = a^T B b."""
    return np.array([
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[1] * b[1],
        a[2] * b[0] + a[0] * b[2],
        a[2] * b[1] + a[1] * b[2],
        a[2] * b[2],
    ])  # fmt: skip


def _pose(K: Floats, H: Floats) -> tuple[Floats, Floats]:
    """Rotation and translation of one board from its homography, in front of the camera."""
    M = np.linalg.solve(K, H)
    M = M / np.linalg.norm(M[:, 0])
    M = M if M[2, 2] > 0 else -M
    R = nearest_rotation(np.column_stack([M[:, 0], M[:, 1], np.cross(M[:, 0], M[:, 1])]))
    return R, np.asarray(M[:, 2], dtype=np.float64)
