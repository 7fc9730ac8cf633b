"""trajectory.h5: the 3-D paths, each sample with sigma, state and its own time."""

from __future__ import annotations

import json

import numpy as np

from olivevib.arrays import Floats
from olivevib.files.store import StageFile, Variable
from olivevib.reconstruction import Reconstruction, Trajectory, TrialClock
from olivevib.reconstruction.continuous import stored_fit
from olivevib.signals import State
from olivevib.trial.records.cautions import cautions_from, cautions_text
from olivevib.trial.records.motion import motion_columns, motion_from, motion_text
from olivevib.trial.stages import BY_NAME, Fingerprint

STAGE = BY_NAME["reconstruct"]
WORDS = tuple(s.word for s in State)
_UNTURNED = "[[1,0,0],[0,1,0],[0,0,1]]"
XYZ = "x right, y down, z forward"


def trajectory_file(result: Reconstruction, now: Fingerprint) -> StageFile:
    """The stage file of a reconstruction."""
    t = result.trajectory
    nm = ("time", "marker")
    axes = (*nm, "axis")
    return StageFile(
        stage=STAGE.name,
        schema=STAGE.schema,
        settings=dict(now.settings),
        inputs=dict(now.inputs),
        variables={
            "time": Variable(("time",), t.t_s, "s", "trial clock at row 0 of the left frame"),
            "marker": Variable(("marker",), t.ids, "1", "marker id"),
            "sample_time": Variable(nm, t.sample_t_s, "s", "instant of the sample"),
            "xyz": Variable(axes, t.xyz_mm, "mm", f"position of the centre, {XYZ}"),
            "sigma_xyz": Variable(axes, t.sigma_xyz_mm, "mm", "standard deviation of xyz"),
            "covariance": Variable((*axes, "axis2"), t.covariance_mm2, "mm2", "covariance of xyz"),
            "rotation": Variable(axes, t.rotation_rad, "rad", "rotation vector, marker to camera"),
            "sigma_rotation": Variable(
                axes, t.sigma_rotation_rad, "rad", "standard deviation of rotation"
            ),
            "state": Variable(nm, t.state, "1", "why a sample is there or not", WORDS),
            "epipolar": Variable(nm, t.epipolar_px, "px", "epipolar residual"),
            **_rig_part(t, axes),
            **(motion_columns(result.motion) if result.motion else {}),
        },
        attributes={
            "frame": t.frame,
            "R_world_left": json.dumps(t.R_world_left.tolist()),
            "t_world_left_mm": json.dumps(t.t_world_left_mm.tolist()),
            "method": t.method,
            "clock": json.dumps(_clock(result.clock)),
            "motion": motion_text(result.motion) if result.motion else "",
            "sigma_scale": result.sigma_scale,
            "epipolar_rms_px": result.epipolar_rms_px,
            "cautions": cautions_text(result.cautions),
        },
    )


def _rig_part(t: Trajectory, axes: tuple[str, ...]) -> dict[str, Variable]:
    if t.sigma_rig_mm is None:
        return {}
    words = "standard deviation that the calibration adds, the same error in all frames"
    return {"sigma_rig": Variable(axes, t.sigma_rig_mm, "mm", words)}


def _clock(clock: TrialClock) -> dict[str, float | str]:
    return {
        "right_offset_s": clock.right_offset_s,
        "right_offset_sigma_s": clock.right_offset_sigma_s,
        "reference_row": clock.reference_row,
        "source": clock.source,
        "left_row_time_s": clock.left_row_time_s,
        "right_row_time_s": clock.right_row_time_s,
        "right_drift": clock.right_drift,
        "drift_from_s": clock.drift_from_s,
    }


def reconstruction_from(file: StageFile) -> Reconstruction:
    """The reconstruction of a stage file."""

    def get(name: str) -> Floats:
        return np.asarray(file.variables[name].values)

    motion = motion_from(file)
    method = str(file.attributes["method"])
    fits = tuple(stored_fit(motion, m) for m in motion.markers) if motion else ()
    trajectory = Trajectory(
        t_s=get("time"),
        ids=get("marker").astype(np.int64),
        sample_t_s=get("sample_time"),
        xyz_mm=get("xyz"),
        sigma_xyz_mm=get("sigma_xyz"),
        covariance_mm2=get("covariance"),
        rotation_rad=get("rotation"),
        sigma_rotation_rad=get("sigma_rotation"),
        state=get("state").astype(np.int64),
        epipolar_px=get("epipolar"),
        frame=str(file.attributes["frame"]),
        method=method,
        fits=fits if method == "continuous" else (),
        sigma_rig_mm=get("sigma_rig") if "sigma_rig" in file.variables else None,
        R_world_left=np.array(json.loads(str(file.attributes.get("R_world_left", _UNTURNED)))),
        t_world_left_mm=np.array(
            json.loads(str(file.attributes.get("t_world_left_mm", "[0,0,0]")))
        ),
    )
    return Reconstruction(
        trajectory=trajectory,
        clock=TrialClock(**json.loads(str(file.attributes["clock"]))),
        sigma_scale=float(file.attributes["sigma_scale"]),
        epipolar_rms_px=float(file.attributes["epipolar_rms_px"]),
        cautions=cautions_from(file.attributes["cautions"]),
        motion=motion,
    )
