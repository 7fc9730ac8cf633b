"""Calibration from recordings of a board: find, solve, test on unused frames, record."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.boards import Board
from olivevib.calibration.calibrate import calibrate
from olivevib.calibration.result import Calibration
from olivevib.calibration.settings import CalibrationSettings, Shutter
from olivevib.calibration.uncertainty import point_sigma
from olivevib.errors import InputError
from olivevib.geometry import StereoRig
from olivevib.pipeline.boards import BoardRecording, board_reader, find_boards, trial_board
from olivevib.pipeline.recordings import SIDES, check_sizes
from olivevib.progress import Tick
from olivevib.trial import Trial
from olivevib.trial.records.calibration import CalibrationRecord

BOARD_SHARE = 0.15  # a waved board that knows a row time no better tells none
BOARD_FLOOR = 1e-3  # of a row time: what the solve leaves beyond its own sigma, on a rendered board
FEW_VIEWS = 3  # a camera that shows the board less often is diagnosed


def calibrate_board(trial: Trial, tick: Tick) -> tuple[StereoRig, CalibrationRecord]:
    """The rig and the record of its calibration; InputError says what was tried where it fails."""
    board = trial_board(trial)
    recordings = find_boards(trial, board, tick)
    check_sizes({side: recordings[side].size_px for side in SIDES})
    for side in SIDES:
        if len(recordings[side].views) < FEW_VIEWS:
            raise _not_found(trial, board, recordings[side])
    left, right = recordings["left"], recordings["right"]
    if trial.settings.calibration.paper:
        from olivevib.calibration.paper import calibrate_paper as verb
    else:
        verb = calibrate
    result = verb(left.views, right.views, left.size_px, right.size_px, _settings(trial), tick)
    return _with_row_times(result), _record(board, recordings, result)


def _with_row_times(result: Calibration) -> StereoRig:
    """The rig with the row times that the waved board showed, where it shows them well enough."""
    cameras = []
    for camera, value, sigma in zip(
        (result.rig.left, result.rig.right), result.row_time_s, result.row_time_sigma_s, strict=True
    ):
        known = camera.row_time_source == "unknown" and sigma < BOARD_SHARE * abs(value)
        timed = replace(
            camera,
            row_time_s=float(value),
            row_time_sigma_s=float(np.hypot(sigma, BOARD_FLOOR * value)),
            row_time_source="board",
        )
        cameras.append(timed if known else camera)
    return replace(result.rig, left=cameras[0], right=cameras[1])


def _settings(trial: Trial) -> CalibrationSettings:
    """What trial.toml says of the shutters; everything else is the method's own."""
    shutters = {}
    for side in SIDES:
        row_time, _, source = trial.settings.cameras.row_time_s(side)
        shutters[side] = Shutter(row_time_s=row_time, source=source)
    return CalibrationSettings(left_shutter=shutters["left"], right_shutter=shutters["right"])


def _not_found(trial: Trial, board: Board, recording: BoardRecording) -> InputError:
    """Why the board was not found, as far as a look at some frames can tell."""
    from olivevib.calibration.diagnosis import diagnose

    finding = diagnose(board, recording.sample, board_reader(trial, board))
    count = len(recording.views)
    return InputError(
        f"the {recording.side} board recording, {recording.path}, shows the {board.name} in "
        f"{count} of {recording.frames} frames.",
        finding.text,
        finding.remedy.replace("--board ", "--set calibration.board="),
    )


def _record(
    board: Board, recordings: dict[str, BoardRecording], result: Calibration
) -> CalibrationRecord:
    holdout = result.holdout
    nan = float("nan")
    return CalibrationRecord(
        source="board",
        board=board.spec,
        right_offset_s=result.right_offset_s,
        right_offset_sigma_s=result.right_offset_sigma_s,
        reference_row=result.reference_row,
        rms_left_px=result.rms_left_px,
        rms_right_px=result.rms_right_px,
        epipolar_rms_px=result.epipolar_rms_px,
        holdout_rms_mm=holdout.rms_mm if holdout else nan,
        holdout_rms_percent=holdout.rms_percent if holdout else nan,
        verdict=result.verdict,
        residuals_left=_residuals(result, 0),
        residuals_right=_residuals(result, 1),
        holdout_mm=_distances(result),
        board_poses=_poses(board, result),
        facts=_facts(recordings, result),
        dropped_views=tuple(
            f"{v.camera} frame {v.frame}: {v.reason}" for v in result.views if not v.used
        ),
        cautions=(*recordings["left"].cautions, *recordings["right"].cautions, *result.cautions),
    )


def _residuals(result: Calibration, camera: int) -> Floats:
    """Pixel and residual (K, 4) of every point of one camera that was used."""
    r = result.residuals
    mine = (r.camera == camera) & (r.weight > 0)
    return np.hstack([r.px[mine], r.residual_px[mine]])


def _poses(board: Board, result: Calibration) -> Floats:
    """Frame, sigma of the direction rad, R and t of the board where both cameras saw it (V, 14)."""
    poses = result.poses
    points = board.points_mm
    spread = float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))
    rows = []
    for k in np.flatnonzero(poses.both):
        middle = (poses.R[k] @ points.mean(axis=0) + poses.t_mm[k])[None]
        depth = point_sigma(result.rig, middle, result.point_sigma_px).frame_mm[0, 2]
        sigma = depth / (spread * np.sqrt(len(points)))
        rows.append([poses.frame[k], sigma, *poses.R[k].ravel(), *poses.t_mm[k]])
    return np.array(rows, dtype=np.float64).reshape(-1, 14)


def _distances(result: Calibration) -> Floats:
    """True distance and error (D, 2) of every pair on unused frames, mm."""
    holdout = result.holdout
    if holdout is None:
        return np.empty((0, 2))
    share = holdout.errors_percent / 100
    good = share != 0
    return np.column_stack([holdout.errors_mm[good] / share[good], holdout.errors_mm[good]])


def _facts(recordings: dict[str, BoardRecording], result: Calibration) -> dict[str, Any]:
    """Further numbers for the report, unit in the name; None where not known."""
    facts: dict[str, Any] = {
        "method": result.method,
        "common_frames": result.common_frames,
        "views_chosen": result.choice or None,
    }
    for side in SIDES:
        facts[f"{side}_frames"] = recordings[side].frames
        facts[f"{side}_views"] = len(recordings[side].views)
    if result.holdout:
        h = result.holdout
        facts |= {
            "holdout_frames": h.frames,
            "holdout_pairs": h.pairs,
            "holdout_usable": h.usable,
            "holdout_median_percent": h.median_percent,
            "holdout_bias_percent": h.bias_percent,
            "holdout_bias_mm": h.bias_mm,
            "holdout_depth_rms_mm": h.z_rms_mm,
            "holdout_reprojection_rms_px": h.reprojection_rms_px,
            "holdout_rms_z": h.rms_z,
            "holdout_method": h.method,
        }
    facts |= {
        "point_sigma_px": [float(v) for v in result.point_sigma_px],
        "board_distance_mm": float(np.median(result.left_coverage.distance_mm)),
        "jitter_s": result.jitter_s,
        "bow_mm": result.bow_mm.tolist(),
        "bow_sigma_mm": result.bow_sigma_mm.tolist(),
        "halves": [asdict(half) for half in result.halves],
    }
    return {name: _plain(value) for name, value in facts.items()}


def _plain(value: Any) -> Any:
    """A value that JSON can hold; None for what is not a number."""
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, list):
        return [_plain(v) for v in value]
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return value
