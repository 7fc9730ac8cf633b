"""A rig at work in a trial: whether it still holds, and in which frame its results are given."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.trust import Trust, both_seen, judge_rig, sides_mm
from olivevib.errors import InputError, UsageError
from olivevib.geometry import StereoRig
from olivevib.pipeline.compare import compare_sensor, sensor_record
from olivevib.pipeline.motions import marker_motion
from olivevib.progress import Tick, silent
from olivevib.reconstruction import Reconstruction
from olivevib.reconstruction.pairing import as_seen, same_count
from olivevib.reconstruction.world import World, board_world, gravity_world, plumb_up
from olivevib.trial import Trial
from olivevib.trial.records.tracks import StoredTracks

LEAST_FRAMES = 5  # in which both cameras saw a marker, for its mean to count
LARGEST_TURN_DEG = 5.0  # sigma of an accelerometer's axes beyond which it is no plumb line
NEXT = "Name two markers on a plumb line instead: --set reconstruction.plumb=UPPER,LOWER."


def rig_trust(
    tracks: StoredTracks, rig: StereoRig, corners_mm: Mapping[int, Floats]
) -> Trust | None:
    """The rig against the mean images of the trial's own markers; None where none is shared."""
    right = {track.id: track for track in tracks.right}
    left_px, right_px, true = [], [], []
    for track in tracks.left:
        if track.id not in right:
            continue
        a, b = as_seen(track).corners_px, same_count(right[track.id], track.frame).corners_px
        ok = both_seen(a, b)
        if ok.sum() >= LEAST_FRAMES:
            left_px.append(a[ok].mean(axis=0))
            right_px.append(b[ok].mean(axis=0))
            true.append(sides_mm(corners_mm[track.id]))
    if not left_px:
        return None
    return judge_rig(rig, np.array(left_px), np.array(right_px), np.array(true))


def chosen_world(trial: Trial, result: Reconstruction, tick: Tick = silent) -> World | None:
    """The frame that reconstruction.frame asks for; None for the left camera's."""
    frame = trial.settings.reconstruction.frame
    if frame == "board":
        return _board(trial)
    if frame == "gravity":
        plumb = trial.settings.reconstruction.plumb
        return _plumb(result, plumb) if plumb else _rest(trial, result, tick)
    return None


def _board(trial: Trial) -> World:
    record = trial.calibration
    poses = None if record is None else record.board_poses
    if poses is None or not len(poses):
        raise InputError(
            "The board's place is not known.",
            "calibration.h5 holds none: the rig was taken over from a file, or is of an older "
            "version.",
            "Calibrate from board recordings, or choose --set reconstruction.frame=gravity.",
        )
    wanted = trial.settings.reconstruction.board_frame
    frames = poses[:, 0].astype(np.int64)
    if wanted is not None and wanted not in frames:
        known = ", ".join(str(f) for f in frames[:20])
        raise UsageError(
            f"The board was not measured in frame {wanted} of its recording.",
            f"Both cameras saw it in the frames {known}{', ...' if len(frames) > 20 else ''}.",
            "Name one of them: --set reconstruction.board_frame=N.",
        )
    row = int(poses[:, 1].argmin()) if wanted is None else int(np.flatnonzero(frames == wanted)[0])
    R, t = poses[row, 2:11].reshape(3, 3), poses[row, 11:14]
    return board_world(R, t, float(poses[row, 1]), f"the board in frame {frames[row]}")


def _plumb(result: Reconstruction, plumb: tuple[int, int]) -> World:
    try:
        up, sigma = plumb_up(result.trajectory, *plumb)
    except (ValueError, IndexError) as error:
        raise InputError(
            f"The plumb line of markers {plumb[0]} and {plumb[1]} was not seen.",
            "Both markers must be tracked and seen at the same time.",
            "Correct reconstruction.plumb in trial.toml: the upper marker first.",
        ) from error
    return gravity_world(up, sigma, f"the plumb line from marker {plumb[0]} to {plumb[1]}")


def _rest(trial: Trial, result: Reconstruction, tick: Tick) -> World:
    """The vertical from the first accelerometer that was at rest and whose axes are known."""
    why = "No accelerometer is bound to a marker."
    for sensor in (a for a in trial.settings.accelerometers if a.marker is not None):
        record = sensor_record(trial, sensor)
        if not record.rest_found or len(record.gravity_m_s2) != 3:
            why = f"{sensor.file} was never at rest on three axes."
            continue
        motion, _ = marker_motion(trial, result.trajectory)
        found = compare_sensor(trial, result.trajectory, motion, (sensor, record), tick)
        sigma = found.rotation_sigma_deg
        if not np.isfinite(found.R_camera_sensor).all() or not sigma < LARGEST_TURN_DEG:
            why = f"The axes of {sensor.file} are not known well enough in the cameras' frame."
            continue
        up = found.R_camera_sensor @ record.gravity_m_s2
        return gravity_world(up, float(np.radians(sigma)), f"{sensor.file} at rest")
    raise InputError("The vertical is not known.", why, NEXT)
