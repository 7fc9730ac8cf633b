"""What an accelerometer file becomes: options, the raw table of a format, the finished record."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, floats
from olivevib.errors import Caution, InputError, UsageError
from olivevib.signals import Samples

AXES = ("x", "y", "z")
SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";", "pipe": "|", "blank": " "}


class NoAccelerationError(InputError):
    """A recording of something else (gyroscope, force, pressure, spectrum): no option mends it."""


@dataclass(frozen=True)
class ImportOptions:
    """What the technician declares; everything that is left out is read from the file.

    unit: "g", "m/s2", "mg", "counts", "V", …, or "rest": accept what the rest magnitude proposes.
    per_g: how many of the file's numbers make 1 g (counts or volts), instead of a unit's factor.
    rate_hz: the sampling rate; the stamps of the file are then ignored. columns: the columns that
    hold x, y, z, by name or number from 1. axes: what the record's x, y, z are in the sensor's
    axes, as ("y", "-x", "z"). start: date and time of the first sample, ISO 8601.
    separator: tab, comma, semicolon, pipe, blank; decimal: "." or ",".
    """

    unit: str | None = None
    per_g: float | None = None
    rate_hz: float | None = None
    time_column: str | None = None
    time_unit: str | None = None
    columns: tuple[str, ...] = ()
    axes: tuple[str, ...] = ()
    start: str | None = None
    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None

    def __post_init__(self) -> None:
        for name in ("per_g", "rate_hz"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise UsageError(
                    f"{name} = {value}: not possible.", "It must be above 0.", "Correct it."
                )
        if self.axes and sorted(a.lstrip("+-") for a in self.axes) != sorted(AXES):
            raise UsageError(
                f"axes = {', '.join(self.axes)}: not possible.",
                "Each of x, y, z must stand in it once.",
                "Write for example \"y,-x,z\": the record's x is the sensor's y.",
            )
        if self.separator is not None and self.separator not in SEPARATORS:
            raise UsageError(
                f"separator = {self.separator}: unknown.", "", "Use " + ", ".join(SEPARATORS) + "."
            )
        if self.decimal not in (None, ".", ","):
            raise UsageError(f"decimal = {self.decimal}: unknown.", "", 'Use "." or ",".')


@dataclass(frozen=True)
class Channel:
    """One column of a file: its name and unit as written, its cells.

    values (N,) float64 with NaN for bad and empty cells; text (N,) the cells as written where they
    are no numbers (date and time columns), else None. bad: cells that are neither number nor empty.
    """

    name: str
    unit: str
    values: Floats
    text: NDArray[Any] | None = None
    bad: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", np.asarray(self.values, dtype=np.float64))


@dataclass(frozen=True)
class Table:
    """What every format is read into, before anything is decided about axes, units or times.

    channels share one length N. stamps_s (N,) where the format itself defines the times; else a
    channel may hold them. metadata: key and value of the header, keys in lower case.
    layout: in words, how the file was understood; decimal: the mark used in its header.
    """

    format: str
    channels: tuple[Channel, ...]
    metadata: tuple[tuple[str, str], ...] = ()
    stamps_s: Floats | None = None
    rate_hz: float | None = None
    t0_s: float = 0.0
    start: datetime | None = None
    layout: str = ""
    decimal: str = "."
    cautions: tuple[Caution, ...] = ()

    @property
    def rows(self) -> int:
        """The number of rows N."""
        return self.channels[0].values.size if self.channels else 0


@dataclass(frozen=True)
class Gap:
    """A hole in the record: after the sample at ``t_s`` the next one came ``duration_s`` later."""

    t_s: float
    duration_s: float


@dataclass(frozen=True)
class Clock:
    """The sensor's clock: rate with sigma, jitter, and what was wrong with the stamps.

    method: "line" (even clock, stamps scatter about it), "stamps" (the rate really varies),
    "rate" (no stamps: the rate was declared or stands in the header). rate_sigma_hz: of the fitted
    rate; for "stamps" how much the rate of a quarter of the record varies; NaN for "rate".
    jitter_s rms and worst_s largest distance of a stamp from the line. duplicates: rows with the
    stamp of the row before; dropped_rows: rows left out because their stamp was missing, repeated
    with the same values, or ran backward. start: date and time of t = 0, where the file knows it.
    """

    rate_hz: float
    rate_sigma_hz: float
    method: str
    jitter_s: float = 0.0
    worst_s: float = 0.0
    gaps: tuple[Gap, ...] = ()
    duplicates: int = 0
    backward: int = 0
    dropped_rows: int = 0
    start: datetime | None = None


@dataclass(frozen=True)
class AccelerometerRecord:
    """An accelerometer file as acceleration in m/s2 on its own clock, and how it was understood.

    samples: t_s as the file's clock says (epoch and dated stamps start at 0, see ``clock.start``).
    source_unit and m_s2_per_unit; unit_basis "column header", "metadata", "declared" or "proposed
    from rest magnitude". gravity_m_s2 (C,): mean vector while at rest (``rest_found``) or of the
    whole record; it is not removed. clipped (C,) values at the sensor's limit. bad_cells: column
    and number of unreadable cells, of all columns. columns_refused: name and reason.
    """

    samples: Samples
    clock: Clock
    source: str
    format: str
    layout: str
    source_unit: str
    unit_basis: str
    m_s2_per_unit: float
    gravity_m_s2: Floats
    rest_found: bool
    clipped: tuple[int, ...]
    bad_cells: tuple[tuple[str, int], ...]
    columns_used: tuple[str, ...]
    columns_refused: tuple[tuple[str, str], ...]
    cautions: tuple[Caution, ...]

    def __post_init__(self) -> None:
        shape = (len(self.samples.axes),)
        gravity = floats("gravity_m_s2", self.gravity_m_s2, shape, nan=True)
        object.__setattr__(self, "gravity_m_s2", gravity)

    @property
    def rate_hz(self) -> float:
        """Sampling rate, Hz, from the line fit or the stamps."""
        return self.clock.rate_hz

    @property
    def rate_sigma_hz(self) -> float:
        """Standard deviation of the rate, Hz."""
        return self.clock.rate_sigma_hz

    @property
    def rest_magnitude_m_s2(self) -> float:
        """Length of the gravity vector, m/s2; meaningful with three axes."""
        return float(np.linalg.norm(self.gravity_m_s2))
