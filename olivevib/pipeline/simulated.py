"""Simulated trials: recorded by the simulator, made into trials as a technician would."""

from __future__ import annotations

import shutil
from pathlib import Path

from olivevib.errors import UsageError
from olivevib.files.trial_folders import FILE
from olivevib.pipeline.new import NewTrial, new_trial
from olivevib.progress import Tick, silent
from olivevib.simulation import SimulatedTrial, scenario, simulate
from olivevib.trial import Trial
from olivevib.trial.workspace import named


def truth_folder(folder: Path) -> Path:
    """Where the truth of a simulated trial stands: beside it, where no stage looks."""
    return folder.with_name(f"{folder.name}-truth")


def simulated_trial(
    folder: Path, name: str, seed: int = 1, tick: Tick = silent, seconds: float | None = None
) -> Trial:
    """Record a named scenario into a new trial folder; its truth goes to FOLDER-truth.

    The trial holds what a technician would have and nothing else; it is labelled simulated.
    UsageError for an unknown scenario or a folder that is a trial already.
    """
    folder = named(folder)
    if (folder / FILE).exists():
        raise UsageError(
            f"{folder} is a trial already.", "", "Choose another folder, or remove it yourself."
        )
    chosen = scenario(name) if seconds is None else scenario(name).lasting(seconds)
    work = folder.with_name(f".{folder.name}.simulating")
    shutil.rmtree(work, ignore_errors=True)
    try:
        recorded = simulate(work, chosen, seed, tick)
        trial = new_trial(folder, plan_of(recorded), tick)
        truth = truth_folder(folder)
        shutil.rmtree(truth, ignore_errors=True)
        recorded.truth.rename(truth)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return trial


def plan_of(recorded: SimulatedTrial) -> NewTrial:
    """What the technician would tell ``olivevib new`` of the recordings."""
    return NewTrial(
        left=str(recorded.left),
        right=str(recorded.right),
        calibration_left=str(recorded.calibration_left),
        calibration_right=str(recorded.calibration_right),
        board=recorded.board,
        markers=recorded.markers,
        size_mm=recorded.size_mm,
        ids=recorded.ids,
        shutter=recorded.shutter,
        row_time_us=recorded.row_time_us or (None, None),
        band_hz=recorded.band_hz,
        accelerometer=str(recorded.accelerometer) if recorded.accelerometer else None,
        accelerometer_marker=recorded.accelerometer_marker,
        exposure_ms=recorded.exposure_ms,
        simulated=True,
        places=recorded.places,
        sizes_mm=recorded.sizes_mm,
    )
