"""comparison.h5: each marker against its sensor, with the overlay on the trial clock."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, fields

import numpy as np

from olivevib.comparison import Comparison, LineDifference, Verdict
from olivevib.errors import Caution
from olivevib.files.store import StageFile, Variable
from olivevib.trial.records.cautions import cautions_from, cautions_text
from olivevib.trial.stages import BY_NAME, Fingerprint

STAGE = BY_NAME["compare"]
ARRAYS = ("R_camera_sensor", "overlay_t_s", "optical_mm", "sensor_mm")
XYZ = "displacement in the trajectory's frame"


def comparison_file(
    results: Sequence[Comparison], cautions: Sequence[Caution], now: Fingerprint
) -> StageFile:
    """The stage file of all comparisons of a trial, one group a sensor."""
    variables: dict[str, Variable] = {}
    scalars = []
    for k, result in enumerate(results):
        txa = ("time", "axis")
        group = {
            "time": Variable(("time",), result.overlay_t_s, "s", "trial clock"),
            "optical": Variable(txa, result.optical_mm, "mm", f"camera: {XYZ}"),
            "sensor": Variable(txa, result.sensor_mm, "mm", f"sensor: {XYZ}"),
            "R_camera_sensor": Variable(
                ("axis", "sensor_axis"), result.R_camera_sensor, "1", "turns sensor to camera"
            ),
        }
        variables |= {f"sensor{k}/{name}": variable for name, variable in group.items()}
        scalars.append(_scalars(result))
    return StageFile(
        stage=STAGE.name,
        schema=STAGE.schema,
        settings=dict(now.settings),
        inputs=dict(now.inputs),
        variables=variables,
        attributes={"results": json.dumps(scalars), "cautions": cautions_text(cautions)},
    )


def _scalars(result: Comparison) -> dict[str, object]:
    plain = {f.name: getattr(result, f.name) for f in fields(result) if f.name not in ARRAYS}
    return plain | {
        "lines": [asdict(line) for line in result.lines],
        "verdict": result.verdict.value,
    }


def comparisons_from(file: StageFile) -> tuple[tuple[Comparison, ...], tuple[Caution, ...]]:
    """The comparisons of a stage file, and its cautions."""
    rows = json.loads(str(file.attributes["results"]))
    results = []
    for k, row in enumerate(rows):
        get = {
            name: np.asarray(file.variables[f"sensor{k}/{name}"].values)
            for name in ("time", "optical", "sensor", "R_camera_sensor")
        }
        row["lines"] = tuple(LineDifference(**line) for line in row["lines"])
        row["verdict"] = Verdict(row["verdict"])
        results.append(
            Comparison(
                **row,
                R_camera_sensor=get["R_camera_sensor"],
                overlay_t_s=get["time"],
                optical_mm=get["optical"],
                sensor_mm=get["sensor"],
            )
        )
    return tuple(results), cautions_from(file.attributes["cautions"])
