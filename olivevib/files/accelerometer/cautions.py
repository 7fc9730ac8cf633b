"""What a technician should look at in an accelerometer record, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from olivevib.errors import Caution
from olivevib.files.accelerometer.columns import Choice
from olivevib.files.accelerometer.limits import stuck
from olivevib.files.accelerometer.record import AccelerometerRecord
from olivevib.files.accelerometer.rest import fits_gravity


def clock_cautions(record: AccelerometerRecord) -> Iterator[Caution]:
    """Gaps, repeated and backward stamps, a clock that wanders."""
    clock = record.clock
    if clock.gaps:
        worst = max(clock.gaps, key=lambda gap: gap.duration_s)
        listed = ", ".join(f"{1e3 * g.duration_s:.3g} ms" for g in clock.gaps[:5])
        more = ", …" if len(clock.gaps) > 5 else ""
        yield Caution(
            "sensor-gaps",
            f"{record.source} has {len(clock.gaps)} gaps ({listed}{more}), "
            f"the longest at {worst.t_s:.3f} s.",
            "They stay gaps; choose a logger or card that keeps up if they fall into the shaking.",
        )
    if clock.duplicates > 0.01 * record.samples.t_s.size or clock.dropped_rows:
        yield Caution(
            "sensor-stamps-repeated" if not clock.backward else "sensor-stamps-backward",
            f"{record.source}: {clock.duplicates} rows repeat the stamp of the row before, "
            f"{clock.backward} run backward; {clock.dropped_rows} rows were left out.",
            "Rows with new values were spread up to the next stamp; give rate_hz to go by rows.",
        )
    if clock.method == "stamps" and clock.worst_s > 5 / clock.rate_hz:
        yield Caution(
            "sensor-clock-wanders",
            f"The clock of {record.source} leaves an even rate by {1e3 * clock.worst_s:.3g} ms; "
            "its stamps were used as they are.",
            "Nothing to do if the logger stamps each sample; else give rate_hz.",
        )


def record_cautions(record: AccelerometerRecord, choice: Choice) -> Iterator[Caution]:
    """Clipping, unreadable cells, stuck axes, gravity, axes by order."""
    if sum(record.clipped):
        yield Caution(
            "sensor-clipped",
            f"{record.source}: {sum(record.clipped)} values stand at the sensor's limit.",
            "Hits read smaller than they were; use a sensor of larger range.",
        )
    if record.bad_cells:
        listed = ", ".join(f"{count} in {name or 'a column'}" for name, count in record.bad_cells)
        yield Caution(
            "sensor-bad-cells",
            f"{record.source} has unreadable cells: {listed}.",
            "They are NaN where the column is an axis, and without effect elsewhere.",
        )
    axes = record.samples.axes
    still = [a for k, a in enumerate(axes) if stuck(record.samples.values[:, k])]
    if still:
        text = f"{record.source}: axis {', '.join(still)} never changes."
        yield Caution("sensor-axis-stuck", text, "Check the sensor and its cable.")
    if choice.by_order and len(axes) > 1:
        text = f"{record.source} names no axes: x, y, z were given by the order of the columns."
        yield Caution("sensor-axes-by-order", text, "Name the columns of x, y, z if it is wrong.")
    yield from _gravity(record, choice)


def _gravity(record: AccelerometerRecord, choice: Choice) -> Iterator[Caution]:
    length = record.rest_magnitude_m_s2
    if choice.linear:
        yield Caution(
            "sensor-gravity-removed",
            f"{record.source} is linear acceleration: the device has removed gravity.",
            "Record the raw accelerometer next time; slow motion in this file is not trustworthy.",
        )
    elif len(record.samples.axes) == 3 and np.isfinite(length) and not fits_gravity(length):
        yield Caution(
            "sensor-gravity-absent",
            f"The mean reading of {record.source} is {length:.3g} m/s2, not gravity.",
            "Normal for a sensor that does not pass constant acceleration; else check the unit.",
        )
