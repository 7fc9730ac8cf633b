"""Where the fit starts: mean pose of each marker, sway alone, then the linear problem about it."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig
from olivevib.reconstruction.motion.pixels import Pixels, whitenings
from olivevib.reconstruction.motion.problem import (
    Pose,
    Problem,
    Times,
    Whitening,
    linearise,
    sway_part,
)
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations
from olivevib.reconstruction.motion.spline import Knots
from olivevib.reconstruction.pose import rotations

SWAY_STEPS = 2


def mean_pose(marker: MarkerSightings, rig: StereoRig) -> Pose:
    """From the points' mean pixels over time: triangulated, rigid, refined on both images."""
    sides = []
    for view in (marker.left, marker.right):
        px = view.px.mean(axis=0)
        sides.append((px[None], view.covariance_px2.mean(axis=0)[None]))
    vector, _ = rotations(rig, marker.points_mm, sides[0], sides[1])
    if not np.isfinite(vector).all():
        raise ValueError(f"marker {marker.id} cannot be triangulated; is the rig the right one?")
    from olivevib.geometry import rotation_from_vector
    from olivevib.reconstruction.triangulation import linear_eigen

    R0 = rotation_from_vector(vector[0])
    X = linear_eigen(rig, sides[0][0][0], sides[1][0][0])
    return Pose(R0, X.mean(axis=0) - R0 @ marker.points_mm.mean(axis=0))


def about_sway(
    observations: Observations,
    rig: StereoRig,
    pixels: Pixels,
    clock: Times,
    knots: Knots,
    prior: Floats,
) -> tuple[tuple[Pose, ...], tuple[Problem, ...], tuple[Whitening, ...]]:
    """Each marker linearised about its sway (prior (6,): precision of the coefficients)."""
    poses, problems, whites = [], [], []
    for m, marker in enumerate(observations.markers):
        pose = mean_pose(marker, rig)
        white = Whitening(
            whitenings(marker.left, pixels.noise[2 * m][0]),
            whitenings(marker.right, pixels.noise[2 * m + 1][0]),
        )
        p = len(marker.moving_mm)
        at = tuple(np.zeros((v.frame.size, p, 6)) for v in (marker.left, marker.right))
        row = observations.reference_row
        problem = linearise(marker, rig, pose, white, (at[0], at[1]), row)
        for _ in range(SWAY_STEPS):
            t_s = problem.times(clock)
            sway = sway_part(problem, t_s, knots, prior)
            columns = sway.by_interval(problem.y[..., None])
            half = np.linalg.solve(sway.L, sway.cross(columns))
            s = np.linalg.solve(sway.L.T, half).reshape(-1, 6)
            xi = knots.values(s, t_s)
            n = marker.left.frame.size
            problem = linearise(marker, rig, pose, white, (xi[:n], xi[n:]), row)
        poses.append(pose)
        problems.append(problem)
        whites.append(white)
    return tuple(poses), tuple(problems), tuple(whites)
