"""The pixels of one marker that a fit uses, in coordinates about its centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey
from olivevib.detection.template import REACH
from olivevib.geometry import apply_homography

Singles = NDArray[np.float32]

LEAST_PIXELS = 40


@dataclass(frozen=True)
class Pixels:
    """The pixels of one marker: normalised X, Y (N,), grey level (N,), and where they lie.

    trust (N,): weight of each pixel by its noise, 1 where nothing is known against it.
    """

    X: Singles
    Y: Singles
    level: Singles
    centre: Floats
    scale: float
    x: NDArray[np.intp]
    y: NDArray[np.intp]
    cell: NDArray[np.intp]  # 0…8: which ninth of the marker, row by row
    trust: Singles


def marker_pixels(
    grey: Grey,
    H: Floats,
    modules: int,
    stride: int = 1,
    reach_modules: float = REACH,
    path_px: tuple[float, float] = (0.0, 0.0),
    card: float = np.inf,
) -> Pixels | None:
    """Every ``stride``-th pixel in each direction on the dark square and some modules around it.

    Of these, whose motion path_px (2,) stays within ``card`` modules around the dark square.
    None where fewer than 40 pixels lie in the image.
    """
    reach = modules / 2 + reach_modules
    box = apply_homography(H, [[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]])
    low = np.maximum(np.ceil(box.min(axis=0)), 0).astype(int)
    high = np.minimum(np.floor(box.max(axis=0)), [grey.shape[1] - 1, grey.shape[0] - 1]).astype(int)
    if (high < low).any():
        return None
    x = np.arange(low[0], high[0] + 1, stride)
    y = np.arange(low[1], high[1] + 1, stride)
    G = np.linalg.inv(H)
    w = G[2, 0] * x + (G[2, 1] * y + G[2, 2])[:, None]
    u = G[0, 0] * x + (G[0, 1] * y + G[0, 2])[:, None]
    v = G[1, 0] * x + (G[1, 1] * y + G[1, 2])[:, None]
    limit = reach * np.abs(w)
    on = (np.abs(u) <= limit) & (np.abs(v) <= limit)
    for sign in (-0.5, 0.5) if any(path_px) else ():
        du, dv, dw = sign * (G[:, 0] * path_px[0] + G[:, 1] * path_px[1])
        limit = (modules / 2 + card) * np.abs(w + dw)
        on &= (np.abs(u + du) <= limit) & (np.abs(v + dv) <= limit)
    rows, columns = np.nonzero(on)
    third = (modules / 6) * w[rows, columns]
    cell = (u[rows, columns] > third).astype(np.intp) + (u[rows, columns] > -third)
    cell += 3 * ((v[rows, columns] > third).astype(np.intp) + (v[rows, columns] > -third))
    if rows.size < LEAST_PIXELS:
        return None
    centre = H[:2, 2] / H[2, 2]
    half = (modules - 1) / 2
    corners = apply_homography(H, [[-half, -half], [half, -half], [half, half], [-half, half]])
    scale = float(np.linalg.norm(corners - centre, axis=1).mean())
    px, py = x[columns], y[rows]
    X = ((px - centre[0]) / scale).astype(np.float32)
    Y = ((py - centre[1]) / scale).astype(np.float32)
    return Pixels(
        X,
        Y,
        grey[py, px].astype(np.float32),
        centre,
        scale,
        px,
        py,
        cell,
        np.ones_like(X),
    )
