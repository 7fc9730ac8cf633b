"""The fitted motion as a trajectory: a fine even grid where it holds, frames where it does not."""

from __future__ import annotations

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.reconstruction.motion.types import MarkerMotion, Motion, MotionFit
from olivevib.reconstruction.trajectory import ContinuousFit, Trajectory
from olivevib.signals import State
from olivevib.vibration.types import LineStatus

FINER = 8  # grid points a frame period
MOST_CHI2 = 3.0
MOST_SCATTER = 20.0  # of the pictures about any motion like it, over what their drawings tell
DECIDED = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)


def decided(fit: MotionFit | None) -> bool:
    """Whether one motion was found that may stand for the record.

    A fit that leaves more than three times the pictures' scatter is not this motion, whatever its
    branches say of each other; nor is one about which they scatter far more than noise, as they do
    where rest and start-up are taken for the steady part.
    """
    return (
        fit is not None
        and bool(fit.markers)
        and fit.kind in ("steady", "wandering")
        and fit.status in DECIDED
        and fit.chi2 <= MOST_CHI2
        and fit.noise_scale <= MOST_SCATTER
    )


def interval_s(fit: MotionFit) -> tuple[float, float]:
    """Where the fit holds, on the trial clock."""
    return fit.start_s + fit.shift_s, fit.end_s + fit.shift_s


def fine_grid(fit: MotionFit, frame_rate_hz: float) -> Floats:
    """Even times inside the fit, eight a frame period."""
    start, end = interval_s(fit)
    step = 1.0 / (frame_rate_hz * FINER)
    return np.asarray(start + step * np.arange(int((end - start) / step) + 1))


def trajectory_of(fit: MotionFit, frames: Trajectory) -> Trajectory:
    """The paths of ``frames`` with the fitted motion in their place where it holds.

    frames: what was triangulated, on the frames' times. Inside the fit every row is a grid point;
    a marker has a position there only while the nearest frame showed it, so gaps stay gaps. A
    marker that was not fitted keeps its own samples, each in the row nearest to its instant.
    Outside, frames are flagged: while a machine starts or stops, no interpolation follows it.
    """
    rate = 1.0 / float(np.median(np.diff(frames.t_s)))
    grid = fine_grid(fit, rate)
    first, last = frames.sample_t_s.min(axis=1), frames.sample_t_s.max(axis=1)
    outside = (np.maximum(last, frames.t_s) < grid[0]) | (np.minimum(first, frames.t_s) > grid[-1])
    base = _Rows(frames, outside, grid)
    motion = fit.evaluate(grid)
    fitted = {int(i): k for k, i in enumerate(motion.ids)}
    for m, marker in enumerate(frames.ids.tolist()):
        if marker in fitted:
            base.put_motion(m, motion, fitted[marker])
        else:
            base.put_samples(m)
    return base.trajectory(tuple(stored_fit(fit, m) for m in fit.markers))


class _Rows:
    """The arrays of the new trajectory: frames outside of the fit, grid points inside."""

    def __init__(self, frames: Trajectory, outside: Bools, grid: Floats) -> None:
        t_s = np.concatenate([frames.t_s[outside], grid])
        self.order = np.argsort(t_s, kind="stable")
        self.frames, self.grid = frames, grid
        self.first = int(outside.sum())
        self.inside = np.flatnonzero(~outside)
        self.t_s = t_s
        self.values = {
            name: self._start(getattr(frames, name)[outside])
            for name in (
                *("xyz_mm", "sigma_xyz_mm", "covariance_mm2"),
                *("rotation_rad", "sigma_rotation_rad", "epipolar_px"),
            )
        }
        m = frames.ids.size
        self.sample_t_s = np.vstack(
            [frames.sample_t_s[outside], np.repeat(grid[:, None], m, axis=1)]
        )
        empty = np.full((grid.size, m), int(State.DROPPED), np.int64)
        before = frames.state[outside]
        doubtful = np.where(before == State.SEEN, int(State.FLAGGED), before)
        self.state = np.vstack([doubtful, empty])

    def _start(self, kept: Floats) -> Floats:
        rest = np.full((self.grid.size, *kept.shape[1:]), np.nan)
        return np.concatenate([kept, rest])

    def put_motion(self, m: int, motion: Motion, k: int) -> None:
        """The fitted motion of marker column m, while the nearest frame showed it."""
        near = _nearest(self.frames.sample_t_s[:, m], self.grid)
        state = self.frames.state[near, m]
        finite = np.isfinite(motion.xyz_mm[:, k]).all(axis=1)
        seen = (state <= State.FLAGGED) & finite
        at = self.first + np.flatnonzero(seen)
        sigma = motion.sigma_xyz_mm[seen, k]
        self.values["xyz_mm"][at, m] = motion.xyz_mm[seen, k]
        self.values["sigma_xyz_mm"][at, m] = sigma
        self.values["covariance_mm2"][at, m] = np.einsum("ni,ij->nij", sigma**2, np.eye(3))
        self.values["rotation_rad"][at, m] = motion.rotation_rad[seen, k]
        self.values["sigma_rotation_rad"][at, m] = motion.sigma_rotation_rad[seen, k]
        self.values["epipolar_px"][at, m] = self.frames.epipolar_px[near[seen], m]
        told = np.where(finite | (state > State.FLAGGED), state, int(State.HIDDEN))
        self.state[self.first :, m] = told

    def put_samples(self, m: int) -> None:
        """The marker's own samples inside the fit, each in the row nearest to its instant."""
        own = self.frames.sample_t_s[self.inside, m]
        at = self.first + _nearest(self.grid, own)
        for name, values in self.values.items():
            values[at, m] = getattr(self.frames, name)[self.inside, m]
        self.sample_t_s[at, m] = own
        self.state[at, m] = self.frames.state[self.inside, m]

    def trajectory(self, fits: tuple[ContinuousFit, ...]) -> Trajectory:
        """All rows in the order of time."""
        o = self.order
        return Trajectory(
            t_s=self.t_s[o],
            ids=self.frames.ids,
            sample_t_s=self.sample_t_s[o],
            state=self.state[o],
            frame=self.frames.frame,
            method="continuous",
            fits=fits,
            **{name: values[o] for name, values in self.values.items()},
        )


def _nearest(times: Floats, wanted: Floats) -> Ints:
    """Index of the nearest of increasing times for each wanted one."""
    after = np.clip(np.searchsorted(times, wanted), 1, times.size - 1)
    before = wanted - times[after - 1] < times[after] - wanted
    return np.asarray(np.where(before, after - 1, after), dtype=np.int64)


def stored_fit(fit: MotionFit, marker: MarkerMotion) -> ContinuousFit:
    """One marker's motion as the exports take it."""
    h, b = len(marker.cosine), marker.sway.size
    first = fit.first_knot_s + fit.shift_s
    cosine = np.concatenate([b + 12 * k + np.arange(6) for k in range(h)])
    rows = np.concatenate([[b + 12 * h], cosine, cosine + 6])
    return ContinuousFit(
        id=marker.id,
        f_hz=fit.f_hz,
        knots_s=np.asarray(first + fit.knot_s * np.arange(len(marker.sway), dtype=np.float64)),
        sway=marker.sway.T,
        cosine=marker.cosine,
        sine=marker.sine,
        covariance=marker.covariance[np.ix_(rows, rows)],
        t_ref_s=fit.mid_s + fit.shift_s,
        chi2=fit.chi2,
        candidates_hz=tuple(fit.branches.f_hz.tolist()),
        evidence=tuple(fit.branches.evidence.tolist()),
    )
