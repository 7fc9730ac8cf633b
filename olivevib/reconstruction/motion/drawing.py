"""What a drawing that is fitted to a whole marker reports while its rows are seen one by one.

Between its first and last row a shaken marker speeds up, so that its image is bent; no homography
bends, and the one that fits best puts corners and centre some 0.01 px beside where they were, in
step with the motion. That is predicted here: the fit is linear in small displacements of the
drawing's edges, each of which it sees along its normal only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, bools
from olivevib.geometry import apply_homography, homography
from olivevib.reconstruction.motion.sightings import Drawn

NODE = np.sqrt(0.15)  # of the marker's side: three Gauss points to a side


@dataclass(frozen=True)
class Pattern:
    """A marker's dark modules (n, n), rows from the top as printed, and the side of one in mm."""

    dark: Bools
    module_mm: float

    def __post_init__(self) -> None:
        n = len(self.dark)
        object.__setattr__(self, "dark", bools("dark", self.dark, (n, n)))
        if not self.module_mm > 0:
            raise ValueError(f"module_mm must be positive, got {self.module_mm}")


def nodes(modules: int) -> Floats:
    """Nine points (9, 2) of a marker, centred modules, from which its displacement is quadratic."""
    x = modules * NODE * np.array([-1.0, 0.0, 1.0])
    return np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)


def edges(dark: Bools) -> tuple[Floats, Floats]:
    """Middles (E, 2) and directions (E, 2) of all edges one module long, centred modules."""
    field = np.pad(dark, 1)
    n = len(field)
    middle, line = np.arange(n) - (n - 1) / 2, np.arange(n - 1) - (n - 2) / 2
    parts = []
    for axis, along in ((1, [0.0, 1.0]), (0, [1.0, 0.0])):
        change = np.diff(field, axis=axis)
        rows, columns = np.nonzero(change)
        x, y = (line, middle) if axis == 1 else (middle, line)
        place = np.column_stack([x[columns], y[rows]])
        parts.append((place, np.broadcast_to(along, place.shape)))
    places, directions = (np.concatenate(p) for p in zip(*parts, strict=True))
    return places, directions


def drawn(dark: Bools, stones: Floats, corners_px: Floats) -> Drawn:
    """Of a marker whose dark modules are ``dark`` (n, n), with P stones (P, 2) in centred modules.

    corners_px (N, P, 2): where the fit put them. The fit's own geometry is that of the mean pose.
    """
    places = nodes(len(dark))
    H = [homography(stones, px) for px in corners_px]
    px = np.stack([apply_homography(one, places) for one in H])
    mean = homography(stones, corners_px.mean(axis=0))
    return Drawn(px, reported(mean, dark, stones))


def reported(H: Floats, dark: Bools, points: Floats) -> Floats:
    """(2P, 2K): moves of points (P, 2) of the fitted drawing by displacements of its nodes, px."""
    places, along = edges(dark)
    ahead = apply_homography(H, places + 0.5 * along) - apply_homography(H, places - 0.5 * along)
    length = np.linalg.norm(ahead, axis=1)
    normal = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.sqrt(length)[:, None]  # sqrt(weight)
    A = np.einsum("ei,eij->ej", normal, _by_homography(H, places))
    fit = np.linalg.solve(A.T @ A, A.T)  # (8, E): of the homography by weighted moves of edges
    between = _interpolation(places, len(dark))  # (E, K)
    by_node = np.einsum("je,ei,ek->jki", fit, normal, between).reshape(8, -1)
    out: Floats = _by_homography(H, points).reshape(-1, 8) @ by_node
    return out


def _by_homography(H: Floats, points: Floats) -> Floats:
    """(N, 2, 8) derivative of the image of points by the first eight entries of H."""
    source = np.column_stack([points, np.ones(len(points))])
    w = source @ H[2]
    image = (source @ H[:2].T) / w[:, None]
    out = np.zeros((len(points), 2, 8))
    for i in (0, 1):
        out[:, i, 3 * i : 3 * i + 3] = source / w[:, None]
        out[:, i, 6:] = -source[:, :2] * (image[:, i] / w)[:, None]
    return out


def _interpolation(points: Floats, modules: int) -> Floats:
    """(N, 9) weights of the nodes at points: quadratic in both directions."""
    x = points / (modules * NODE)
    one = np.stack([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2], axis=-1)  # (N, 2, 3)
    out: Floats = (one[:, 1, :, None] * one[:, 0, None, :]).reshape(len(points), 9)
    return out
