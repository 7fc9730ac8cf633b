"""C3D: marker positions a frame for biomechanics programs, through the optional library ezc3d."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np

from olivevib.errors import UsageError
from olivevib.files.exports.facts import ExportFacts, frame_rate_hz, marker_paths
from olivevib.reconstruction.trajectory import Trajectory


def write_c3d(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write C3D in mm, float32 (1e-4 mm at 2 m); a gap is NaN with residual -1.

    C3D has one time a frame and an even rate: the frame's, as in TRC. Raises UsageError where
    ezc3d is not installed.
    """
    try:
        import ezc3d
    except ImportError as error:
        raise UsageError(
            "--to c3d needs the optional library ezc3d, which is not installed.",
            "",
            "Install it (pip install 'olivevib[c3d]'), or export trc.",
        ) from error
    del facts
    paths = list(marker_paths(trajectory))
    points = np.ones((4, len(paths), trajectory.t_s.size))
    residuals = np.zeros((1, len(paths), trajectory.t_s.size))
    for k, path in enumerate(paths):
        points[:3, k] = np.where(path.seen[:, None], path.xyz_mm, np.nan).T
        residuals[0, k] = np.where(path.seen, 0.0, -1.0)
    document = ezc3d.c3d()
    parameters = document["parameters"]["POINT"]
    parameters["UNITS"]["value"] = ["mm"]
    parameters["RATE"]["value"] = [frame_rate_hz(trajectory)]
    parameters["LABELS"]["value"] = tuple(f"M{path.id}" for path in paths)
    document["data"]["points"] = points
    document["data"]["meta_points"]["residuals"] = residuals
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "paths.c3d"
        document.write(str(file))
        out.write(file.read_bytes())
