"""Accelerometers in the form of a new trial: four lines each, as many sensors as there are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from olivevib.tui.fields import Field, FieldError, read_field

if TYPE_CHECKING:
    from olivevib.pipeline import SensorPlan

PARTS = ("", "_marker", "_axes", "_lever")
AXES = ("x,y,z", "x,-z,y", "y,x,-z", "-x,-y,z")
_NAME = re.compile(r"accelerometer(\d*)(_marker|_axes|_lever)?")


def sensor_fields(number: int) -> tuple[Field, ...]:
    """The lines of one sensor: its file, its marker, its axes, where it sat; from 1."""
    file, marker, axes, lever = (sensor_line(number, part) for part in PARTS)
    first = number == 1
    of = "its {}" if first else f"{{}} of {number}"
    return (
        Field(file, f"accelerometer{'' if first else f' {number}'}", "what the logger wrote", True),
        Field(marker, of.format("marker"), "the id it was fixed to"),
        Field(axes, of.format("axes"), "which of the file's are x, y, z: x,-z,y", choices=AXES),
        Field(lever, f"{of.format('lever')}, mm", "0,25,-8: right, down, in from its centre"),
    )


def sensor_line(number: int, part: str = "") -> str:
    """The name of one line of a sensor, from 1; part as in ``PARTS``."""
    return f"accelerometer{'' if number == 1 else number}{part}"


def sensor_of(name: str) -> int:
    """The number of the sensor that a line is of, from 1; 0 where it is none of a sensor's."""
    found = _NAME.fullmatch(name)
    return int(found[1] or 1) if found else 0


def line_told(name: str, order: int, values: Mapping[str, str]) -> str:
    """Where a line of the sensor that was told as number ``order`` (from 1) stands in the form.

    name: as the first sensor's; a line of no sensor is as it is. Sensors left empty do not count.
    """
    found = _NAME.fullmatch(name)
    if not found:
        return name
    every = range(1, how_many(values) + 1)
    named = [n for n in every if values.get(sensor_line(n), "").strip()]
    return sensor_line(named[order - 1] if order <= len(named) else order, found[2] or "")


def how_many(names: Iterable[str]) -> int:
    """For how many sensors a form with these lines has room; at least one."""
    return max(1, *(sensor_of(name) for name in names))


def sensors_in(said: Mapping[str, str]) -> tuple[SensorPlan, ...]:
    """The sensors that the form tells; ``said`` holds no empty lines.

    FieldError names a line that cannot be read, or the file that is missing beside other lines.
    """
    found = (_sensor(said, number) for number in range(1, how_many(said) + 1))
    return tuple(sensor for sensor in found if sensor is not None)


def _sensor(said: Mapping[str, str], number: int) -> SensorPlan | None:
    from olivevib.pipeline import sensor_plans

    file, *rest = (sensor_line(number, part) for part in PARTS)
    told = [[said[name]] if name in said else [] for name in rest]
    for k, name in enumerate(rest):
        only: list[list[str]] = [told[j] if j == k else [] for j in range(len(rest))]
        read_field(said, name, partial(_alone, only))
    if file not in said:
        if not any(told):
            return None
        remedy = "Pick it with Ctrl+O in that line, or empty the other lines of this sensor."
        raise FieldError(file, "the file of this accelerometer is not named.", remedy)
    return sensor_plans([said[file]], *told)[0]


def _alone(options: Sequence[Sequence[str]], _: str | None) -> None:
    """UsageError where one option of a sensor, told without the others, cannot be read."""
    from olivevib.pipeline import sensor_plans

    sensor_plans([""], *options)
