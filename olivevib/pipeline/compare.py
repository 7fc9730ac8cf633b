"""Stage ``compare``: each bound accelerometer against the marker it was fixed to."""

from __future__ import annotations

import numpy as np

from olivevib.comparison import Comparison, ComparisonSettings
from olivevib.comparison import compare as compare_records
from olivevib.errors import Caution, InputError, UsageError
from olivevib.files.accelerometer import AccelerometerRecord, ImportOptions, read_accelerometer
from olivevib.files.store import write_stage
from olivevib.progress import Tick, silent
from olivevib.reconstruction import Trajectory
from olivevib.signals import Samples
from olivevib.trial import Trial
from olivevib.trial.records.comparison import comparison_file
from olivevib.trial.settings import Accelerometer


def compare(trial: Trial, tick: Tick = silent) -> tuple[Caution, ...]:
    """Compare every sensor that is bound to a marker with that marker; writes comparison.h5."""
    now = trial.fingerprint("compare")
    trajectory = trial.trajectory
    if trajectory is None:
        raise trial.need("reconstruct")
    results: list[Comparison] = []
    cautions: list[Caution] = []
    bound = [a for a in trial.settings.accelerometers if a.marker is not None]
    for sensor in bound:
        record = read_accelerometer(trial.path(sensor.file), import_options(sensor))
        cautions.extend(record.cautions)
        results.append(_one(trial, trajectory, sensor, record, tick))
    write_stage(trial.folder / "comparison.h5", comparison_file(results, cautions, now))
    return tuple(cautions)


def import_options(sensor: Accelerometer) -> ImportOptions:
    """What trial.toml says of how to read a sensor's file."""
    return ImportOptions(
        unit=sensor.unit,
        per_g=sensor.per_g,
        rate_hz=sensor.rate_hz,
        time_column=sensor.time_column,
        time_unit=sensor.time_unit,
        columns=sensor.columns,
        axes=sensor.axes,
        start=sensor.start,
    )


def _one(
    trial: Trial,
    trajectory: Trajectory,
    sensor: Accelerometer,
    record: AccelerometerRecord,
    tick: Tick,
) -> Comparison:
    marker = sensor.marker
    if marker is None or marker not in trajectory.ids:
        seen = ", ".join(str(int(i)) for i in trajectory.ids) or "none"
        raise UsageError(
            f"the accelerometer {sensor.file} is bound to marker {marker}, which was not tracked.",
            f"Tracked markers: {seen}.",
            "Correct accelerometers.marker in trial.toml.",
        )
    exposure = trial.settings.cameras.left.exposure_ms
    settings = ComparisonSettings(exposure_s=(exposure or 0.0) * 1e-3)
    return compare_records(
        trajectory.samples(marker), _three_axes(record), marker, sensor.file, settings, tick
    )


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
