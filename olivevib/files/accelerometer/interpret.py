"""A raw table to a finished record: times, columns, unit, gravity, limits, cautions."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from functools import partial

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution, InputError, UsageError
from olivevib.files.accelerometer import limits
from olivevib.files.accelerometer.cautions import clock_cautions, record_cautions
from olivevib.files.accelerometer.clock import Timing, even_timing, stamp_timing
from olivevib.files.accelerometer.columns import Choice, choose_columns
from olivevib.files.accelerometer.metadata import header_rate_hz, header_start, known_logger
from olivevib.files.accelerometer.record import (
    AXES,
    AccelerometerRecord,
    ImportOptions,
    Table,
)
from olivevib.files.accelerometer.rest import find_rest
from olivevib.files.accelerometer.scale import find_scale
from olivevib.files.accelerometer.stamps import read_stamps
from olivevib.signals import Samples

LARGEST = 1e12  # in the file's unit


def interpret(table: Table, options: ImportOptions, source: str) -> AccelerometerRecord:
    """Decide axes, times and unit of a table; InputError where the file leaves one open."""
    choice = choose_columns(table, options, source)
    raw = np.stack([_possible(table.channels[k].values) for k, _ in choice.axes]).T
    timing, more = _timing(table, choice, raw, options, source)
    raw = raw if timing.keep.all() else raw[timing.keep]
    if not any(np.isfinite(column).any() for column in raw.T):
        raise InputError(
            f"{source} has no readable acceleration.",
            "Every cell of " + ", ".join(_used(choice)) + " is empty or no number.",
            "Check decimal mark and columns.",
        )
    rest = find_rest(raw, timing.clock.rate_hz)
    scale = find_scale(table, choice, raw, rest, options, source)
    values, gravity, axes = _mapped(
        raw * scale.factor, rest.vector * scale.factor, choice, options, source
    )
    values.flags.writeable = False  # this record's own: no copy is needed
    timing.t_s.flags.writeable = False
    record = AccelerometerRecord(
        samples=Samples(timing.t_s, values, "acceleration", "m/s2", axes),
        clock=timing.clock,
        source=source,
        format=_format(table),
        layout=table.layout,
        source_unit=scale.unit,
        unit_basis=scale.basis,
        m_s2_per_unit=float(scale.factor[0]),
        gravity_m_s2=gravity,
        rest_found=rest.found,
        clipped=tuple(limits.clipped(column) for column in raw.T),
        bad_cells=tuple((c.name, c.bad) for c in table.channels if c.bad),
        columns_used=_used(choice),
        columns_refused=choice.refused,
        cautions=(),
    )
    cautions = (*table.cautions, *more, *scale.cautions, *clock_cautions(record))
    return replace(record, cautions=(*cautions, *record_cautions(record, choice)))


def _possible(values: Floats) -> Floats:
    """The values (N,) with NaN for numbers beyond any sensor's: damaged bytes, not readings."""
    if float(np.fmax.reduce(np.abs(values), initial=0.0)) < LARGEST:
        return values
    return np.asarray(np.where(np.abs(values) < LARGEST, values, np.nan))


def _format(table: Table) -> str:
    known = known_logger(table)
    return known[0] if known and table.format == "delimited text" else table.format


def _used(choice: Choice) -> tuple[str, ...]:
    return tuple(choice.meanings[k].name or f"column {k + 1}" for k, _ in choice.axes)


def _timing(
    table: Table, choice: Choice, raw: Floats, options: ImportOptions, source: str
) -> tuple[Timing, tuple[Caution, ...]]:
    """The times of the rows: declared rate, the format's or a column's stamps, or header rate."""
    declared = header_rate_hz(table)
    start = _declared_start(options, source) or table.start or header_start(table)
    if options.rate_hz is not None:
        return even_timing(table.rows, options.rate_hz, start=start), ()
    same = partial(limits.repeats, raw)
    if table.stamps_s is not None:
        timing = stamp_timing(table.stamps_s, same, start, source)
        return timing, ()
    if table.rate_hz is not None and options.time_column is None:
        return even_timing(table.rows, table.rate_hz, table.t0_s, start), ()
    if not choice.times:
        if declared is None:
            raise InputError(
                f"{source} has neither a time column nor a sampling rate.",
                "Its columns: " + ", ".join(m.name or "?" for m in choice.meanings) + ".",
                "Give rate_hz, or name the time column (time_column).",
            )
        return even_timing(table.rows, declared, start=start), ()
    channels = [table.channels[k] for k in choice.times]
    stamps = read_stamps(
        channels,
        choice.meanings[choice.times[0]],
        source,
        unit=options.time_unit,
        rate_hz=declared,
    )
    timing = stamp_timing(stamps.t_s, same, start or stamps.start, source)
    return timing, (*stamps.cautions, *_rate_caution(timing, declared, source))


def _rate_caution(timing: Timing, declared: float | None, source: str) -> tuple[Caution, ...]:
    rate = timing.clock.rate_hz
    if declared is None or abs(rate / declared - 1) < 0.05:
        return ()
    text = f"The header of {source} says {declared:.6g} Hz, its stamps say {rate:.6g} Hz."
    remedy = "The stamps were used; give time_unit or rate_hz if they are wrong."
    return (Caution("sensor-rate-differs", text, remedy),)


def _declared_start(options: ImportOptions, source: str) -> datetime | None:
    if options.start is None:
        return None
    try:
        return datetime.fromisoformat(options.start)
    except ValueError as error:
        raise UsageError(
            f"{source}: start = {options.start} is no date and time.",
            "",
            "Write it as 2026-11-20T10:15:00.",
        ) from error


def _mapped(
    values: Floats, gravity: Floats, choice: Choice, options: ImportOptions, source: str
) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Values and gravity in the record's axes: as the sensor's, or turned by ``options.axes``."""
    axes = tuple(axis for _, axis in choice.axes)
    if not options.axes:
        return values, gravity, axes
    if sorted(axes) != sorted(AXES):
        raise UsageError(
            f"{source}: axes = {', '.join(options.axes)} needs three axes.",
            f"The file has {', '.join(axes)}.",
            "Leave axes out for this file.",
        )
    at = [axes.index(name.lstrip("+-")) for name in options.axes]
    sign = np.array([-1.0 if name.startswith("-") else 1.0 for name in options.axes])
    return values[:, at] * sign, gravity[at] * sign, AXES
