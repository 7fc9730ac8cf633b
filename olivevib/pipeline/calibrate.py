"""Stage ``calibrate``: both board recordings, or an earlier rig, to rig.toml and calibration.h5."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from olivevib.errors import Caution
from olivevib.files.rig_file import read_rig, write_rig
from olivevib.files.store import write_stage
from olivevib.geometry import CameraModel, StereoRig
from olivevib.progress import Tick, silent
from olivevib.trial import Trial
from olivevib.trial.fingerprints import RIG
from olivevib.trial.records.calibration import CalibrationRecord, calibration_file
from olivevib.trial.stages import Fingerprint


def calibrate(trial: Trial, tick: Tick = silent) -> tuple[Caution, ...]:
    """Calibrate the pair from the board recordings, or take over the rig that trial.toml names.

    Raises InputError where the board is not found or too few views are common: it says what was
    tried and what to do.
    """
    now = trial.fingerprint("calibrate")
    if trial.settings.calibration.rig:
        return _take_over(trial, now)
    from olivevib.pipeline.calibrate_board import calibrate_board

    rig, record = calibrate_board(trial, tick)
    _write(trial, rig, record, now)
    return record.cautions


def _take_over(trial: Trial, now: Fingerprint) -> tuple[Caution, ...]:
    name = str(trial.settings.calibration.rig)
    rig = read_rig(trial.path(name))
    record = CalibrationRecord("rig file", "", verdict=f"taken over from {name}; not tested here")
    _write(trial, rig, record, now)
    return ()


def _write(trial: Trial, rig: StereoRig, record: CalibrationRecord, now: Fingerprint) -> None:
    """rig.toml first, calibration.h5 last: the stage is done once both are there."""
    rig = replace(
        rig, left=_timed(trial, rig.left, "left"), right=_timed(trial, rig.right, "right")
    )
    write_rig(trial.folder / RIG, rig, _facts(record))
    write_stage(trial.folder / "calibration.h5", calibration_file(record, now))


def _timed(trial: Trial, camera: CameraModel, side: str) -> CameraModel:
    """The camera with the row time that trial.toml declares, where it declares one."""
    row_time, sigma, source = trial.settings.cameras.row_time_s(side)
    if source == "unknown":
        return camera
    return replace(camera, row_time_s=row_time, row_time_sigma_s=sigma, row_time_source=source)


def _facts(record: CalibrationRecord) -> dict[str, str | float | int | None]:
    """What rig.toml tells a person of the quality."""
    numbers = {
        name: float(getattr(record, name))
        for name in (
            "rms_left_px",
            "rms_right_px",
            "epipolar_rms_px",
            "holdout_rms_mm",
            "holdout_rms_percent",
        )
    }
    words: dict[str, str | float | int | None] = {
        "source": record.source,
        "board": record.board or None,
        "verdict": record.verdict or None,
    }
    return words | {name: value for name, value in numbers.items() if np.isfinite(value)}
