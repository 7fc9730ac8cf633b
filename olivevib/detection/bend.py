"""A marker wrapped round a branch: its printed plane bent to a cylinder that touches at the centre.

A printed point at distance s from the axis through the centre comes to lie sin(k s)/k across it and
(1 - cos(k s))/k behind it, k being the curvature. In the image, depth moves a point along one
direction; how far is part of the fit, so that the pose of the plane at the centre stays unbiased.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats
from olivevib.geometry import homography_jacobian

ROUNDS = 25  # of the inversion; it contracts where the surface is seen from outside
HORIZON = 0.97  # sine of the angle round the branch beyond which nothing is drawn
FIRST_CURVATURE = 0.05  # where the branch's thickness is not known
NODE_PX = 2  # distance of the nodes at which the bent plane is inverted


@dataclass(frozen=True)
class Bend:
    """How a marker is bent: curvature 1/modules (1 over the branch's radius), 0 when flat.

    axis_deg: direction of the branch in the printed plane, from u (right) to v (down), 90 for a
    marker that stands upright on a trunk; depth_px (2,): how far a point one module behind the
    plane moves in the image; shrink: by how much farther, as a share, it then is;
    estimated: the curvature was not known.
    """

    curvature: float
    axis_deg: float = 90.0
    depth_px: tuple[float, float] = (0.0, 0.0)
    shrink: float = 0.0
    estimated: bool = False

    def printed(self, H: Floats, px: Floats) -> Floats:
        """Printed points (…, 2) seen at image points (…, 2) through the pose H of the plane."""
        across, along = _axes(self.axis_deg)
        inverse, depth = np.linalg.inv(H), np.zeros(px.shape[:-1])
        centre, side = H[:2, 2] / H[2, 2], np.array(self.depth_px)
        s = h = depth
        for _ in range(ROUNDS if self.curvature else 1):
            flat = centre + (px - centre) * (1 + self.shrink * depth[..., None])
            m = (flat - depth[..., None] * side) @ inverse[:, :2].T + inverse[:, 2]
            m = m[..., :2] / m[..., 2:]
            p, h = m @ across, m @ along
            if self.curvature == 0:
                s = p
                break
            s = np.arcsin(np.clip(self.curvature * p, -HORIZON, HORIZON)) / self.curvature
            depth = 0.5 * (depth + _depth(self.curvature, s))
        out: Floats = s[..., None] * across + h[..., None] * along
        return out


@dataclass(frozen=True)
class Wrapped:
    """A marker that is wrapped: id, radius of the branch in modules (None: find it), its axis."""

    id: int
    radius_modules: float | None = None
    axis_deg: float = 90.0

    @property
    def curvatures(self) -> tuple[float, ...]:
        """Where a fit may begin, per module."""
        if self.radius_modules is None:
            return (FIRST_CURVATURE, 2 * FIRST_CURVATURE)
        return (1 / self.radius_modules,)


def _axes(axis_deg: float) -> tuple[Floats, Floats]:
    angle = np.radians(axis_deg)
    return np.array([np.sin(angle), -np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])


def _depth(curvature: float, s: Floats) -> Floats:
    out: Floats = (1 - np.cos(curvature * s)) / curvature
    return out


def depths_px(H: Floats) -> tuple[Floats, Floats]:
    """Both directions (2,), px a module, in which depth may move a point of a plane at pose H.

    From the lengths of a module's sides alone, as a distant camera sees them: a tilt to the left
    and to the right look alike. Both are near zero for a plane seen straight on.
    """
    A = homography_jacobian(H, [[0.0, 0.0]])[0]
    values, vectors = np.linalg.eigh(A @ A.T)
    length = np.sqrt(max(float(values[1] - values[0]), 0.0))
    one = length * vectors[:, 0]
    return one, -one


def bent_maps(
    bend: Bend, H: Floats, origin: Floats, size: tuple[int, int], samples: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Printed u and v (h, w) at texture samples of an image corner ``origin``, size (w, h)."""
    width, height = size
    nodes = (
        int(np.ceil(width / samples / NODE_PX)) + 2,
        int(np.ceil(height / samples / NODE_PX)) + 2,
    )
    x, y = np.meshgrid(np.arange(nodes[0]), np.arange(nodes[1]))
    px = origin + NODE_PX * np.stack([x, y], axis=-1)
    coarse = bend.printed(H, px).astype(np.float32)
    step = np.float32(1 / (samples * NODE_PX))
    at_x = np.tile(np.arange(width, dtype=np.float32) * step, (height, 1))
    at_y = np.tile((np.arange(height, dtype=np.float32) * step)[:, None], (1, width))
    fine = cv2.remap(coarse, at_x, at_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.ascontiguousarray(fine[..., 0]), np.ascontiguousarray(fine[..., 1])
