"""The side-car of a recording: one line a frame, written when the frame is, and what it proves.

``NAME.stamps.csv`` beside ``NAME.nut``. Columns: sequence (from 0), stamp_us (the frame's time
stamp, equal to the container's), stamp_kind, device_stamp_ns (the camera's own, may be empty),
host_monotonic_ns (this computer's clock at arrival), size_bytes and crc32 of the coded picture,
exposure_us and gain (as the driver told, may be empty), line_crc32 of the line before it. A line is
one append of less than a disk block: a killed recorder leaves whole lines.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from olivevib.errors import InputError

SUFFIX = ".stamps.csv"
COLUMNS = (
    *("sequence", "stamp_us", "stamp_kind", "device_stamp_ns", "host_monotonic_ns"),
    *("size_bytes", "crc32", "exposure_us", "gain", "line_crc32"),
)
HEADER = (",".join(COLUMNS) + "\n").encode("ascii")
MAX_BYTES = 2_000_000_000


class Line(NamedTuple):
    """What is written of one frame."""

    sequence: int
    stamp_us: int
    stamp_kind: str
    device_ns: int | None
    host_ns: int
    size: int
    crc32: int
    exposure_us: float | None = None
    gain: float | None = None

    def encode(self) -> bytes:
        """The line as it stands in the file."""
        cells = (
            *(str(self.sequence), str(self.stamp_us), self.stamp_kind, _cell(self.device_ns)),
            *(str(self.host_ns), str(self.size), f"{self.crc32:08x}"),
            *(_cell(self.exposure_us), _cell(self.gain)),
        )
        text = (",".join(cells) + ",").encode("ascii")
        return text + b"%08x\n" % zlib.crc32(text)


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.12g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class SideCar:
    """A side-car as it was read: sound lines in order, and the numbers of lines that are not."""

    path: Path
    lines: tuple[Line, ...]
    damaged: tuple[int, ...]


def sidecar_of(video: Path) -> Path:
    """Where the side-car of a recording stands."""
    return video.with_name(video.stem + SUFFIX)


def read_sidecar(path: Path) -> SideCar | None:
    """Read a side-car; None for a file that is none. InputError where it cannot be read."""
    try:
        with path.open("rb") as file:
            if not _is_header(file.readline(len(HEADER)).rstrip(b"\n")):
                return None
            rest = file.read(MAX_BYTES).split(b"\n")
    except OSError as error:
        raise InputError(f"{path} cannot be read.", error.strerror or str(error), "") from error
    lines, damaged = [], []
    for number, text in enumerate(rest, start=2):
        line = _decoded(text)
        if line is not None:
            lines.append(line)
        elif text:
            damaged.append(number)
    return SideCar(path, tuple(lines), tuple(damaged))


def _is_header(first: bytes) -> bool:
    """True also where a few letters of the header were altered: the lines speak for themselves."""
    wanted = HEADER[:-1]
    same = sum(a == b for a, b in zip(first, wanted, strict=False))
    return len(first) == len(wanted) and same >= len(wanted) // 2


def _decoded(text: bytes) -> Line | None:
    body, _, check = text.rpartition(b",")
    if len(check) != 8 or b"%08x" % zlib.crc32(body + b",") != check:
        return None
    cells = body.decode("ascii", "replace").split(",")
    if len(cells) != len(COLUMNS) - 1:
        return None
    try:
        return Line(
            sequence=int(cells[0]),
            stamp_us=int(cells[1]),
            stamp_kind=cells[2],
            device_ns=int(cells[3]) if cells[3] else None,
            host_ns=int(cells[4]),
            size=int(cells[5]),
            crc32=int(cells[6], 16),
            exposure_us=float(cells[7]) if cells[7] else None,
            gain=float(cells[8]) if cells[8] else None,
        )
    except ValueError:
        return None
