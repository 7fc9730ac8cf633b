"""enDAQ and Slam Stick recordings (IDE), through the optional library idelib."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from olivevib.errors import InputError, UsageError
from olivevib.files.accelerometer.foreign import foreign_parser
from olivevib.files.accelerometer.record import (
    Channel,
    ImportOptions,
    NoAccelerationError,
    Table,
)


def is_ide(head: bytes) -> bool:
    """True for EBML of the document type of enDAQ recorders."""
    return head.startswith(b"\x1a\x45\xdf\xa3") and b"mide" in head[:100]


def read_ide(path: Path, options: ImportOptions) -> Table:
    """Read the accelerometer of an IDE recording; of several, the one whose columns are named."""
    try:
        import idelib
    except ImportError as error:
        raise InputError(
            f"{path.name} is an enDAQ recording (IDE).",
            "Reading it needs the optional library idelib, which is not installed.",
            "Install it (pip install idelib), or export the recording as CSV in enDAQ Lab.",
        ) from error
    with foreign_parser(path.name, "IDE"), idelib.importFile(str(path)) as recording:
        channel = _channel(recording, options, path.name)
        samples = np.asarray(channel.getSession().arraySlice(), dtype=np.float64)
        started = recording.sessions[0].utcStartTime if recording.sessions else None
        columns = [(s.name, str(s.units[1])) for s in channel.subchannels]
    channels = tuple(
        Channel(name, unit, values)
        for (name, unit), values in zip(columns, samples[1:], strict=True)
    )
    return Table(
        "IDE",
        channels,
        stamps_s=samples[0] * 1e-6,
        start=datetime.fromtimestamp(float(started), tz=UTC) if started else None,
        layout=f"enDAQ recording, {channel.displayName}",
    )


def _channel(recording: Any, options: ImportOptions, source: str) -> Any:
    found = [
        channel
        for channel in recording.channels.values()
        if any(str(s.units[0]) == "Acceleration" for s in channel.subchannels)
        and len(channel.getSession())
    ]
    listed = "; ".join(", ".join(s.name for s in channel.subchannels) for channel in found)
    if options.columns:
        named = [c for c in found if options.columns[0] in [s.name for s in c.subchannels]]
        if len(named) != 1:
            raise UsageError(
                f"{source}: there is no column {options.columns[0]}.",
                f"Its accelerometers have {listed or 'none'}.",
                "Name columns of one of them.",
            )
        return named[0]
    if len(found) == 1:
        return found[0]
    if not found:
        raise NoAccelerationError(f"{source} holds no acceleration.", "", "Choose another file.")
    raise InputError(
        f"{source} holds several accelerometers.",
        f"Sets of axes: {listed}.",
        "Name the columns of the one that you mean (columns).",
    )
