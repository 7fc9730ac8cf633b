"""The unit of the axes: declared, in the header, or proposed by gravity; never guessed unsaid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution, InputError, UsageError
from olivevib.files.accelerometer.columns import Choice
from olivevib.files.accelerometer.metadata import header_unit, known_logger
from olivevib.files.accelerometer.record import ImportOptions, Table
from olivevib.files.accelerometer.rest import Rest, fits_gravity, looks_like_counts, proposals
from olivevib.files.accelerometer.units import ACCELERATION, RAW, Unit, parse_unit
from olivevib.signals import GRAVITY_M_S2

HEADER, METADATA, DECLARED = "column header", "metadata", "declared"
PROPOSED = "proposed from rest magnitude"


@dataclass(frozen=True)
class Scale:
    """factor (C,) to m/s2, the unit's name, what says so, and what to look at."""

    factor: Floats
    unit: str
    basis: str
    cautions: tuple[Caution, ...] = ()


def find_scale(
    table: Table, choice: Choice, values: Floats, rest: Rest, options: ImportOptions, source: str
) -> Scale:
    """The factors from the file's numbers to m/s2.

    values (N, C) and rest in the file's unit. Order: options, column headers, header block, known
    logger. Counts without a sensitivity are scaled so that rest is 1 g, with a caution. Without
    any unit InputError proposes one from the rest magnitude; unit "rest" accepts that proposal.
    """
    count = values.shape[1]
    if options.unit is not None and options.unit != "rest":
        unit = _declared(options.unit, source)
        return _of_units([unit] * count, DECLARED, rest, options, source)
    units = [choice.meanings[k].unit for k, _ in choice.axes]
    if options.per_g is not None:
        names = {u.name for u in units if u is not None}
        factor = np.full(count, GRAVITY_M_S2 / options.per_g)
        return Scale(factor, names.pop() if len(names) == 1 else "counts", DECLARED)
    usable = [u for u in units if u is not None and u.quantity in (ACCELERATION, RAW)]
    if len(usable) == count:
        return _of_units(usable, HEADER, rest, options, source)
    return _from_header_block(table, values, rest, options, source)


def _declared(text: str, source: str) -> Unit:
    unit = parse_unit(text)
    if unit is None or unit.quantity not in (ACCELERATION, RAW):
        raise UsageError(
            f"{source}: unit = {text} is no unit of acceleration.",
            "",
            "Use m/s2, g, mg, cm/s2, mm/s2, ft/s2, counts or V (with per_g), or rest.",
        )
    return unit


def _from_header_block(
    table: Table, values: Floats, rest: Rest, options: ImportOptions, source: str
) -> Scale:
    count = values.shape[1]
    unit = header_unit(table)
    known = known_logger(table)
    if unit is None and known is not None:
        unit = parse_unit(known[1])
        contradicts = known[0] == "Klipper" and "mm/s2" not in proposals(rest.magnitude)
        unit = None if contradicts else unit
    if unit is not None:
        return _of_units([unit] * count, METADATA, rest, options, source)
    return _proposed(values, rest, options, source)


def _of_units(
    units: list[Unit], basis: str, rest: Rest, options: ImportOptions, source: str
) -> Scale:
    names = "/".join(dict.fromkeys(u.name for u in units))
    if all(u.quantity == ACCELERATION for u in units):
        factor = np.array([u.factor for u in units])
        return Scale(factor, names, basis, _doubts(factor, names, basis, rest, source))
    if options.per_g is not None:
        return Scale(np.full(len(units), GRAVITY_M_S2 / options.per_g), names, basis)
    if len({u.name for u in units}) == 1 and units[0].name == "counts":
        return _one_g(rest, len(units), source)
    raise InputError(
        f"{source} is in {names}, and the sensitivity of the sensor is not known.",
        "",
        "Give per_g: how many of these make 1 g (its calibration sheet says so).",
    )


def _doubts(factor: Floats, unit: str, basis: str, rest: Rest, source: str) -> tuple[Caution, ...]:
    """A caution where the sensor at rest reads 1 g of another unit."""
    length = float(np.linalg.norm(rest.vector * factor))
    if factor.size < 3 or not rest.found or fits_gravity(length):
        return ()
    others = [name for name in proposals(rest.magnitude) if name != unit]
    if not others:
        return ()
    return (
        Caution(
            "sensor-unit-doubtful",
            f"The unit of {source} is {unit} ({basis}), but at rest it reads {rest.magnitude:.4g}, "
            f"which would be gravity in {' or '.join(others)}.",
            "Check the logger's unit; if the header is wrong, give unit.",
        ),
    )


def _one_g(rest: Rest, count: int, source: str) -> Scale:
    """Counts scaled so that the rest vector is 1 g; flagged, and refused without three axes."""
    if count < 3 or not np.isfinite(rest.magnitude) or rest.magnitude < 20:
        raise InputError(
            f"{source} is in counts, and gravity does not show their size.",
            f"The mean reading is {rest.magnitude:.4g} over {count} axes.",
            "Give per_g: how many counts make 1 g.",
        )
    where = "at rest" if rest.found else "on average (it was never at rest)"
    caution = Caution(
        "sensor-unit-proposed",
        f"{source} is in counts without a sensitivity: 1 g was taken as the {rest.magnitude:.0f} "
        f"counts that the sensor reads {where}.",
        "Give per_g from the sensor's data sheet or calibration if you know it.",
    )
    factor = np.full(count, GRAVITY_M_S2 / rest.magnitude)
    return Scale(factor, "counts", PROPOSED, (caution,))


def _proposed(values: Floats, rest: Rest, options: ImportOptions, source: str) -> Scale:
    count = values.shape[1]
    length = rest.magnitude
    if count == 3 and looks_like_counts(values, length):
        return _one_g(rest, count, source)
    fits = proposals(length) if count == 3 else ()
    if options.unit == "rest" and len(fits) == 1:
        unit = parse_unit(fits[0])
        factor = np.full(count, unit.factor if unit else np.nan)
        text = f"The unit of {source} was taken as {fits[0]}: at rest it reads {length:.4g}."
        remedy = "Give the unit if you know it."
        caution = Caution("sensor-unit-proposed", text, remedy)
        return Scale(factor, fits[0], PROPOSED, (caution,))
    where = "At rest" if rest.found else "On average"
    raise InputError(
        f"{source} names no unit of acceleration.",
        f"{where} it reads {length:.4g} over {count} {'axes' if count > 1 else 'axis'}"
        + (f": that is gravity in {' or in '.join(fits)}." if fits else ", no unit's gravity."),
        f'Give the unit: unit = "{fits[0]}"' + (" if that is right." if len(fits) == 1 else ", …")
        if fits
        else "Give the unit (m/s2, g, mg, …), or per_g for counts and volts.",
    )
