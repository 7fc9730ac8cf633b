"""The truth of a simulated trial, kept apart from its recordings: no stage ever reads it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import tomlkit

from olivevib.arrays import Bools, Floats, Ints
from olivevib.simulation.motion import Shake
from olivevib.simulation.planar import corners_mm
from olivevib.simulation.scene import Camera, seen_at
from olivevib.simulation.staging import STAMPS, Marker, Stage
from olivevib.simulation.surroundings import covered_share

PATH_HZ = 500.0  # of the dense paths in truth.h5
COVER_GRID = 16  # points a side of a marker, to see what leaves hide


@dataclass(frozen=True)
class Frames:
    """All frames of one camera, dropped ones included.

    exposed_s (N,): trial time of row 0's mid-exposure; stamp_us (N,): what the file says;
    delivered (N,): whether the frame is in the file.
    """

    exposed_s: Floats
    stamp_us: Ints
    delivered: Bools


def frames_of(stage: Stage, side: str) -> Frames:
    """When one camera exposed, what it stamped and what it lost."""
    camera: Camera = getattr(stage.tree, side)
    rng = np.random.default_rng([stage.seed, STAMPS, 0 if side == "left" else 1])
    count = stage.scenario.frames
    stamps = camera.clock.stamps_us(count, rng)
    return Frames(camera.clock.exposed_s(count), stamps, camera.clock.delivered(count, rng))


def board_frames(stage: Stage, side: str) -> Frames:
    """When one camera saw the board: a video from t = 0, or stills of a board that is held."""
    plan, clock = stage.scenario.board, getattr(stage.tree, side).clock
    every = np.ones(plan.views, dtype=np.bool_)
    times = np.arange(plan.views) / (plan.video_fps or 1.0)
    return Frames(times + clock.offset_s, np.rint(times * 1e6).astype(np.int64), every)


@dataclass(frozen=True)
class View:
    """What one camera should find of every marker in every frame (N), (M) markers.

    px (N, M, 5, 2): centre, then the corners P1…P4's outer ones clockwise; t_s (N, M, 5): when.
    """

    px: Floats
    t_s: Floats


def view_of(stage: Stage, side: str) -> View:
    """Exact places and times of centres and outer corners in one camera."""
    camera: Camera = getattr(stage.tree, side)
    exposed = frames_of(stage, side).exposed_s
    found = [
        seen_at(camera, m.body, exposed, np.vstack([np.zeros((1, 2)), corners_mm(m.size_mm)]))
        for m in stage.markers
    ]
    return View(np.stack([f[0] for f in found], 1), np.stack([f[1] for f in found], 1))


def covered(stage: Stage, side: str) -> Floats:
    """Share of each marker's dark square that leaves hide from a camera, (N, M), 0…1."""
    camera: Camera = getattr(stage.tree, side)
    exposed, leaves = frames_of(stage, side).exposed_s, stage.tree.surroundings.front
    out = np.zeros((exposed.size, len(stage.markers)))
    if not leaves:
        return out
    steps = (np.arange(COVER_GRID) + 0.5) / COVER_GRID - 0.5
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    for n, t in enumerate(exposed):
        for m, marker in enumerate(stage.markers):
            px = camera.project(marker.body.points_mm(t, grid * marker.size_mm)[0])
            out[n, m] = covered_share(leaves, float(t), camera.project, px)
    return out


def write_truth(folder: Path, stage: Stage) -> tuple[Path, Path]:
    """Write truth.toml and truth.h5 into ``folder``; the same stage gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    text, arrays = folder / "truth.toml", folder / "truth.h5"
    text.write_text(tomlkit.dumps(_summary(stage)), encoding="utf-8")
    with h5py.File(arrays, "w") as file:
        _write_paths(file, stage)
        for side in ("left", "right"):
            _write_camera(file.create_group(side), stage, side)
        poses = [body.pose(0.0) for body in stage.board_views]
        _put(file, "board_rotation", np.stack([p[0][0] for p in poses]), "")
        _put(file, "board_origin_mm", np.stack([p[1][0] for p in poses]), "mm")
    return text, arrays


def _put(group: Any, name: str, values: Any, unit: str) -> None:
    data = group.create_dataset(name, data=values, compression="gzip", compression_opts=4)
    if unit:
        data.attrs["units"] = unit


def _write_paths(file: Any, stage: Stage) -> None:
    """Dense paths of all marker centres and rotations in the left camera's frame."""
    count = int(stage.scenario.seconds * PATH_HZ) + 1
    t = np.arange(count) / PATH_HZ
    poses = [m.body.pose(t) for m in stage.markers]
    moved = [m.body.motion(t) for m in stage.markers]
    _put(file, "ids", np.array([m.id for m in stage.markers]), "")
    _put(file, "t_s", t, "s")
    _put(file, "xyz_mm", np.stack([p[1] for p in poses], 1), "mm")
    _put(file, "rotation_rad", np.stack([m[:, 3:] for m in moved], 1), "rad")
    _put(file, "rest_rotation", np.stack([m.body.R0 for m in stage.markers]), "")
    _put(file, "rest_mm", np.stack([m.body.t0_mm for m in stage.markers]), "mm")


def _write_camera(group: Any, stage: Stage, side: str) -> None:
    frames, view = frames_of(stage, side), view_of(stage, side)
    _put(group, "exposed_s", frames.exposed_s, "s")
    _put(group, "stamp_us", frames.stamp_us, "us")
    _put(group, "delivered", frames.delivered, "")
    _put(group, "centre_px", view.px[:, :, 0], "px")
    _put(group, "corners_px", view.px[:, :, 1:], "px")
    _put(group, "centre_t_s", view.t_s[:, :, 0], "s")
    _put(group, "covered", covered(stage, side), "1")


def _summary(stage: Stage) -> tomlkit.TOMLDocument:
    scenario, rig = stage.scenario, stage.tree.rig
    doc = tomlkit.document()
    doc.add(tomlkit.comment("The truth of a simulated trial. No stage of olivevib reads this."))
    doc["scenario"] = scenario.name
    doc["seed"] = stage.seed
    doc["seconds"] = scenario.seconds
    doc["board"] = stage.board.spec
    for side in ("left", "right"):
        doc[side] = _camera_table(getattr(stage.tree, side))
    doc["rig"] = {
        "R_right_left": rig.R_right_left.tolist(),
        "t_right_left_mm": rig.t_right_left_mm.tolist(),
        "baseline_mm": rig.baseline_mm,
    }
    clock = stage.tree.right.clock
    doc["timing"] = {"right_offset_s": clock.offset_s, "right_drift_ppm": clock.drift_ppm}
    sensor = scenario.sensor
    if sensor is not None:
        doc["accelerometer"] = {
            "marker": sensor.marker,
            "clock_offset_s": sensor.clock_offset_s,
            "drift_ppm": sensor.drift_ppm,
            "R_sensor_marker": sensor.R_sensor_marker.tolist(),
            "lever_mm": list(sensor.lever_mm),
            "bias_m_s2": list(sensor.bias_m_s2),
        }
    doc["gravity_direction"] = stage.down.tolist()
    table = tomlkit.aot()
    for marker in stage.markers:
        table.append(tomlkit.item(_marker_table(marker)))
    doc["markers"] = table
    return doc


def _camera_table(camera: Camera) -> dict[str, Any]:
    model = camera.model
    return {
        "K": model.K.tolist(),
        "distortion": model.distortion.tolist(),
        "row_time_s": model.row_time_s,
        "exposure_s": camera.optics.exposure_s,
        "psf_px": camera.optics.psf_px,
    }


def _marker_table(marker: Marker) -> dict[str, Any]:
    table: dict[str, Any] = {"id": marker.id, "size_mm": marker.size_mm, "place": marker.place}
    for term in marker.body.motion.terms:
        if isinstance(term, Shake):
            table["frequency_hz"] = term.f_hz
            table["steady_s"] = list(term.phases.steady_s)
            table["amplitude_mm"] = term.amplitude[:3].tolist()
            table["rotation_amplitude_rad"] = term.amplitude[3:].tolist()
    return table
