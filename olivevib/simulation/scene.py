"""A scene with exact truth: cameras with their clocks and optics, and bodies that move."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from olivevib.arrays import Bools, Floats, Ints, floats
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.simulation.motion import Motion
from olivevib.simulation.planar import Planar
from olivevib.simulation.surroundings import Surroundings

MOST_SUB_EXPOSURES = 200
STILL_PX = 1e-3


@dataclass(frozen=True)
class Optics:
    """How light becomes numbers in one camera; DN are grey levels of the 8-bit picture.

    psf_px: sigma of the Gaussian blur beside the pixel's own area. Sub-exposures are so short that
    nothing moves more than ``step_px`` in one. Noise variance is read² + shot · DN, before gamma.
    """

    psf_px: float = 0.7
    exposure_s: float = 0.002
    step_px: float = 0.5
    dark_dn: float = 40.0
    white_dn: float = 210.0
    read_noise_dn: float = 1.0
    shot_noise_dn: float = 0.01
    gamma: float = 1.0  # picture = 255 (light / 255)^(1/gamma)

    def __post_init__(self) -> None:
        if not 0.3 <= self.psf_px <= 8:
            raise ValueError(f"psf_px must lie in 0.3…8, got {self.psf_px}")
        if self.exposure_s < 0 or self.step_px <= 0 or self.gamma <= 0:
            raise ValueError(f"exposure, step_px and gamma must be positive: {self}")

    def moments_s(self, path_px: float) -> Floats:
        """When to look, from the middle of an exposure in which a print goes ``path_px``.

        Two moments around the mid-point of each sub-exposure (Gauss's rule): their mean and spread
        are those of the exposure itself, so that blur and amplitude come out right to fourth
        order. What stands still is looked at once.
        """
        if path_px < STILL_PX:
            return np.zeros(1)
        k = int(np.clip(np.ceil(path_px / self.step_px), 1, MOST_SUB_EXPOSURES))
        middles = (np.arange(k, dtype=np.float64) + 0.5) / k - 0.5
        around = np.array([-0.5, 0.5]) / (np.sqrt(3) * k)
        out: Floats = self.exposure_s * (middles[:, None] + around).ravel()
        return out


@dataclass(frozen=True)
class Clock:
    """When a camera exposes, and what its stamps say.

    Frame n is exposed (middle, row 0) at ``offset_s + n (1 + drift_ppm 1e-6) / fps`` of the trial
    clock; its stamp is n / fps plus jitter, in whole microseconds. Dropped frames leave a gap.
    """

    fps: float = 30.0
    offset_s: float = 0.0
    drift_ppm: float = 0.0
    jitter_s: float = 0.0
    drop_fraction: float = 0.0

    def exposed_s(self, frames: int) -> Floats:
        """Trial time (N,) of the middle of row 0's exposure, dropped frames included."""
        period = (1 + self.drift_ppm * 1e-6) / self.fps
        out: Floats = self.offset_s + np.arange(frames, dtype=np.float64) * period
        return out

    def stamps_us(self, frames: int, rng: np.random.Generator) -> Ints:
        """What the file says of each frame (N,), µs from 0, strictly increasing."""
        most = 0.45 / self.fps
        jitter = np.clip(self.jitter_s * rng.standard_normal(frames), -most, most)
        jitter[:1] = 0.0
        stamps: Ints = np.rint((np.arange(frames) / self.fps + jitter) * 1e6).astype(np.int64)
        return stamps

    def delivered(self, frames: int, rng: np.random.Generator) -> Bools:
        """Which frames (N,) arrive; the first and the last always do."""
        kept = rng.random(frames) >= self.drop_fraction
        kept[:1] = kept[-1:] = True
        return kept


@dataclass(frozen=True)
class Camera:
    """One camera of the pair: its lens, its place, its optics and its clock.

    R (3, 3), t_mm (3,) take the left camera's frame to this camera's.
    """

    model: CameraModel
    optics: Optics = field(default_factory=Optics)
    clock: Clock = field(default_factory=Clock)
    R: Floats = field(default_factory=lambda: np.eye(3))
    t_mm: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", floats("R", self.R, (3, 3)))
        object.__setattr__(self, "t_mm", floats("t_mm", self.t_mm, (3,)))

    def project(self, points_mm: ArrayLike) -> Floats:
        """Pixels (N, 2) of points (N, 3) of the left camera's frame."""
        points = np.asarray(points_mm, dtype=np.float64).reshape(-1, 3)
        return self.model.project(points @ self.R.T + self.t_mm)


@dataclass(frozen=True)
class Body:
    """A print on something that moves: pose at rest in the left camera's frame, and its motion.

    shade: how much light it gets, against a card that faces the camera in the open.
    """

    planar: Planar
    R0: Floats
    t0_mm: Floats
    motion: Motion = field(default_factory=Motion)
    shade: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "R0", floats("R0", self.R0, (3, 3)))
        object.__setattr__(self, "t0_mm", floats("t0_mm", self.t0_mm, (3,)))

    def pose(self, t_s: ArrayLike) -> tuple[Floats, Floats]:
        """Rotation (N, 3, 3) and place of the centre (N, 3) in mm at times (N,)."""
        moved = self.motion(t_s)
        R: Floats = rotation_from_vector(moved[:, 3:]) @ self.R0
        return R, self.t0_mm + moved[:, :3]

    def points_mm(self, t_s: ArrayLike, plane_mm: ArrayLike) -> Floats:
        """Points (K, 2) of the print, in the left camera's frame at times (N,): (N, K, 3)."""
        R, t = self.pose(t_s)
        plane = np.asarray(plane_mm, dtype=np.float64).reshape(-1, 2)
        out: Floats = plane @ np.swapaxes(R[:, :, :2], 1, 2) + t[:, None]
        return out


@dataclass(frozen=True)
class Scene:
    """Everything the cameras look at; ``seed`` fixes every random choice."""

    left: Camera
    right: Camera
    bodies: tuple[Body, ...]
    surroundings: Surroundings
    seed: int

    @property
    def rig(self) -> StereoRig:
        """The true pair of cameras."""
        return StereoRig(self.left.model, self.right.model, self.right.R, self.right.t_mm)


def seen_at(
    camera: Camera, body: Body, exposed_s: Floats, plane_mm: Floats
) -> tuple[Floats, Floats]:
    """Where and when a camera sees points of a print: px (N, K, 2) and trial time (N, K).

    Each point is seen when the row on which it lies is exposed: a fixed point of
    t = exposed + row_time · row(t), found to 1e-12 s; it converges since no motion outruns a row.
    """
    plane = np.asarray(plane_mm, dtype=np.float64).reshape(-1, 2)
    row_time = camera.model.row_time_s
    t = np.repeat(exposed_s[:, None], len(plane), axis=1)
    for _ in range(30):
        px = _project_each(camera, body, t, plane)
        later = exposed_s[:, None] + row_time * px[:, :, 1]
        done = np.nanmax(np.abs(later - t), initial=0.0) < 1e-12
        t = np.where(np.isfinite(later), later, t)
        if done:
            break
    return _project_each(camera, body, t, plane), t


def _project_each(camera: Camera, body: Body, t_s: Floats, plane_mm: Floats) -> Floats:
    R, place = body.pose(t_s.ravel())
    plane = np.tile(plane_mm, (t_s.shape[0], 1))
    points = np.einsum("nij,nj->ni", R[:, :, :2], plane) + place
    return camera.project(points).reshape(*t_s.shape, 2)
