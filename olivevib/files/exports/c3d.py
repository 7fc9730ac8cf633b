"""C3D: marker positions a frame for biomechanics programs, through the optional library ezc3d."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np

from olivevib.errors import UsageError
from olivevib.files.exports.even import even_part
from olivevib.files.exports.facts import ExportFacts, marker_paths
from olivevib.files.exports.text import ascii_line
from olivevib.reconstruction.trajectory import Trajectory


def write_c3d(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write C3D in mm, float32 (1e-4 mm at 2 m); a gap is NaN with residual -1.

    C3D has one rate for all rows and no times: it gets the even part of the path (``even_part``),
    the time of its first row on the trial clock in the parameter OLIVEVIB:START_S. Raises
    UsageError where ezc3d is not installed or the rows have no one rate.
    """
    try:
        import ezc3d
    except ImportError as error:
        raise UsageError(
            "--to c3d needs the optional library ezc3d, which is not installed.",
            "",
            "Install it (pip install 'olivevib[c3d]'), or export trc.",
        ) from error
    even = even_part(trajectory)
    paths = list(marker_paths(even.trajectory))
    points = np.ones((4, len(paths), even.trajectory.t_s.size))
    residuals = np.zeros((1, len(paths), even.trajectory.t_s.size))
    for k, path in enumerate(paths):
        points[:3, k] = np.where(path.seen[:, None], path.xyz_mm, np.nan).T
        residuals[0, k] = np.where(path.seen, 0.0, -1.0)
    document = ezc3d.c3d()
    parameters = document["parameters"]["POINT"]
    parameters["UNITS"]["value"] = ["mm"]
    parameters["RATE"]["value"] = [even.rate_hz]
    parameters["LABELS"]["value"] = tuple(f"M{path.id}" for path in paths)
    document.add_parameter("OLIVEVIB", "START_S", [even.start_s])
    document.add_parameter("OLIVEVIB", "TRIAL", [ascii_line(facts.trial, 120) or "NONE"])
    document.add_parameter("OLIVEVIB", "AXES", [ascii_line(trajectory.frame, 120)])
    document.add_parameter("OLIVEVIB", "WORDS", [ascii_line(even.words, 250)])
    document["data"]["points"] = points
    document["data"]["meta_points"]["residuals"] = residuals
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "paths.c3d"
        document.write(str(file))
        out.write(file.read_bytes())
