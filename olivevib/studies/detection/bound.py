"""The Cramér-Rao bound of a marker's centre, from differences of the renderer itself.

J holds the derivatives of the noise-free pixels on the marker by its four corners (eight unknowns)
and by the levels of dark and white; C = sigma² (J'J)^-1 with sigma² = noise² + 1/12 (rounding).
"""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import apply_homography, homography
from olivevib.studies.detection.canvas import Look, Print, centre_of, lay

STEP_PX = 0.1
REACH = 0.6  # modules around the dark square whose pixels count


def centre_bound_px(what: Print, H: Floats, look: Look, size: tuple[int, int]) -> float:
    """sqrt(trace / 2) of the least covariance of the centre, px, in a picture (width, height)."""
    half = what.modules / 2
    square = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    corners = apply_homography(H, square)

    def seen(at: Floats) -> tuple[Floats, Floats]:
        pose = homography(square, at)
        light = np.full((size[1], size[0]), 120.0)
        lay(light, what, pose, look)
        return light, centre_of(pose)

    base, _ = seen(corners)
    x, y = np.meshgrid(np.arange(size[0]) + 0.0, np.arange(size[1]) + 0.0)
    G = np.asarray(np.linalg.inv(H), dtype=np.float64)
    at = apply_homography(G, np.column_stack([x.ravel(), y.ravel()]))
    on = (np.abs(at) <= half + REACH).all(axis=1)
    columns, moves = [], []
    for k in range(8):
        step = np.zeros(8)
        step[k] = STEP_PX
        more, less = (seen(corners + sign * step.reshape(4, 2)) for sign in (1, -1))
        columns.append((more[0] - less[0]).ravel()[on] / (2 * STEP_PX))
        moves.append((more[1] - less[1]) / (2 * STEP_PX))
    columns += [np.ones(int(on.sum())), base.ravel()[on]]
    J = np.column_stack(columns)
    C = (look.noise**2 + 1 / 12) * np.linalg.inv(J.T @ J)[:8, :8]
    M = np.column_stack(moves)
    return float(np.sqrt(np.trace(M @ C @ M.T) / 2))
