"""The map of expected sigma of a trial's rig: as a command prints it and the report draws it."""

from __future__ import annotations

import numpy as np

from olivevib.calibration.sigma_map import SigmaMap, sigma_map
from olivevib.errors import InputError
from olivevib.trial import Trial

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
