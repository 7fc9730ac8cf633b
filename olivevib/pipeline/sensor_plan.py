"""Accelerometers of a new trial: the file, the marker it was fixed to, its axes, where it sat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

from olivevib.errors import UsageError

NOT_SAID = "-"  # in a list of options, for a sensor of which it is not said


@dataclass(frozen=True)
class SensorPlan:
    """One sensor: path as the user gave it; axes as ("x", "-z", "y"); lever_mm (3,) of the marker.

    axes: which of the file's axes are x, y, z; lever_mm: from the marker's centre, in its own axes.
    """

    file: str
    marker: int | None = None
    axes: tuple[str, ...] = ()
    lever_mm: tuple[float, float, float] | None = None


def sensor_plans(
    files: Sequence[str], markers: Sequence[str], axes: Sequence[str], levers: Sequence[str]
) -> tuple[SensorPlan, ...]:
    """The sensors of ``olivevib new``: each option again for each sensor, in the same order.

    "-" stands for a sensor of which an option is not said. Raises UsageError for more values than
    sensors, and for values that cannot be.
    """
    options = {"marker": markers, "axes": axes, "lever": levers}
    for name, given in options.items():
        if len(given) > len(files):
            raise UsageError(
                f"--accelerometer-{name} is given {len(given)} times for {len(files)} sensors.",
                "The options of several sensors go by their order.",
                f"Give --accelerometer FILE once for each; {NOT_SAID} leaves one out.",
            )
    rows = zip_longest(files, markers, axes, levers, fillvalue=NOT_SAID)
    return tuple(SensorPlan(f, _marker(m), _axes(a), _lever(v)) for f, m, a, v in rows)


def _marker(text: str) -> int | None:
    if text == NOT_SAID:
        return None
    if not text.isdigit():
        raise UsageError(f"--accelerometer-marker {text}: no marker id.", "", "Give its number.")
    return int(text)


def _axes(text: str) -> tuple[str, ...]:
    axes = () if text == NOT_SAID else tuple(part.strip() for part in text.split(","))
    if axes and sorted(a.lstrip("+-") for a in axes) != ["x", "y", "z"]:
        raise UsageError(
            f"--accelerometer-axes {text}: these are not three axes.",
            "Each of x, y and z stands once, with a minus where it is reversed.",
            "Give them as --accelerometer-axes=x,-z,y",
        )
    return axes


def _lever(text: str) -> tuple[float, float, float] | None:
    if text == NOT_SAID:
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(
            f"--accelerometer-lever {text}: these are not three numbers.",
            "It is where the sensor sat, from the marker's centre: right, down, into the surface.",
            "Give millimetres, such as --accelerometer-lever=0,25,-8",
        ) from error
    return x, y, z
