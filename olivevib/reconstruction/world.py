"""The frame of the results: the left camera's, the calibration board's, or gravity's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats, floats
from olivevib.calibration.uncertainty import rig_sensitivity
from olivevib.geometry import StereoRig, rotation_from_vector, vector_from_rotation
from olivevib.reconstruction.continuous import decided, stored_fit
from olivevib.reconstruction.motion import MarkerMotion, MotionFit
from olivevib.reconstruction.reconstruct import Reconstruction
from olivevib.reconstruction.trajectory import Trajectory

SAMPLES_AT_ONCE = 20_000


@dataclass(frozen=True)
class World:
    """A frame: X = R_world_left X_left + t_world_left_mm; name as in Trajectory.frame.

    sigma_rad: of its direction (the larger angle); source: from what it was taken, in words.
    """

    name: str
    R_world_left: Floats
    t_world_left_mm: Floats
    sigma_rad: float
    source: str

    def __post_init__(self) -> None:
        for name, shape in (("R_world_left", (3, 3)), ("t_world_left_mm", (3,))):
            object.__setattr__(self, name, floats(name, getattr(self, name), shape))


def board_world(R: Floats, t_mm: Floats, sigma_rad: float, source: str) -> World:
    """The frame of a board whose points are at R P + t_mm in the left camera's frame."""
    return World("board", R.T, -R.T @ t_mm, sigma_rad, source)


def gravity_world(up_left: Floats, sigma_rad: float, source: str) -> World:
    """Z up, x to the right of the left camera and level, y away from it; origin in the camera.

    ``up_left`` (3,): the vertical in the left camera's frame. Degenerates for a camera rolled by 90
    degrees, whose own x is vertical: then its y takes the place.
    """
    z = up_left / np.linalg.norm(up_left)
    side = np.array([1.0, 0, 0]) if abs(z[0]) < 0.9 else np.array([0.0, 1, 0])
    x = side - z * float(side @ z)
    x = x / np.linalg.norm(x)
    return World("gravity", np.stack([x, np.cross(z, x), z]), np.zeros(3), sigma_rad, source)


def plumb_up(trajectory: Trajectory, upper: int, lower: int) -> tuple[Floats, float]:
    """The vertical (3,) in the left camera's frame from two markers on a plumb line, and its sigma.

    ``trajectory`` in the left camera's frame. Raises ValueError where either was never seen.
    """
    at = [int(np.flatnonzero(trajectory.ids == i)[0]) for i in (upper, lower)]
    ends = trajectory.xyz_mm[:, at]
    good = np.isfinite(ends).all(axis=(1, 2))
    if not good.any():
        raise ValueError(f"markers {upper} and {lower} were never seen together")
    line = ends[good, 0] - ends[good, 1]
    mean = line.mean(axis=0)
    length = float(np.linalg.norm(mean))
    off = line / np.linalg.norm(line, axis=1, keepdims=True) - mean / length
    noise = trajectory.sigma_xyz_mm[good][:, at].max() / length / np.sqrt(good.sum())
    swing = float(np.sqrt((off**2).sum(axis=1).mean() / good.sum()))
    return mean / length, float(np.hypot(noise, swing))


def placed(result: Reconstruction, world: World) -> Reconstruction:
    """The reconstruction (of the left camera's frame) in another frame; the motion fit too."""
    R, t = world.R_world_left, world.t_world_left_mm
    path = result.trajectory
    motion = None if result.motion is None else _turned(result.motion, R, t)
    fits = path.fits
    if path.fits and motion is not None and decided(motion):
        fits = tuple(stored_fit(motion, m) for m in motion.markers)
    covariance = R @ path.covariance_mm2 @ R.T
    spin = np.einsum("ij,nmj->nmi", np.square(R), np.square(path.sigma_rotation_rad))
    rig = path.sigma_rig_mm
    trajectory = replace(
        path,
        xyz_mm=path.xyz_mm @ R.T + t,
        covariance_mm2=covariance,
        sigma_xyz_mm=np.sqrt(np.einsum("nmii->nmi", covariance)),
        rotation_rad=_turn_vectors(path.rotation_rad, R),
        sigma_rotation_rad=np.sqrt(spin),
        sigma_rig_mm=rig,
        frame=world.name,
        fits=fits,
        R_world_left=R,
        t_world_left_mm=t,
    )
    return replace(result, trajectory=trajectory, motion=motion)


def _turn_vectors(vectors: Floats, R: Floats) -> Floats:
    """Rotation vectors (N, M, 3) of R times each rotation; NaN stays."""
    out = np.full_like(vectors, np.nan)
    good = np.isfinite(vectors).all(axis=2)
    if good.any():
        turned = R @ rotation_from_vector(vectors[good])
        out[good] = np.array([vector_from_rotation(one) for one in turned])
    return out


def _turned(fit: MotionFit, R: Floats, t_mm: Floats) -> MotionFit:
    return replace(fit, markers=tuple(_turned_marker(m, R, t_mm) for m in fit.markers))


def _turned_marker(m: MarkerMotion, R: Floats, t_mm: Floats) -> MarkerMotion:
    six = np.kron(np.eye(2), R)
    count = m.sway.size + 12 * len(m.cosine)
    J = np.eye(len(m.covariance))
    J[:count, :count] = np.kron(np.eye(count // 3), R)
    return replace(
        m,
        R0=R @ m.R0,
        t0_mm=R @ m.t0_mm + t_mm,
        sway=m.sway @ six.T,
        cosine=m.cosine @ six.T,
        sine=m.sine @ six.T,
        covariance=J @ m.covariance @ J.T,
    )


def with_rig_sigma(result: Reconstruction, rig: StereoRig) -> Reconstruction:
    """The reconstruction with the sigma of every sample that the calibration causes.

    In whichever frame the trajectory is; unchanged where the rig carries no covariance.
    """
    path = result.trajectory
    if rig.covariance is None:
        return result
    flat = path.left_camera_mm.reshape(-1, 3)
    sigma = np.full_like(flat, np.nan)
    good = np.flatnonzero(np.isfinite(flat).all(axis=1))
    for start in range(0, good.size, SAMPLES_AT_ONCE):
        some = good[start : start + SAMPLES_AT_ONCE]
        slope = path.R_world_left @ rig_sensitivity(rig, flat[some])[0]
        sigma[some] = np.sqrt(np.einsum("nij,jk,nik->ni", slope, rig.covariance, slope))
    shaped = sigma.reshape(path.xyz_mm.shape)
    return replace(result, trajectory=replace(path, sigma_rig_mm=shaped))
