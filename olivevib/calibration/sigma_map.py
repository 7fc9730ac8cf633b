"""The sigma to expect of a marker anywhere in the working volume, from the rig's covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, floats
from olivevib.calibration.uncertainty import length_sigma, point_sigma
from olivevib.calibration.verdict import working_point
from olivevib.geometry import StereoRig

NEAR, FAR = 0.5, 2.0  # of the middle distance
LENGTH_MM = 200.0


@dataclass(frozen=True)
class SigmaMap:
    """Sigmas on a grid (K points) that both cameras see, left camera's frame.

    xyz_mm (K, 3); frame_mm (K, 3): of x, y, z from the pixels of one frame; rig_mm (K, 3): from the
    calibration, the same error in every frame; length_mm (K,): of a length of 200 mm across, from
    the calibration. shape: points along x, y, z of the box; inside (box): which of it are seen.
    """

    xyz_mm: Floats
    frame_mm: Floats
    rig_mm: Floats
    length_mm: Floats
    inside: Bools

    def __post_init__(self) -> None:
        k = len(self.xyz_mm)
        for name in ("xyz_mm", "frame_mm", "rig_mm"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (k, 3), nan=True))
        object.__setattr__(self, "length_mm", floats("length_mm", self.length_mm, (k,), nan=True))

    @property
    def total_mm(self) -> Floats:
        """Sigma (K, 3) of one position in one frame, both parts."""
        return np.asarray(np.hypot(self.frame_mm, self.rig_mm), dtype=np.float64)

    def on_grid(self, values: Floats) -> Floats:
        """Values (K,) on the box (X, Y, Z), NaN where not both cameras see."""
        out = np.full(self.inside.shape, np.nan)
        out[self.inside] = values
        return out


def sigma_map(
    rig: StereoRig,
    sigma_px: tuple[float, float],
    distance_mm: float,
    counts: tuple[int, int, int] = (9, 5, 7),
) -> SigmaMap:
    """Expected sigmas over what both cameras see, from half to twice the middle distance.

    ``sigma_px``: of a point in the left and the right image. NaN of the rig's part where the rig
    carries no covariance. Empty where the cameras share no view.
    """
    box = _box(rig, distance_mm, counts)
    points = box.reshape(-1, 3)
    seen = _seen(rig, points)
    at = points[seen]
    sigma = point_sigma(rig, at, sigma_px)
    half = np.array([LENGTH_MM / 2, 0.0, 0.0])
    length = length_sigma(rig, at - half, at + half) if len(at) else np.zeros(0)
    return SigmaMap(
        xyz_mm=at,
        frame_mm=sigma.frame_mm,
        rig_mm=sigma.common_mm,
        length_mm=length,
        inside=seen.reshape(box.shape[:3]),
    )


def _box(rig: StereoRig, distance_mm: float, counts: tuple[int, int, int]) -> Floats:
    """A box of points (X, Y, Z, 3) about the middle of what both cameras see, wider when far."""
    middle = working_point(rig, distance_mm)[0]
    width, height = rig.left.size_px
    reach = np.array([width / rig.left.lens[0], height / rig.left.lens[1]]) / 2
    u, v = (np.linspace(-1, 1, n) * r for n, r in zip(counts[:2], reach, strict=True))
    z = middle[2] * np.geomspace(NEAR, FAR, counts[2])
    direction = middle / middle[2]
    X, Y, Z = np.meshgrid(u, v, z, indexing="ij")
    return np.stack([(direction[0] + X) * Z, (direction[1] + Y) * Z, Z], axis=-1)


def _seen(rig: StereoRig, points: Floats) -> Bools:
    """Which points (N, 3) lie in both pictures."""
    out = np.ones(len(points), dtype=np.bool_)
    for camera, X in ((rig.left, points), (rig.right, rig.to_right(points))):
        px = camera.project(X)
        with np.errstate(invalid="ignore"):
            out &= ((px >= 0) & (px <= np.array(camera.size_px) - 1)).all(axis=1) & (X[:, 2] > 0)
    return out
