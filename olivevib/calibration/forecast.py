"""What a calibration from the views so far would know, and which further pose tells most.

The information of a pose is linear in the views, so each of some 135 candidates costs one small
matrix. Source: Kiefer, Optimum experimental designs, 1959 (A-optimality).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.bundle import LEFT, RIGHT, State
from olivevib.calibration.calibrate import Size, make_pair_checked
from olivevib.calibration.design import depth_slopes, expected_variance
from olivevib.calibration.gather import published_rig
from olivevib.calibration.joint import JointFit, fit_joint, fit_single
from olivevib.calibration.settings import CalibrationSettings
from olivevib.calibration.solve import Problem, Reduced, grams, reduce
from olivevib.calibration.uncertainty import point_sigma, uncertainty
from olivevib.calibration.verdict import working_point
from olivevib.calibration.views import BoardView
from olivevib.errors import InputError
from olivevib.geometry import StereoRig, rotation_from_vector

PLACES, DEPTHS, TILT_RAD = (0.2, 0.5, 0.8), (0.7, 1.0, 1.4), 0.6
LEAST_BASELINE_MM = 5.0
LEANS = (
    ((0.0, 0.0), "facing the cameras"),
    ((0.0, -TILT_RAD), "its left side nearer"),
    ((0.0, TILT_RAD), "its right side nearer"),
    ((TILT_RAD, 0.0), "its upper side nearer"),
    ((-TILT_RAD, 0.0), "its lower side nearer"),
)


@dataclass(frozen=True)
class Forecast:
    """What the views so far promise.

    depth_sigma_mm: of a point at distance_mm, from the calibration alone; hint: the pose of the
    board that lowers it most; after_mm: what it would then be.
    """

    depth_sigma_mm: float
    distance_mm: float
    hint: str
    after_mm: float

    @property
    def words(self) -> str:
        """One clause for people."""
        return (
            f"depth at {self.distance_mm / 1000:.1f} m known to {self.depth_sigma_mm:.2g} mm; "
            f"best next: {self.hint}"
        )


def forecast(
    left: Sequence[BoardView], right: Sequence[BoardView], size_left: Size, size_right: Size
) -> Forecast | None:
    """Sigma of depth by a quick solve of still views (paired by frame), and the best next pose.

    None where the views do not yet determine a pair.
    """
    try:
        return _forecast(left, right, (size_left, size_right))
    except (InputError, np.linalg.LinAlgError):
        return None


def _forecast(
    left: Sequence[BoardView], right: Sequence[BoardView], sizes: tuple[Size, Size]
) -> Forecast | None:
    settings = CalibrationSettings(estimate_lag=False)
    pair = make_pair_checked(left, right, sizes, settings)
    fit = fit_joint(pair, settings, fit_single(pair, settings))
    rig = published_rig(fit, uncertainty(fit.problem, fit.solution))
    if rig.baseline_mm < LEAST_BASELINE_MM:
        return None
    distance = float(np.median(np.linalg.norm(fit.state.t_pose_mm, axis=1)))
    at = working_point(rig, distance)
    sigma = float(point_sigma(rig, at, (0.1, 0.1)).common_mm[0, 2])
    told = best_next(fit, rig, distance)
    if not np.isfinite(sigma) or told is None:
        return None
    hint, share = told
    return Forecast(sigma, distance, hint, sigma * share)


def best_next(fit: JointFit, rig: StereoRig, distance_mm: float) -> tuple[str, float] | None:
    """The candidate pose that lowers the depth's sigma most, in words, and by which factor."""
    poses, words = candidates(rig, distance_mm, fit.pair.shape.centre_mm)
    problem, seen = _as_problem(fit, poses)
    if not seen.any():
        return None
    state = _state(fit.state, poses)
    each = reduce(problem, state, grams(problem, state)[0])
    now = reduce(fit.problem, fit.state, grams(fit.problem, fit.state)[0])
    slopes = depth_slopes(fit, rig, distance_mm)
    before = expected_variance(slopes, now.total_H)
    after = np.array([expected_variance(slopes, now.total_H + H) for H in _informed(each, seen)])
    best = int(after.argmin())
    return words[best], float(np.sqrt(after[best] / before))


def _informed(each: Reduced, seen: Bools) -> Floats:
    """Information of every candidate (C, p, p); none of those that are not seen by both."""
    return np.where(seen[:, None, None], each.H, 0.0)


@dataclass(frozen=True)
class _Poses:
    R: Floats  # (C, 3, 3)
    t_mm: Floats  # (C, 3)


def candidates(
    rig: StereoRig, distance_mm: float, centre_mm: Floats
) -> tuple[_Poses, tuple[str, ...]]:
    """Poses of the board over the left picture, near and far, leaning to all sides, with words."""
    width, height = rig.left.size_px
    R, t, words = [], [], []
    for row, v in zip(("upper", "middle", "lower"), PLACES, strict=True):
        for column, u in zip(("left", "centre", "right"), PLACES, strict=True):
            ray = rig.left.ray(np.array([[u * width, v * height]]))[0]
            for depth in DEPTHS:
                at = ray / np.linalg.norm(ray) * depth * distance_mm
                for (about_x, about_y), lean in LEANS:
                    turn = rotation_from_vector([about_x, about_y, 0.0])
                    R.append(turn)
                    t.append(at - turn @ np.append(centre_mm, 0.0))
                    words.append(f"{row} {column}, {depth * distance_mm / 1000:.1f} m, {lean}")
    return _Poses(np.array(R), np.array(t)), tuple(words)


def _state(state: State, poses: _Poses) -> State:
    none = np.zeros(len(poses.R))
    return replace(state, R_pose=poses.R, t_pose_mm=poses.t_mm, jitter_s=none)


def _as_problem(fit: JointFit, poses: _Poses) -> tuple[Problem, Bools]:
    """The problem of seeing the whole board in every candidate pose; which both cameras see."""
    obs = fit.problem.observations
    _, first = np.unique(obs.ids, return_index=True)
    board, count = obs.board_mm[first], len(poses.R)
    X = np.einsum("vij,nj->vni", poses.R, board) + poses.t_mm[:, None]
    state, n = fit.state, len(board)
    px = np.stack([
        state.left.project(X.reshape(-1, 3)).reshape(count, n, 2),
        state.right.project(X.reshape(-1, 3) @ state.R.T + state.t_mm).reshape(count, n, 2),
    ])  # fmt: skip
    sizes = np.array([state.left.size_px, state.right.size_px])[:, None, None]
    seen = np.asarray(((px >= 0) & (px < sizes)).all(axis=(2, 3)).all(axis=0))
    sigma = [float(np.median(obs.sigma_px[obs.camera == k])) for k in (0, 1)]
    track = np.zeros((2 * count * n, obs.track.shape[1], 2))
    track[:, 0] = np.nan_to_num(px).reshape(-1, 2)
    made = replace(
        obs,
        chain=np.repeat([LEFT, RIGHT], count * n),
        pose=np.tile(np.repeat(np.arange(count), n), 2),
        ids=np.tile(obs.ids[first], 2 * count),
        board_mm=np.tile(board, (2 * count, 1)),
        track=track,
        row=np.zeros(2 * count * n),
        sigma_px=np.repeat(sigma, count * n),
        poses=count,
    )
    return replace(fit.problem, observations=made), seen
