"""Tracks of both cameras to the 3-D trajectory of every marker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from olivevib.arrays import Floats, Ints
from olivevib.errors import Caution
from olivevib.geometry import StereoRig
from olivevib.progress import Tick, silent
from olivevib.reconstruction.clock import TrialClock
from olivevib.reconstruction.motion.types import MotionFit
from olivevib.reconstruction.pairing import View, as_seen, at_times, same_count
from olivevib.reconstruction.pose import rotations
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.reconstruction.triangulation import Points, linear_eigen, triangulate
from olivevib.signals import State
from olivevib.tracking import Track

EPIPOLAR_LIMIT_PX = 1.0  # rms beyond which the rig, the focus or the clock is in doubt
OUTLIER_Z = 6.0  # a sample this far from epipolar consistency is flagged


@dataclass(frozen=True)
class ReconstructionSettings:
    """paper: the paper's synchronous Linear-Eigen triangulation of equal frame counts.

    right_offset_ms: what to add to the right camera's stamps, ms, where it is known (empty: use the
    calibration's where both are one recording, else zero and said so).
    frame: of the results: the left camera's, the calibration board's (board_frame: where it lay in
    that frame of its recording; empty: in the view with the smallest sigma), or gravity's: x to the
    right of the left camera, y away from it, z up. plumb: ids of two markers on a plumb line, the
    upper one first; empty: gravity from the accelerometer at rest.
    """

    paper: bool = False
    right_offset_ms: float | None = None
    frame: Literal["left camera", "board", "gravity"] = "left camera"
    board_frame: int | None = None
    plumb: tuple[int, int] | None = None


@dataclass(frozen=True)
class Reconstruction:
    """The trajectory, the clock it stands on, and what its sigmas were scaled by.

    sigma_scale: factor (>= 1) on all sigmas, the rms epipolar residual in units of its sigma.
    epipolar_rms_px: over all samples; NaN without samples. motion: the continuous-time fit, where
    one was made, whether it could decide or not.
    """

    trajectory: Trajectory
    clock: TrialClock
    sigma_scale: float
    epipolar_rms_px: float
    cautions: tuple[Caution, ...] = field(default=())
    motion: MotionFit | None = None


def reconstruct(
    left: Sequence[Track],
    right: Sequence[Track],
    rig: StereoRig,
    clock: TrialClock,
    corners_mm: Mapping[int, Floats],
    settings: ReconstructionSettings | None = None,
    tick: Tick = silent,
) -> Reconstruction:
    """Triangulate every marker that both cameras tracked, at the left camera's instants.

    corners_mm: for each id the corners (4, 3) in the marker's frame. The right track is evaluated
    at the left's times on the trial clock. Markers of one camera only keep their states, as NaN.
    """
    settings = settings or ReconstructionSettings()
    by_left, by_right = ({t.id: t for t in tracks} for tracks in (left, right))
    ids = sorted(set(by_left) | set(by_right))
    some = next(iter(left), None) or next(iter(right), None)
    if some is None:
        raise ValueError("no tracks to reconstruct")
    base = left[0] if left else right[0]
    columns = []
    for k, marker in enumerate(ids):
        tick(k, len(ids), f"marker {marker}")
        pair = (by_left.get(marker), by_right.get(marker))
        columns.append(_marker(pair, base, rig, clock, corners_mm[marker], settings))
    tick(len(ids), len(ids), "triangulated")
    t_s = _row_zero_times(base, clock, rig.left.size_px[1] / 2)
    return _gather(ids, columns, t_s, clock, settings)


@dataclass(frozen=True)
class _Column:
    """One marker's part of the trajectory."""

    sample_t_s: Floats
    points: Points
    rotation: Floats
    rotation_sigma: Floats
    state: Ints


def _marker(
    pair: tuple[Track | None, Track | None],
    base: Track,
    rig: StereoRig,
    clock: TrialClock,
    corners_mm: Floats,
    settings: ReconstructionSettings,
) -> _Column:
    one, two = pair
    n = base.frame.size
    if one is None or two is None:
        only = one or two
        nan = np.full((n, 3), np.nan)
        points = Points(nan, np.full((n, 3, 3), np.nan), nan[:, 0], nan[:, 0])
        unseen = np.full(n, int(State.LOST), np.int64)
        times = only.t_s if only is not None and only.t_s.size == n else base.t_s
        return _Column(times, points, nan, nan, unseen)
    a = as_seen(one)
    if settings.paper:
        b = same_count(two, one.frame)
    else:
        b = at_times(two, clock.right_times(two.t_s), one.t_s)
    points = triangulate(rig, a.centre_px, a.centre_cov_px2, b.centre_px, b.centre_cov_px2)
    if settings.paper:
        xyz = linear_eigen(rig, a.centre_px, b.centre_px)
        points = Points(xyz, points.covariance_mm2, points.epipolar_px, points.epipolar_z)
    turn, turn_sigma = rotations(
        rig, corners_mm, (a.corners_px, a.corners_cov_px2), (b.corners_px, b.corners_cov_px2)
    )
    return _Column(one.t_s, points, turn, turn_sigma, _joint_state(a, b, points))


def _joint_state(a: View, b: View, points: Points) -> Ints:
    """The state of the pair: seen where both saw, else the reason of the camera that did not."""
    worse = np.where(a.state > State.FLAGGED, a.state, b.state)
    flagged = (a.state == State.FLAGGED) | (b.state == State.FLAGGED)
    found = np.isfinite(points.xyz_mm[:, 0])
    state = np.where(found, np.where(flagged, int(State.FLAGGED), int(State.SEEN)), worse)
    return np.where(~found & (state <= State.FLAGGED), int(State.LOST), state).astype(np.int64)


def _gather(
    ids: list[int],
    columns: list[_Column],
    t_s: Floats,
    clock: TrialClock,
    settings: ReconstructionSettings,
) -> Reconstruction:
    z = np.stack([c.points.epipolar_z for c in columns], axis=1)
    scale = _scale(z)
    epipolar = np.stack([c.points.epipolar_px for c in columns], axis=1)
    state = np.stack([c.state for c in columns], axis=1)
    state = np.where((np.abs(z) > OUTLIER_Z * scale) & (state == State.SEEN), 1, state)
    covariance = np.stack([c.points.covariance_mm2 for c in columns], axis=1) * scale**2
    rms = _rms(epipolar)
    trajectory = Trajectory(
        t_s=t_s,
        ids=np.array(ids, dtype=np.int64),
        sample_t_s=np.stack([c.sample_t_s for c in columns], axis=1),
        xyz_mm=np.stack([c.points.xyz_mm for c in columns], axis=1),
        sigma_xyz_mm=np.sqrt(np.einsum("nmii->nmi", covariance)),
        covariance_mm2=covariance,
        rotation_rad=np.stack([c.rotation for c in columns], axis=1),
        sigma_rotation_rad=np.stack([c.rotation_sigma for c in columns], axis=1) * scale,
        state=state.astype(np.int64),
        epipolar_px=epipolar,
        frame="left camera",
        method="linear-eigen" if settings.paper else "optimal",
    )
    return Reconstruction(trajectory, clock, scale, rms, _cautions(rms, clock, trajectory))


def _row_zero_times(base: Track, clock: TrialClock, middle_row: float) -> Floats:
    """When row 0 of each left frame was taken.

    Track.t_s is at the marker's own row, and at the middle row where it was not seen.
    """
    rows = np.where(np.isfinite(base.raw_row), base.raw_row, middle_row)
    out: Floats = base.t_s - clock.left_row_time_s * rows
    return out


def _scale(z: Floats) -> float:
    """Robust rms of the epipolar residuals in sigmas, never below 1."""
    values = np.abs(z[np.isfinite(z)])
    return max(1.0, 1.4826 * float(np.median(values))) if values.size else 1.0


def _rms(values: Floats) -> float:
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if good.size else float("nan")


def _cautions(rms: float, clock: TrialClock, trajectory: Trajectory) -> tuple[Caution, ...]:
    out = []
    if clock.source == "unknown":
        out.append(
            Caution(
                "offset-unknown",
                "The time offset between the cameras is not known and was taken as zero; no sigma "
                "includes what that may cost while a marker moves (at 25 Hz and 3 mm each "
                "millisecond out of step is about 1.5 mm of false depth).",
                "Use one recording for board and trial, or state reconstruction.right_offset_ms.",
            )
        )
    if rms > EPIPOLAR_LIMIT_PX:
        out.append(
            Caution(
                "epipolar-residual",
                f"The two images of the markers disagree by {rms:.2f} px rms across the epipolar "
                "lines.",
                "Check that neither tripod was bumped nor focus changed since the calibration, "
                "and that the cameras are in step.",
            )
        )
    if not trajectory.seen.any():
        out.append(
            Caution(
                "no-common-markers",
                "No marker was seen by both cameras at the same time.",
                "Check the marker library and ids, and that both cameras show the markers.",
            )
        )
    return tuple(out)
