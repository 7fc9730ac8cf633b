"""Detections of one frame as bytes, so that a resumed run goes on with exactly the same numbers."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.detection import Detection

_HEAD = struct.Struct("<d?")  # stamp, damaged
_RECORD = np.dtype(
    [
        ("id", "<i8"),
        ("bit_errors", "<i8"),
        ("localiser", "S24"),
        ("flags", "S128"),
        ("values", "<f8", (83,)),
    ]
)


@dataclass(frozen=True)
class FrameObservations:
    """What one delivered frame of one camera gave; stamp_s NaN where it carries none."""

    stamp_s: float
    damaged: bool
    detections: tuple[Detection, ...]


def pack(seen: FrameObservations) -> bytes:
    """The observations as bytes, exact to the last bit."""
    table = np.zeros(len(seen.detections), _RECORD)
    for row, d in zip(table, seen.detections, strict=True):
        row["id"], row["bit_errors"] = d.id, d.bit_errors
        row["localiser"], row["flags"] = d.localiser.encode(), ",".join(d.flags).encode()
        row["values"] = _values(d)
    return _HEAD.pack(seen.stamp_s, seen.damaged) + table.tobytes()


def unpack(data: bytes) -> FrameObservations:
    """The observations that ``pack`` made bytes of."""
    stamp_s, damaged = _HEAD.unpack_from(data)
    table = np.frombuffer(data, _RECORD, offset=_HEAD.size)
    return FrameObservations(stamp_s, damaged, tuple(_detection(row) for row in table))


def _values(d: Detection) -> Floats:
    parts = (d.corners_px, d.corners_cov_px2, d.centre_px, d.centre_cov_px2, d.raw_row)
    return np.concatenate([np.ravel(part) for part in parts])


def _detection(row: np.void) -> Detection:
    corners, corners_cov, centre, centre_cov, raw_row = np.split(row["values"], [8, 72, 74, 78])
    flags = row["flags"].decode()
    return Detection(
        id=int(row["id"]),
        corners_px=corners.reshape(4, 2),
        corners_cov_px2=corners_cov.reshape(8, 8),
        centre_px=centre,
        centre_cov_px2=centre_cov.reshape(2, 2),
        raw_row=raw_row,
        localiser=row["localiser"].decode(),
        bit_errors=int(row["bit_errors"]),
        flags=tuple(flags.split(",")) if flags else (),
    )
