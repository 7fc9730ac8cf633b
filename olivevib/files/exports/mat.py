"""MAT: one struct a marker, for MATLAB and Octave."""

from __future__ import annotations

import io
from typing import Any, BinaryIO

import numpy as np

from olivevib.files.exports.facts import ExportFacts, MarkerPath, marker_paths
from olivevib.geometry import StereoRig
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import State

_HEADER = b"MATLAB 5.0 MAT-file, written by olivevib"
_HEADER_BYTES = 116


def write_mat(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write a MATLAB 5 file: ``marker_7.t_s, .xyz_mm, .sigma_mm, .state``, ``info``, ``rig``.

    NaN = not seen; state counts into info.state_words from 0. The date that the format's header
    carries is replaced by fixed text.
    """
    from scipy.io import savemat

    variables: dict[str, Any] = {
        "info": {
            "trial": facts.trial,
            "frame": trajectory.frame,
            "method": trajectory.method,
            "unit": "mm, s",
            "ids": np.sort(trajectory.ids).astype(np.float64),
            "state_words": np.array([s.word for s in State], dtype=object),
        }
    }
    if facts.rig is not None:
        variables["rig"] = _rig(facts.rig)
    for path in marker_paths(trajectory):
        name = f"marker_{path.id}" if path.id >= 0 else f"marker_m{-path.id}"
        variables[name] = _struct(path)
    buffer = io.BytesIO()
    savemat(buffer, variables, long_field_names=True, oned_as="column")
    data = buffer.getvalue()
    out.write(_HEADER.ljust(_HEADER_BYTES) + data[_HEADER_BYTES:])


def _struct(path: MarkerPath) -> dict[str, Any]:
    return {
        "id": float(path.id),
        "t_s": path.t_s,
        "xyz_mm": path.xyz_mm,
        "sigma_mm": path.sigma_mm,
        "state": path.state.astype(np.int8),
    }


def _rig(rig: StereoRig) -> dict[str, Any]:
    left, right = rig.projection_matrices()
    return {
        "P_left": left,
        "P_right": right,
        "R_right_left": rig.R_right_left,
        "t_right_left_mm": rig.t_right_left_mm,
        "distortion_left": rig.left.distortion,
        "distortion_right": rig.right.distortion,
    }
