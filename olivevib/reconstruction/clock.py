"""The trial clock: how the two cameras' times meet.

t = 0 is the middle of the exposure of row 0 of the left camera's first frame. A point at raw row v
is seen by the left camera at stamp + v row_time_left, by the right camera at
stamp + offset + reference_row (row_time_left - row_time_right) + v row_time_right, where offset is
what to add to the right stamps so that both cameras agree at ``reference_row``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats


@dataclass(frozen=True)
class TrialClock:
    """Offset between the cameras and the row times, each with its sigma and its source.

    right_offset_s is minus the lag tau of the calibration (tau > 0: the right camera is late).
    source: "declared", "calibration" (the same recording), "slow motion" or "fit" (of the trial
    itself), "unknown" (taken as zero). right_drift: rate error of the right camera's clock, s/s;
    the offset then holds at ``drift_from_s`` of that clock.
    """

    right_offset_s: float = 0.0
    right_offset_sigma_s: float = float("nan")
    reference_row: float = 0.0
    source: str = "unknown"
    left_row_time_s: float = 0.0
    right_row_time_s: float = 0.0
    right_drift: float = 0.0
    drift_from_s: float = 0.0

    def right_times(self, t_s: Floats) -> Floats:
        """Trial times of the right camera's observations from its own clock (``Track.t_s``)."""
        rows = self.reference_row * (self.left_row_time_s - self.right_row_time_s)
        late = self.right_offset_s + rows + self.right_drift * (t_s - self.drift_from_s)
        return np.asarray(t_s + late, dtype=np.float64)
