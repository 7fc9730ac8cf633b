"""The map of expected sigma of a trial's rig: as a command prints it and the report draws it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from olivevib.calibration.sigma_map import SigmaMap, sigma_map
from olivevib.errors import InputError
from olivevib.files.atomic import write_text_atomic
from olivevib.trial import Trial

COLUMNS = (
    *("x_mm", "y_mm", "z_mm", "frame_x_mm", "frame_y_mm", "frame_z_mm"),
    *("rig_x_mm", "rig_y_mm", "rig_z_mm", "length200_mm"),
)
PLAIN_PX = 0.1  # sigma of a marker's centre where the calibration tells none
PLAIN_MM = 1200.0  # middle distance where nothing tells it


def expected_sigma(trial: Trial) -> SigmaMap:
    """Expected sigma over the working volume; InputError where the rig carries no covariance."""
    rig, record = trial.rig, trial.calibration
    if rig is None or record is None:
        raise trial.need("calibrate")
    if rig.covariance is None:
        raise InputError(
            f"rig.toml of trial {trial.name} carries no covariance.",
            "A rig of other software or of the paper's closed form does not say how sure it is.",
            "Calibrate from a board recording: olivevib calibrate.",
        )
    left, right = record.facts.get("point_sigma_px") or (PLAIN_PX, PLAIN_PX)
    distance = record.facts.get("board_distance_mm") or PLAIN_MM
    found = sigma_map(rig, (left or PLAIN_PX, right or PLAIN_PX), distance)
    if not np.size(found.length_mm):
        raise InputError(
            "The two cameras share no view.",
            f"No point about {distance:.0f} mm away lies in both pictures.",
            "Turn the cameras towards each other and calibrate again.",
        )
    return found


def sigma_csv(found: SigmaMap) -> str:
    """The map as CSV, a row a point: place, sigma of a frame, sigma from the rig, of 200 mm."""
    rows = [",".join(COLUMNS)]
    for k in range(len(found.xyz_mm)):
        where = ",".join(f"{v:.0f}" for v in found.xyz_mm[k])
        sigmas = (*found.frame_mm[k], *found.rig_mm[k], found.length_mm[k])
        rows.append(where + "," + ",".join(f"{v:.4f}" for v in sigmas))
    return "\n".join(rows) + "\n"


def write_sigma(trial: Trial, found: SigmaMap) -> Path:
    """Write the map into ``exports/`` of the trial; returns the file."""
    path = trial.folder / "exports" / f"{trial.name}-sigma.csv"
    path.parent.mkdir(exist_ok=True)
    write_text_atomic(path, sigma_csv(found))
    return path
