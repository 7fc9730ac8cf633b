"""Both cameras at once: lenses, stereo pose, lag, row times, bow and every board pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.assemble import Assembly, BoardShape, Side, assemble, shape_of, table_of
from olivevib.calibration.bundle import BOW, LAG, LENS_OF, POSE, ROW_OF, THETA, State
from olivevib.calibration.lag import LeftPoints, Pose, agreement, medoid_pose, search_lag
from olivevib.calibration.lens import LensFit, fit_lens, lens_prior, mono_prior
from olivevib.calibration.settings import CalibrationSettings
from olivevib.calibration.solve import Prior, Problem, Solution, grams, solve
from olivevib.calibration.tracks import LONGEST_GAP_S
from olivevib.calibration.views import BoardView, frame_period_s, pair_views, stamped, times
from olivevib.geometry import CameraModel
from olivevib.progress import Tick, silent

FIRST_JITTER_S = 0.003  # scatter of a webcam's stamps to begin with
LEAST_JITTER_S = 2e-5
WIDEST_LAG_S = 1.0  # the search goes no further


@dataclass(frozen=True)
class Pair:
    """The views of both cameras, cleaned: what the joint problem is made of."""

    left: Side
    right: Side
    shape: BoardShape

    @property
    def sides(self) -> tuple[Side, Side]:
        """Left and right."""
        return self.left, self.right

    @property
    def timed(self) -> bool:
        """Whether both carry stamps, so that corner tracks in time exist."""
        return self.left.timed and self.right.timed


@dataclass(frozen=True)
class JointFit:
    """Result of the joint solve, with what is needed for covariance and tests.

    made: observations and which board pose each view shows; lenses: the fits of single cameras;
    lag_free: whether the lag was estimated; lag_rms (L, 2): lags that were searched, s, and the rms
    there, px; jitter_sd_s: scatter of single views about the lag; agreement: share of the common
    views in which both cameras, each alone, tell the same stereo rotation.
    """

    pair: Pair
    made: Assembly
    problem: Problem
    solution: Solution
    lenses: tuple[LensFit, LensFit]
    lag_free: bool
    lag_rms: Floats
    jitter_sd_s: float
    agreement: float

    @property
    def state(self) -> State:
        """The refined unknowns."""
        return self.solution.state


def make_pair(
    left: Sequence[BoardView],
    right: Sequence[BoardView],
    cameras: tuple[CameraModel, CameraModel],
    settings: CalibrationSettings,
) -> Pair:
    """Gather the views of both cameras."""
    both = [*left, *right]
    row = float(np.mean(np.concatenate([view.px[:, 1] for view in both])))
    timed = all(stamped(v) and frame_period_s(times(v)) <= LONGEST_GAP_S for v in (left, right))
    times_s = (settings.left_shutter.row_time_s, settings.right_shutter.row_time_s)
    a, b = (
        Side(tuple(views), tuple(views), camera, timed, row, row_time)
        for views, camera, row_time in zip((left, right), cameras, times_s, strict=True)
    )
    return Pair(a, b, shape_of(both))


def row_time_sds(pair: Pair, settings: CalibrationSettings) -> tuple[float, float]:
    """How far each row time may be from its start, s; 0 holds it (known, or stills)."""
    if not pair.timed:
        return 0.0, 0.0
    shutters = (settings.left_shutter, settings.right_shutter)
    a, b = (
        shutter.unknown_readout_s() / side.camera.size_px[1]
        for shutter, side in zip(shutters, pair.sides, strict=True)
    )
    return a, b


def fit_single(pair: Pair, settings: CalibrationSettings) -> tuple[LensFit, LensFit]:
    """Both lenses, each from its own views."""
    known = (settings.known_left, settings.known_right)
    sds = row_time_sds(pair, settings)
    a, b = (
        fit_lens(
            side, pair.shape, mono_prior(settings.lens, side, known[k], sds[k]), settings.huber
        )
        for k, side in enumerate(pair.sides)
    )
    return a, b


def joint_prior(pair: Pair, settings: CalibrationSettings) -> Prior:
    """Prior of lenses, bow and row times; stereo pose and lag are left to the images."""
    n = len(THETA)
    mean, precision = np.zeros(n), np.zeros((n, n))
    known, sds = (settings.known_left, settings.known_right), row_time_sds(pair, settings)
    for k, side in enumerate(pair.sides):
        at = LENS_OF[k]
        mean[at], precision[at, at] = lens_prior(settings.lens, side.camera.size_px, known[k])
        if sds[k] > 0:
            precision[ROW_OF[k], ROW_OF[k]] = 1 / sds[k] ** 2
    precision[BOW, BOW] = np.eye(3) / settings.lens.bow_sd_mm**2
    precision[LAG, LAG] = 1 / settings.lag_range_s**2
    return Prior(mean, precision, settings.lens.aspect_sd)


def unknowns(pair: Pair, settings: CalibrationSettings) -> Bools:
    """Which of THETA are estimated (24,)."""
    free = np.ones(len(THETA), dtype=np.bool_)
    free[LAG] = pair.timed and settings.estimate_lag
    free[list(ROW_OF)] = np.array(row_time_sds(pair, settings)) > 0
    return free


def fit_joint(
    pair: Pair,
    settings: CalibrationSettings,
    lenses: tuple[LensFit, LensFit],
    tick: Tick = silent,
) -> JointFit:
    """Refine everything together, the corner tracks renewed until lag and jitter stand still."""
    a, b = (side.with_scale(fit.scale) for side, fit in zip(pair.sides, lenses, strict=True))
    pair = replace(pair, left=a, right=b)
    start = start_pose(pair, settings, lenses)
    lag = start.lag_s
    free, prior = unknowns(pair, settings), joint_prior(pair, settings)
    jitter = FIRST_JITTER_S if free[LAG] else 0.0
    state: State | None = None
    lags = np.full(len(pair.left.views), lag)
    for _ in range(6):
        made = assemble(pair.left, pair.right, pair.shape, lags)
        problem = Problem(made.observations, prior, free, settings.huber, jitter)
        state = reposed(state or initial(lenses, start), made, lenses)
        solution = solve(problem, state, tick=tick)
        state = solution.state
        moved = float(np.abs(state.lag_s + state.jitter_s[: lags.size] - lags).max())
        if not free[LAG]:
            break
        before, jitter = jitter, jitter_sd(problem, state)
        lags = state.lag_s + state.jitter_s[: lags.size]
        pair = with_row_times(pair, state)
        if moved < 2e-4 and abs(jitter / before - 1) < 0.1:
            break
    lag_free = bool(free[LAG])
    rest = (lag_free, start.lag_rms, jitter, start.agreement)
    return JointFit(pair, made, problem, solution, lenses, *rest)


@dataclass(frozen=True)
class Start:
    """Where the joint solve begins: stereo pose, lag, what the search saw, how well they agree."""

    pose: Pose
    lag_s: float
    lag_rms: Floats
    agreement: float


def with_row_times(pair: Pair, state: State) -> Pair:
    """The pair whose tracks use the row times of the state."""
    a, b = (
        replace(side, row_time_s=float(row_time))
        for side, row_time in zip(pair.sides, state.row_time_s, strict=True)
    )
    return replace(pair, left=a, right=b)


def jitter_sd(problem: Problem, state: State) -> float:
    """The scatter of single views about the common lag, s: one step towards its most likely value.

    Source: MacKay, Bayesian interpolation, 1992 (well-determined parameters counted).
    """
    gram, _ = grams(problem, state)
    U = gram[:, :POSE, :POSE]
    U = U + 1e-12 * np.eye(POSE) * np.einsum("vii->v", U[:, :6, :6])[:, None, None]
    known = 1 - np.linalg.inv(U)[:, 6, 6] * problem.jitter_precision
    known = np.where(known > 1e-3, known, 0.0)  # a still board tells nothing
    if known.sum() < 3:
        return problem.jitter_sd_s
    return max(float(np.sqrt((state.jitter_s**2).sum() / known.sum())), LEAST_JITTER_S)


def start_pose(pair: Pair, settings: CalibrationSettings, lenses: tuple[LensFit, LensFit]) -> Start:
    """Stereo pose and lag to begin with, from the poses that each camera found alone."""
    left, right = lenses[0].solution.state, lenses[1].solution.state
    pairs = pair_views(pair.left.views, pair.right.views)
    a, b = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    pose = medoid_pose(left.R_pose[a], left.t_pose_mm[a], right.R_pose[b], right.t_pose_mm[b])
    share = agreement(left.R_pose[a], right.R_pose[b], pose.R)
    if not (pair.timed and settings.estimate_lag):
        return Start(pose, 0.0, np.zeros((0, 2)), share)
    samples, points = pair.right.samples(), left_points(pair, left)
    reach, camera = settings.lag_range_s, lenses[1].camera
    while True:
        step = min(samples.period_s / 5, reach / 4)
        count = int(np.ceil(reach / step))
        lags = np.asarray(step * np.arange(-count, count + 1), dtype=np.float64)
        lag, found, rms = search_lag(points, samples, camera, pose, lags)
        if abs(lag) < reach - 1.5 * step or reach >= WIDEST_LAG_S:
            return Start(found, lag, np.column_stack([lags, rms]), share)
        reach *= 2  # the best lag lies at the edge: look further


def left_points(pair: Pair, left: State) -> LeftPoints:
    """All board points in the left camera's frame, as the left camera alone sees them."""
    table = table_of(pair.left.views)
    xyz = np.einsum("nij,nj->ni", left.R_pose[table.view], table.board_mm)
    stamps = times(pair.left.views)
    return LeftPoints(xyz + left.t_pose_mm[table.view], table.id, stamps[table.view])


def initial(lenses: tuple[LensFit, LensFit], start: Start) -> State:
    """The joint state that the single cameras and the lag search suggest; poses of the left."""
    left, right = lenses[0].solution.state, lenses[1].solution.state
    return replace(
        left,
        right=right.left,
        R=start.pose.R,
        t_mm=start.pose.t_mm,
        lag_s=start.lag_s,
        bow_mm=(left.bow_mm + right.bow_mm) / 2,
        row_time_s=np.array([left.row_time_s[0], right.row_time_s[0]]),
    )


def reposed(state: State, made: Assembly, lenses: tuple[LensFit, LensFit]) -> State:
    """The state with poses for the views that this assembly leaves to the right camera alone."""
    right = lenses[1].solution.state
    n = made.left_pose.size
    own = np.flatnonzero(made.right_pose >= n)
    return replace(
        state,
        R_pose=np.concatenate([state.R_pose[:n], right.R_pose[own]]),
        t_pose_mm=np.concatenate([state.t_pose_mm[:n], right.t_pose_mm[own]]),
        jitter_s=np.concatenate([state.jitter_s[:n], np.zeros(own.size)]),
    )
