"""Accelerometer files of any make, as acceleration in m/s2 on the sensor's own clock."""

from olivevib.files.accelerometer.preset import read_preset, write_preset
from olivevib.files.accelerometer.read import read_accelerometer
from olivevib.files.accelerometer.record import (
    AccelerometerRecord,
    Clock,
    Gap,
    ImportOptions,
    NoAccelerationError,
)

__all__ = [
    "AccelerometerRecord",
    "Clock",
    "Gap",
    "ImportOptions",
    "NoAccelerationError",
    "read_accelerometer",
    "read_preset",
    "write_preset",
]
