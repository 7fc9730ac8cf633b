"""Long videos: the views that tell most are solved for, the others only carry the corner tracks.

The information of a view is a matrix that does not depend on which others are used, so one look at
all views tells what each would add. Source: Fedorov, Theory of optimal experiments, 1972
(A-optimality, one view after the other).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.calibration.assemble import assemble
from olivevib.calibration.bundle import LAG, RIGHT, ROW_OF, THETA, State
from olivevib.calibration.design import depth_slopes, expected_variance
from olivevib.calibration.joint import JointFit, Pair, fit_joint, fit_single, with_row_times
from olivevib.calibration.lens import posed
from olivevib.calibration.settings import CalibrationSettings
from olivevib.calibration.solve import grams, reduce, solve
from olivevib.calibration.tracks import speeds
from olivevib.calibration.uncertainty import firm_inverse, symmetric
from olivevib.calibration.views import pair_views, times
from olivevib.geometry import StereoRig
from olivevib.progress import Tick, silent

FIRST = 24  # views spread in time from which the information of all is told
ALIKE_S = 0.15  # frames nearer than this in time err alike (see uncertainty.alike)
POSING = 8  # iterations that place the board in every view
TIME_SHARE = 0.5
LOOKED_AT = 24  # candidates that the slope of the goal names, of which the best is taken exactly


@dataclass(frozen=True)
class Choice:
    """The views to solve for, and why: ``words`` is empty where all are used.

    sigma_mm: expected sigma of depth in the working volume from the chosen views alone; all_mm:
    from all views, if neighbouring frames erred independently.
    """

    pair: Pair
    words: str = ""
    sigma_mm: float = float("nan")
    all_mm: float = float("nan")


def choose(pair: Pair, settings: CalibrationSettings, tick: Tick = silent) -> Choice:
    """At most ``settings.most_views`` common views, and half as many of one camera alone.

    Deterministic. First views spread in time are fitted; then, one by one, the view is added that
    lowers the expected error of a marker most (depth over the working volume, and how far lag and
    row times that are not known misplace what moves).
    """
    count = len(pair_views(pair.left.views, pair.right.views))
    if count <= settings.most_views:
        return Choice(pair)
    few = spread(pair, FIRST)
    fit = fit_joint(few, settings, fit_single(few, settings), tick)
    told = _Told.of(pair, fit)
    chosen = _greedy(told, settings.most_views)
    sigma, everything = told.depth_sigma_mm(chosen), told.depth_sigma_mm(np.arange(len(told.H)))
    n = len(pair.left.views)
    left = chosen[chosen < n]
    right = np.flatnonzero(np.isin(told.right_pose, chosen))
    both = int(told.common[chosen].sum())
    words = (
        f"{both} of {int(told.common.sum())} common views solved for, one by one those that lower "
        f"the expected depth error of a marker most: to {sigma:.2g} mm ({everything:.2g} mm with "
        "all, if neighbouring frames erred independently)"
    )
    kept = replace(pair, left=pair.left.only(left.tolist()), right=pair.right.only(right.tolist()))
    return Choice(kept, words, sigma, everything)


def spread(pair: Pair, most: int) -> Pair:
    """At most ``most`` common views, one a stretch of the video: slow, slow, fast, and so on.

    Slow views tell the geometry, fast ones the lag. The corner tracks keep all views.
    """
    pairs = np.array(pair_views(pair.left.views, pair.right.views), dtype=np.int64).reshape(-1, 2)
    speed = speeds(pair.left.views) if pair.timed else np.zeros(len(pair.left.views))
    speed = np.nan_to_num(speed[pairs[:, 0]], nan=1e9)
    stretches = np.array_split(np.arange(speed.size), min(most, speed.size))
    keep = np.array([
        part[(speed[part].argmax() if k % 3 == 2 else speed[part].argmin())]
        for k, part in enumerate(stretches)
    ])  # fmt: skip
    left, right = (np.unique(pairs[keep, k]).tolist() for k in (0, 1))
    return replace(pair, left=pair.left.only(left), right=pair.right.only(right))


@dataclass(frozen=True)
class _Told:
    """What every board pose of all views tells.

    H (V, p, p) its information, prior (p, p), slopes (8, p): what an error of the parameters does
    to a marker, mm; t_s (V,) when (stills: its number), common (V,) whether both cameras see it,
    right_pose: which pose each right view shows.
    """

    H: Floats
    prior: Floats
    slopes: Floats
    t_s: Floats
    common: Bools
    right_pose: Ints

    @classmethod
    def of(cls, pair: Pair, fit: JointFit) -> _Told:
        pair = _as_fitted(pair, fit)
        lags = np.full(len(pair.left.views), fit.state.lag_s)
        made = assemble(pair.left, pair.right, pair.shape, lags)
        problem = replace(fit.problem, observations=made.observations)
        held = replace(problem, free=np.zeros_like(problem.free))
        state = solve(held, _all_poses(pair, fit.state, made.right_pose), POSING).state
        each = reduce(problem, state, grams(problem, state)[0])
        obs = made.observations
        shared = np.isin(np.arange(obs.poses), obs.pose[obs.chain == RIGHT])
        return cls(symmetric(each.H), symmetric(each.prior_matrix), _slopes(fit, pair),
                   _when(pair, made.right_pose, obs.poses), shared, made.right_pose)  # fmt: skip

    @property
    def goals(self) -> tuple[tuple[float, Floats], ...]:
        """What is to be known and what it counts: depth, and half as much the time (not of stills).

        As logarithms of variances, so that neither unit nor speed decides between them.
        """
        depth, time = self.slopes[:5], self.slopes[5:]
        return ((1.0, depth), (TIME_SHARE, time)) if np.any(time) else ((1.0, depth),)

    def worth(self, information: Floats) -> float:
        """The goal to be lowered, of an information matrix (p, p)."""
        logs = [share * np.log(expected_variance(part, information)) for share, part in self.goals]
        return float(np.sum(logs))

    def depth_sigma_mm(self, poses: Ints) -> float:
        """Expected sigma of depth in the working volume, mm, from these board poses."""
        information = self.prior + self.H[poses].sum(axis=0)
        return float(np.sqrt(expected_variance(self.slopes[:5], information) / 5))


def _as_fitted(pair: Pair, fit: JointFit) -> Pair:
    """All views with the sigmas and row times of the fit of some."""
    a, b = (side.with_scale(lens.scale) for side, lens in zip(pair.sides, fit.lenses, strict=True))
    return with_row_times(replace(pair, left=a, right=b), fit.state)


def _all_poses(pair: Pair, state: State, right_pose: Ints) -> State:
    """The fitted state with a pose for every view, from its own points."""
    n = len(pair.left.views)
    own = np.flatnonzero(right_pose >= n)
    parts = [posed(pair.left, np.arange(n), state.left)]
    parts += [posed(pair.right, own, state.right)] if own.size else []
    return replace(
        state,
        R_pose=np.concatenate([part.R_pose for part in parts]),
        t_pose_mm=np.concatenate([part.t_pose_mm for part in parts]),
        jitter_s=np.zeros(n + own.size),
    )


def _when(pair: Pair, right_pose: Ints, poses: int) -> Floats:
    """When each board pose was seen, s; stills: far apart."""
    if not pair.timed:
        return np.arange(poses, dtype=np.float64) * 1e6
    out = np.zeros(poses)
    own = right_pose >= len(pair.left.views)
    out[: len(pair.left.views)] = times(pair.left.views)
    out[right_pose[own]] = times(pair.right.views)[own]
    return out


def _slopes(fit: JointFit, pair: Pair) -> Floats:
    """What an error of the free THETA does to a marker, mm (8, p): depth at five points of the
    working volume, and the way that it goes as fast as the board in the time that is wrong.
    """
    state = fit.state
    rig = StereoRig(state.left, state.right, state.R, state.t_mm)
    distance = float(np.median(np.linalg.norm(state.t_pose_mm, axis=1)))
    timing = np.zeros((3, len(THETA)))
    timing[0, LAG] = 1.0
    for row, (at, side) in enumerate(zip(ROW_OF, pair.sides, strict=True), 1):
        timing[row, at] = side.camera.size_px[1] / 4
    speed = np.nanmedian(speeds(pair.left.views)) if pair.timed else np.nan  # px/s
    timing *= np.nan_to_num(speed) * distance / state.left.lens[0]
    slopes = [depth_slopes(fit, rig, distance), timing[:, fit.problem.free]]
    return np.asarray(np.vstack(slopes), dtype=np.float64)


def _greedy(told: _Told, most: int) -> Ints:
    """Indices of the chosen board poses, sorted."""
    limit = {True: most, False: most // 2}
    gap = min(ALIKE_S, 0.5 * float(np.ptp(told.t_s)) / max(most, 1))
    open_ = np.einsum("vii->v", told.H) > 0
    chosen: list[int] = []
    information = told.prior

    def take(view: int) -> None:
        nonlocal information
        chosen.append(view)
        information = information + told.H[view]
        open_[np.abs(told.t_s - told.t_s[view]) < gap] = False
        open_[view] = False
        kind = bool(told.common[view])
        if sum(told.common[chosen] == kind) >= limit[kind]:
            open_[told.common == kind] = False

    shared = np.flatnonzero(told.common & open_)
    for k in np.linspace(0, shared.size - 1, 8).round().astype(np.int64):
        if open_[shared[k]]:
            take(int(shared[k]))
    while open_.any():
        C = firm_inverse(information)
        slope = sum((share / _spread(part, C)) * part.T @ part for share, part in told.goals)
        gain = np.einsum("ij,vij->v", C @ slope @ C, told.H)
        near = np.argsort(np.where(open_, -gain, np.inf), kind="stable")[:LOOKED_AT]
        near = near[open_[near]]
        take(int(near[int(np.argmin([told.worth(information + told.H[v]) for v in near]))]))
    return np.array(sorted(chosen), dtype=np.int64)


def _spread(slopes: Floats, covariance: Floats) -> float:
    return float(np.einsum("ni,ij,nj->", slopes, covariance, slopes))
