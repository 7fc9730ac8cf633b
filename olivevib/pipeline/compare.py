"""Stage ``compare``: each bound accelerometer against the marker it was fixed to."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from olivevib.comparison import Comparison, ComparisonSettings, Localised, View
from olivevib.comparison import compare as compare_records
from olivevib.detection.exposure_gain import exposure_gain
from olivevib.errors import Caution, InputError, OlivevibError, UsageError
from olivevib.files.accelerometer import (
    AccelerometerRecord,
    ImportOptions,
    read_accelerometer,
    read_preset,
    write_preset,
)
from olivevib.files.store import write_stage
from olivevib.files.trial_folders import FILE
from olivevib.pipeline.marker_views import marker_views
from olivevib.pipeline.motions import body_point, marker_motion
from olivevib.progress import Tick, silent
from olivevib.reconstruction import Trajectory
from olivevib.reconstruction.continuous import interval_s
from olivevib.signals import Samples
from olivevib.trial import Trial
from olivevib.trial.records.comparison import comparison_file
from olivevib.trial.settings import Accelerometer
from olivevib.vibration.clock import between


def compare(trial: Trial, tick: Tick = silent) -> tuple[Caution, ...]:
    """Compare every sensor that is bound to a marker with that marker; writes comparison.h5."""
    now = trial.fingerprint("compare")
    trajectory = trial.trajectory
    if trajectory is None:
        raise trial.need("reconstruct")
    results: list[Comparison] = []
    motion, found = marker_motion(trial, trajectory)
    cautions = list(found)
    bound = [a for a in trial.settings.accelerometers if a.marker is not None]
    for sensor in bound:
        record = sensor_record(trial, sensor)
        cautions.extend(record.cautions)
        results.append(compare_sensor(trial, trajectory, motion, (sensor, record), tick))
    write_stage(trial.folder / "comparison.h5", comparison_file(results, cautions, now))
    return tuple(cautions)


def sensor_record(trial: Trial, sensor: Accelerometer) -> AccelerometerRecord:
    """What a sensor's file holds; an error says where the options that it asks for are written."""
    try:
        return read_accelerometer(trial.path(sensor.file), sensor_options(trial, sensor))
    except OlivevibError as error:
        asked = [f.name for f in fields(ImportOptions) if re.search(rf"\b{f.name}\b", error.remedy)]
        if not asked:
            raise
        place = f"{trial.folder / FILE}, under [[accelerometers]] file = {sensor.file!r}"
        raise type(error)(
            error.what,
            error.why,
            f"{error.remedy} It goes into {place}, such as: {_such(asked[0])}",
        ) from error


def _such(option: str) -> str:
    """A line of trial.toml as an example."""
    return _EXAMPLES.get(option, f"{option} = …")


_EXAMPLES = {
    "rate_hz": "rate_hz = 1000",
    "unit": 'unit = "g"',
    "per_g": "per_g = 16384",
    "time_unit": 'time_unit = "ms"',
    "time_column": 'time_column = "t"',
    "columns": 'columns = ["ax", "ay", "az"]',
    "start": 'start = "2026-11-20T10:15:00"',
}


def sensor_options(trial: Trial, sensor: Accelerometer) -> ImportOptions:
    """How to read a sensor's file: what trial.toml says, over its preset, over what is read."""
    preset = read_preset(trial.path(sensor.preset)) if sensor.preset else ImportOptions()
    told = sensor.model_dump(include={f.name for f in fields(ImportOptions)})
    return replace(preset, **{name: value for name, value in told.items() if value})


def keep_preset(trial: Trial, name: str, sensor: int, workspace: Path) -> Path:
    """Write how the trial's sensor (from 1) is read as presets/NAME.toml; returns the file."""
    told = trial.settings.accelerometers
    if not 1 <= sensor <= len(told):
        raise UsageError(
            f"{trial.name} has no accelerometer number {sensor}.",
            f"Its trial.toml names {len(told)}.",
            "Give --sensor within these.",
        )
    if not name.replace("-", "").replace("_", "").isalnum():
        raise UsageError(f"{name!r} is no name of a preset.", "", "Use letters, digits, - and _.")
    path = workspace / "presets" / f"{name}.toml"
    path.parent.mkdir(exist_ok=True)
    write_preset(path, sensor_options(trial, told[sensor - 1]))
    return path


def _at_sensor(
    trajectory: Trajectory, motion: Mapping[int, Samples], sensor: Accelerometer
) -> Samples:
    """How the point moved where the sensor sat: the marker's centre, and its lever as it turns."""
    marker = sensor.marker
    if marker is None or marker not in motion:
        seen = ", ".join(str(int(i)) for i in trajectory.ids) or "none"
        raise UsageError(
            f"the accelerometer {sensor.file} is bound to marker {marker}, which was not tracked.",
            f"Tracked markers: {seen}.",
            "Correct accelerometers.marker in trial.toml.",
        )
    return body_point(trajectory, motion[marker], marker, sensor.lever_mm)


def compare_sensor(
    trial: Trial,
    trajectory: Trajectory,
    motion: Mapping[int, Samples],
    of: tuple[Accelerometer, AccelerometerRecord],
    tick: Tick,
) -> Comparison:
    """One sensor, and what it recorded, against the marker it is bound to."""
    sensor, record = of
    point = _at_sensor(trajectory, motion, sensor)
    marker = -1 if sensor.marker is None else sensor.marker
    views: tuple[View, ...] | None
    if trajectory.method == "continuous":  # the fit has given back what the exposure took
        views = marker_views(trial, trajectory, marker)
        settings = ComparisonSettings(localised=_localised(trial, marker))
        fit = trial.reconstruction.motion if trial.reconstruction else None
        point = point if fit is None else between(point, *interval_s(fit))
    else:
        exposure_s = (trial.settings.cameras.left.exposure_ms or 0.0) * 1e-3
        localised = _localised(trial, marker) if exposure_s else None
        settings, views = ComparisonSettings(exposure_s, localised), None
    return compare_records(point, _three_axes(record), marker, sensor.file, settings, tick, views)


def _localised(trial: Trial, marker: int) -> Localised | None:
    """What this marker's localiser tells of the mean over the left camera's exposure.

    None where no exposure is stated or no track is kept.
    """
    exposure_s, tracks = (trial.settings.cameras.left.exposure_ms or 0.0) * 1e-3, trial.tracks
    track = next((t for t in tracks.of("left") if t.id == marker), None) if tracks else None
    if track is None or not exposure_s:
        return None
    seen = track.centre_px[np.isfinite(track.centre_px).all(axis=1)]
    amplitude_px = float(np.sqrt(2 * np.sum(np.var(seen, axis=0)))) if len(seen) else 0.0

    def share(f_hz: float) -> tuple[float, float]:
        found = exposure_gain(f_hz, exposure_s, amplitude_px, track.localiser)
        mean = float(np.sinc(f_hz * exposure_s))
        return (1.0, 1.0 - mean) if found is None else (found.gain / mean, found.sigma / mean)

    return share


def _three_axes(record: AccelerometerRecord) -> Samples:
    """The sensor's samples on three axes; an axis that it does not have is not measured (NaN)."""
    samples = record.samples
    if len(samples.axes) == 3:
        return samples
    if not samples.axes or len(samples.axes) > 3:
        raise InputError(
            f"{record.source} has {len(samples.axes)} acceleration columns.",
            "A sensor has one to three axes.",
            "Name them with accelerometers.axes in trial.toml.",
        )
    values = np.full((samples.t_s.size, 3), np.nan)
    values[:, : len(samples.axes)] = samples.values
    return Samples(samples.t_s, values, samples.quantity, samples.unit, ("x", "y", "z"))
