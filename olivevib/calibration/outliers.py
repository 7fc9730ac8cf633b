"""Points and views that do not fit the rest: dropped with a reason, a fifth at most."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.bundle import LEFT, RIGHT_ALONE
from olivevib.calibration.joint import JointFit
from olivevib.calibration.settings import CalibrationSettings
from olivevib.calibration.solve import Problem, Solution, solve

POINT_SIGMAS = 6.0  # a point this far off is a blunder; Huber's bound has tamed it already
VIEW_MADS = 4.0


@dataclass(frozen=True)
class Dropped:
    """A view that was not used: camera "left", "right" or "both", its frame, and why."""

    camera: str
    frame: int
    reason: str


@dataclass(frozen=True)
class Cleaned:
    """The fit without its outliers: dropped views, number of single points dropped."""

    fit: JointFit
    dropped: tuple[Dropped, ...]
    points: int
    too_many: bool


def drop_outliers(fit: JointFit, settings: CalibrationSettings) -> Cleaned:
    """Leave out blunders and views that fit far worse than the rest, then solve once more."""
    obs = fit.problem.observations
    norm = np.linalg.norm(fit.solution.residual, axis=1) / obs.sigma_px
    bad_views, too_many = _bad_views(fit, norm, settings)
    wild = (norm > POINT_SIGMAS) & ~bad_views[obs.pose]
    keep = ~bad_views[obs.pose] & ~wild
    counts = np.bincount(obs.pose, keep, obs.poses)
    keep &= (counts >= 4)[obs.pose]
    if keep.all():
        return Cleaned(fit, (), 0, False)
    problem = replace(fit.problem, observations=obs.only(keep))
    solution = solve(problem, fit.solution.state)
    dropped = tuple(_told(fit, int(pose), norm) for pose in np.flatnonzero(bad_views))
    again = replace(fit, problem=problem, solution=solution)
    return Cleaned(again, dropped, int(wild.sum()), too_many)


def _bad_views(fit: JointFit, norm: Floats, settings: CalibrationSettings) -> tuple[Bools, bool]:
    """Views (V,) whose robust rms is 4 MAD above the median; and whether there were too many."""
    obs = fit.problem.observations
    square = np.bincount(obs.pose, np.minimum(norm, POINT_SIGMAS) ** 2, obs.poses)
    counts = np.bincount(obs.pose, minlength=obs.poses)
    seen = counts > 0
    rms = np.sqrt(square / np.maximum(counts, 1))
    middle = float(np.median(rms[seen]))
    mad = 1.4826 * float(np.median(np.abs(rms[seen] - middle)))
    bad = seen & (rms > middle + VIEW_MADS * max(mad, 0.1 * middle)) & (rms > 2.0)
    most = int(settings.largest_dropped * seen.sum())
    if bad.sum() <= most:
        return bad, False
    worst = np.argsort(np.where(bad, -rms, 0.0), kind="stable")[:most]
    limited = np.zeros_like(bad)
    limited[worst] = True
    return limited, True


def _told(fit: JointFit, pose: int, norm: Floats) -> Dropped:
    obs = fit.problem.observations
    at = obs.pose == pose
    rms = float(np.sqrt((norm[at] ** 2).mean()))
    reason = f"its points miss by {rms:.1f} times what the other views allow"
    chains = np.unique(obs.chain[at])
    if chains[0] == RIGHT_ALONE:
        frame = fit.pair.right.views[int(np.flatnonzero(fit.made.right_pose == pose)[0])].frame
        return Dropped("right", frame, reason)
    camera = "left" if chains.size == 1 and chains[0] == LEFT else "both"
    return Dropped(camera, fit.pair.left.views[pose].frame, reason)


def solve_part(problem: Problem, solution: Solution, poses: Bools) -> tuple[Problem, Solution]:
    """The same problem with the board poses ``poses`` (V,) alone, started from the solution."""
    obs = problem.observations
    part = replace(problem, observations=obs.only(poses[obs.pose]))
    return part, solve(part, solution.state)
