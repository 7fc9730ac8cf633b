"""calibration.h5: what the calibration says of itself; the rig itself stands in rig.toml."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from olivevib.arrays import Floats, floats
from olivevib.errors import Caution
from olivevib.files.store import StageFile, Variable
from olivevib.trial.records.cautions import cautions_from, cautions_text
from olivevib.trial.stages import BY_NAME, Fingerprint

STAGE = BY_NAME["calibrate"]
NONE_4, NONE_2, NONE_14 = np.empty((0, 4)), np.empty((0, 2)), np.empty((0, 14))
NUMBERS = (
    "right_offset_s",
    "right_offset_sigma_s",
    "reference_row",
    "rms_left_px",
    "rms_right_px",
    "epipolar_rms_px",
    "holdout_rms_mm",
    "holdout_rms_percent",
)


@dataclass(frozen=True)
class CalibrationRecord:
    """Source ("board" or "rig file"), hold-out numbers, lag, residuals; NaN where not known.

    residuals_left, residuals_right (K, 4): pixel u, v of each board point and its residual du, dv.
    holdout_mm (D, 2): true distance and error of each pair of points on unused frames, mm.
    board_poses (V, 14): where the board was in frames that both cameras saw: frame, sigma of its
    direction rad, R (3, 3) row by row and t mm to the left camera.
    facts: further numbers and words by name, unit in the name. views: one line a dropped view.
    """

    source: str
    board: str
    right_offset_s: float = float("nan")
    right_offset_sigma_s: float = float("nan")
    reference_row: float = 0.0
    rms_left_px: float = float("nan")
    rms_right_px: float = float("nan")
    epipolar_rms_px: float = float("nan")
    holdout_rms_mm: float = float("nan")
    holdout_rms_percent: float = float("nan")
    verdict: str = ""
    residuals_left: Floats = field(default_factory=lambda: NONE_4)
    residuals_right: Floats = field(default_factory=lambda: NONE_4)
    holdout_mm: Floats = field(default_factory=lambda: NONE_2)
    board_poses: Floats = field(default_factory=lambda: NONE_14)
    facts: Mapping[str, Any] = field(default_factory=dict)
    dropped_views: tuple[str, ...] = ()
    cautions: tuple[Caution, ...] = ()

    def __post_init__(self) -> None:
        for name in ("residuals_left", "residuals_right"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (None, 4)))
        object.__setattr__(self, "holdout_mm", floats("holdout_mm", self.holdout_mm, (None, 2)))
        poses = floats("board_poses", self.board_poses, (None, 14), nan=True)
        object.__setattr__(self, "board_poses", poses)


def calibration_file(record: CalibrationRecord, now: Fingerprint) -> StageFile:
    """The stage file of a calibration."""
    columns = {"left": record.residuals_left, "right": record.residuals_right}
    variables = {
        f"{side}/residual": Variable(
            ("point", "u_v_du_dv"), values, "px", "board point u, v and its residual du, dv"
        )
        for side, values in columns.items()
    }
    variables["holdout/distance"] = Variable(
        ("pair", "true_and_error"), record.holdout_mm, "mm", "distances on unused frames"
    )
    variables["board/pose"] = Variable(
        ("view", "frame_sigma_R_t"), record.board_poses, "1", "board in the left camera's frame"
    )
    return StageFile(
        stage=STAGE.name,
        schema=STAGE.schema,
        settings=dict(now.settings),
        inputs=dict(now.inputs),
        variables=variables,
        attributes={name: float(getattr(record, name)) for name in NUMBERS}
        | {
            "source": record.source,
            "board": record.board,
            "verdict": record.verdict,
            "facts": json.dumps(dict(record.facts), ensure_ascii=False),
            "dropped_views": json.dumps(record.dropped_views, ensure_ascii=False),
            "cautions": cautions_text(record.cautions),
        },
    )


def calibration_from(file: StageFile) -> CalibrationRecord:
    """The calibration of a stage file."""
    get = file.attributes
    return CalibrationRecord(
        source=str(get["source"]),
        board=str(get["board"]),
        verdict=str(get["verdict"]),
        residuals_left=np.asarray(file.variables["left/residual"].values),
        residuals_right=np.asarray(file.variables["right/residual"].values),
        holdout_mm=np.asarray(file.variables["holdout/distance"].values),
        board_poses=(
            np.asarray(file.variables["board/pose"].values)
            if "board/pose" in file.variables
            else NONE_14
        ),
        facts=json.loads(str(get["facts"])),
        dropped_views=tuple(json.loads(str(get["dropped_views"]))),
        cautions=cautions_from(get["cautions"]),
        **{name: float(get[name]) for name in NUMBERS},
    )
