"""Simulated trials to report and to batch: one as large as a real one, many as small as can be."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from olivevib.files.rig_file import write_rig
from olivevib.geometry import StereoRig
from olivevib.pipeline import NewTrial, new_trial
from olivevib.progress import Tick
from olivevib.simulation import Phases, Scenario, SimulatedTrial, scenario, simulate
from olivevib.simulation.scenarios import CameraPlan, LightPlan, MarkerPlan, Shaking
from olivevib.trial import Trial

ARUCO = "aruco:DICT_4X4_50"
RIG = "shared_rig.toml"


def ten_markers(folder: Path, seconds: float, tick: Tick, library: str = ARUCO) -> Trial:
    """A trial with ten markers and an accelerometer, recorded and not measured yet."""
    sample = scenario("sample")
    shaking = Phases(0.12 * seconds, 0.08 * seconds, 0.8 * seconds, 0.05 * seconds)
    plan = replace(
        sample,
        seconds=seconds,
        what=Shaking(11.3, shaking, sway_mm=0.6, decay_mm=2.0),
        markers=MarkerPlan(library, tuple(range(1, 11)), (66.0, 74.0), (0.0, 35.0)),
    )
    return _trial(folder, plan, tick)


def small_trial(folder: Path, frames: int, tick: Tick) -> Trial:
    """Two markers in pictures of 400 x 300 px, the rig given: as little work as a trial can be."""
    sample, seconds = scenario("sample"), frames / 30
    plan = replace(
        sample,
        seconds=seconds,
        what=Shaking(6.0, Phases(0.0, 0.02, 2 * seconds, 0.02), sway_mm=0.0, decay_mm=0.0),
        markers=MarkerPlan(ARUCO, (1, 2), (66.0, 70.0), (0.0, 10.0), distance_mm=800.0),
        cameras=CameraPlan((400, 300), focal_px=420.0, baseline_mm=250.0),
        light=LightPlan(leaves=50),
        board=replace(sample.board, views=1),
        sensor=None,
    )
    return _trial(folder, plan, tick)


def _trial(folder: Path, plan: Scenario, tick: Tick) -> Trial:
    """Record the scenario and make the trial as ``olivevib new`` does, with its true rig in it."""
    place = folder.with_name(f"{folder.name}_simulated")
    made = simulate(place, plan, tick=tick)
    right = made.stage.tree.right
    rig = StereoRig(made.stage.tree.left.model, right.model, right.R, right.t_mm)
    write_rig(place / RIG, rig, {})
    new_trial(folder, _told(made, plan, place / RIG))
    shutil.move(place / RIG, folder / RIG)  # a copy of the trial needs nothing outside
    trial = Trial.open(folder).changed({"calibration.rig": RIG})
    shutil.rmtree(place)
    return trial


def _told(made: SimulatedTrial, plan: Scenario, rig: Path) -> NewTrial:
    return NewTrial(
        left=str(made.left),
        right=str(made.right),
        rig=str(rig),
        markers=made.markers,
        size_mm=made.size_mm,
        ids=made.ids,
        shutter=made.shutter,
        band_hz=plan.band_hz,
        accelerometer=str(made.accelerometer) if made.accelerometer else None,
        accelerometer_marker=made.accelerometer_marker,
        simulated=True,
        exposure_ms=made.exposure_ms,
        places=made.places,
        sizes_mm=made.sizes_mm,
    )
