"""True time stamps of frames from a text file that the recorder wrote beside the video.

One stamp a line, or a table whose columns say what they are; several cameras may share a file.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import InputError, UsageError
from olivevib.files.capture.sidecar import SideCar, read_sidecar

TIMES = (
    *("frame_time", "stamp", "timestamp", "time_stamp", "frame_timestamp", "time", "t"),
    *("pts_time", "capture_time", "device_stamp", "device_time", "host_monotonic", "host_time"),
)
CAMERAS = ("cam_id", "camera", "camera_id", "cam", "port")
SEQUENCES = (
    *("frame_index", "sequence", "seq", "frame_number", "frame_id", "frame", "sync_index", "index"),
)
UNITS = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), Decimal(1)),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), Decimal("1e-3")),
    **dict.fromkeys(("us", "µs", "μs", "usec", "microsecond", "microseconds"), Decimal("1e-6")),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), Decimal("1e-9")),
}
MAX_BYTES = 200_000_000


@dataclass(frozen=True)
class _Row:
    line: int
    time: Decimal
    camera: str | None
    sequence: Decimal | None


@dataclass(frozen=True)
class _Columns:
    """Which column is what; None where the table has none."""

    time: int
    unit: Decimal
    camera: int | None
    sequence: int | None


def read_stamp_file(path: str | Path, video_name: str, frames: int) -> Floats:
    """Time stamps (frames,) of one video from a stamp file, s, in the order of the frames.

    path: the file, or "FILE#CAMERA" where several cameras share it; without it the camera is the
    one whose id stands in video_name (cam_0.mp4: 0). Units are read from the column's name
    (s, ms, us, ns), seconds without one. Rows may stand in any order: they are sorted by the
    frame column, or by time where there is none.
    Raises UsageError where the camera is not clear, InputError where the file cannot be read,
    holds another number of stamps than the video has frames, or stamps that do not increase.
    """
    file, asked = _split(path)
    sidecar = read_sidecar(file) if file.is_file() else None
    if sidecar is not None:
        return _of_recorder(sidecar, video_name, frames)
    rows = _rows(file)
    camera = _camera(file, rows, video_name, asked)
    mine = [row for row in rows if camera is None or row.camera == camera]
    if len(mine) != frames:
        whose = "" if camera is None else f" for camera {camera}"
        raise _wrong_count(file, len(mine), whose, video_name, frames)
    return _in_order(file, mine)


def _of_recorder(sidecar: SideCar, video_name: str, frames: int) -> Floats:
    """Stamps from the side-car of olivevib's own recorder: line k belongs to frame k.

    A recorder that was killed may have left the line of a frame that it could not write any more.
    """
    if len(sidecar.lines) < frames:
        raise _wrong_count(sidecar.path, len(sidecar.lines), "", video_name, frames)
    return np.array([line.stamp_us * 1e-6 for line in sidecar.lines[:frames]], dtype=np.float64)


def _wrong_count(file: Path, found: int, whose: str, video_name: str, frames: int) -> InputError:
    return InputError(
        f"{file} holds {found} time stamps{whose}, but {video_name} has {frames} frames.",
        "They must belong to the same recording, one stamp a frame.",
        "Give the stamp file of this recording, or cut neither of the two.",
    )


def pick_camera(path: str | Path, video_name: str) -> str | None:
    """Whose stamps ``read_stamp_file`` would take: a camera id, None if the file has only one.

    Raises as ``read_stamp_file`` does, except for the count.
    """
    file, asked = _split(path)
    return _camera(file, _rows(file), video_name, asked)


def _split(path: str | Path) -> tuple[Path, str | None]:
    """The file, and the camera of "FILE#CAMERA"; a file whose own name holds a # is that file."""
    text = str(path)
    if Path(text).is_file() or "#" not in text:
        return Path(text), None
    name, camera = text.rsplit("#", 1)
    return Path(name), camera.strip()


def _rows(file: Path) -> list[_Row]:
    lines = _lines(file)
    if not lines:
        raise InputError(f"{file} holds no time stamps.", "It is empty.", "Give the right file.")
    delimiter = _delimiter(lines[0][1], lines[-1][1])
    cells = [(number, _cells(text, delimiter)) for number, text in lines]
    header = cells[0][1]
    if all(_number(cell) is not None for cell in header):
        columns = _without_header(file, header)
    else:
        columns = _with_header(file, header)
        cells = cells[1:]
    return [_row(file, number, row, columns) for number, row in cells]


def _lines(file: Path) -> list[tuple[int, str]]:
    """Lines with something in them and their numbers; comments left out."""
    try:
        if file.stat().st_size > MAX_BYTES:
            raise InputError(
                f"{file} is too large for a list of time stamps.", "", "Give the right file."
            )
        text = file.read_text("utf-8-sig", errors="replace")
    except FileNotFoundError as error:
        raise InputError(
            f"The stamp file {file} does not exist.", "", "Check the name, or put the file there."
        ) from error
    except OSError as error:
        raise InputError(f"The stamp file {file} cannot be read.", str(error), "") from error
    if "\x00" in text:
        raise InputError(f"{file} is not a text file.", "", "Give a table or a list of stamps.")
    numbered = enumerate(text.splitlines(), start=1)
    return [(n, line) for n, line in numbered if line.strip() and line.lstrip()[0] not in "#%"]


def _delimiter(first: str, last: str) -> str:
    """What parts the columns; empty where there is only one (its name may hold a blank)."""
    several = " " if len(last.split()) > 1 else ""
    return next((mark for mark in (";", "\t", ",") if mark in first), several)


def _cells(line: str, delimiter: str) -> list[str]:
    if not delimiter:
        return [line.strip()]
    if delimiter == " ":
        return line.split()
    if delimiter != "," and "." not in line:
        line = line.replace(",", ".")  # decimal commas
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]


def _number(cell: str) -> Decimal | None:
    try:
        value = Decimal(cell)
    except InvalidOperation:
        return None
    return value if value.is_finite() and abs(value.adjusted()) < 30 else None


def _without_header(file: Path, first: Sequence[str]) -> _Columns:
    if len(first) > 1:
        raise InputError(
            f"{file} has {len(first)} columns without names.",
            "Which of them is the time cannot be known.",
            "Add a first line with names, such as: frame_index,time_s",
        )
    return _Columns(0, Decimal(1), None, None)


def _with_header(file: Path, header: Sequence[str]) -> _Columns:
    names = [_name_and_unit(cell) for cell in header]
    plain = [name for name, _ in names]
    camera, sequence = _first(plain, CAMERAS), _first(plain, SEQUENCES)
    time = _first(plain, TIMES)
    left = [k for k in range(len(names)) if k not in (camera, sequence)]
    if time is None and len(left) == 1:
        time = left[0]
    if time is None:
        raise InputError(
            f"{file} has no column of times.",
            f"Its columns are: {', '.join(header)}.",
            "Name the column of times time_s, time_ms, time_us or time_ns.",
        )
    return _Columns(time, names[time][1], camera, sequence)


def _name_and_unit(cell: str) -> tuple[str, Decimal]:
    """A column's name in lower case without its unit, and the unit in seconds."""
    words = [w for w in re.split(r"[^\wµμ]+|_", cell.strip().lower()) if w]
    if len(words) > 1 and words[-1] in UNITS:
        return "_".join(words[:-1]), UNITS[words[-1]]
    name = "_".join(words)
    return name, UNITS.get(name, Decimal(1))


def _first(names: Sequence[str], wanted: Sequence[str]) -> int | None:
    return next((names.index(name) for name in wanted if name in names), None)


def _row(file: Path, line: int, cells: Sequence[str], columns: _Columns) -> _Row:
    def at(column: int | None) -> str | None:
        return cells[column] if column is not None and column < len(cells) else None

    time, sequence = at(columns.time), at(columns.sequence)
    count = _number(sequence) if sequence is not None else None
    stamp = _number(time) if time is not None else None
    bad = time if stamp is None else sequence if columns.sequence is not None else None
    if stamp is None or (columns.sequence is not None and count is None):
        raise InputError(
            f"{file}, line {line}: {bad or 'nothing'!r} is not a number.",
            "Every frame needs its time stamp.",
            "Correct the line, or use the container's stamps by leaving the file out.",
        )
    return _Row(line, stamp * columns.unit, at(columns.camera), count)


def _camera(file: Path, rows: Sequence[_Row], video_name: str, asked: str | None) -> str | None:
    ids = sorted({row.camera for row in rows if row.camera is not None}, key=_natural)
    listed = ", ".join(ids)
    if asked is not None:
        if asked in ids:
            return asked
        raise UsageError(
            f"{file} holds no camera {asked!r}.",
            f"It holds: {listed}." if ids else "It has no column of cameras.",
            "Name one of these after the #." if ids else f"Give {file.name} without #{asked}.",
        )
    if len(ids) < 2:
        return ids[0] if ids else None
    named = _named_in(Path(video_name).stem, ids)
    if named is None:
        raise UsageError(
            f"{file} holds the stamps of several cameras, and the name {video_name} does not say "
            "which.",
            f"Cameras in the file: {listed}.",
            f"Name the camera after a #, such as {file.name}#{ids[0]}",
        )
    return named


def _named_in(stem: str, ids: Sequence[str]) -> str | None:
    """The one id that stands in a name, best after a word such as cam; None if not just one."""
    low = stem.lower()
    after = r"(?:cam|camera|port|view)[^0-9a-z]*{}(?![0-9a-z])"
    alone = r"(?<![0-9a-z]){}(?![0-9a-z])"
    number = r"(?<![0-9]){}(?![0-9])"
    for pattern in (after, alone, number):
        hits = [i for i in ids if re.search(pattern.format(_as_pattern(i)), low)]
        if len(hits) == 1:
            return hits[0]
        if hits:
            return None
    return None


def _as_pattern(camera: str) -> str:
    return f"0*{int(camera)}" if camera.isdecimal() else re.escape(camera.lower())


def _natural(text: str) -> list[tuple[int, int, str]]:
    parts = re.findall(r"[0-9]+|[^0-9]+", text)
    return [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in parts]


def _in_order(file: Path, rows: Sequence[_Row]) -> Floats:
    """The stamps by frame, s, each the nearest float; they must increase."""
    ordered = sorted(rows, key=lambda r: r.time if r.sequence is None else r.sequence)
    for before, row in itertools.pairwise(ordered):
        if row.sequence is not None and row.sequence == before.sequence:
            raise InputError(
                f"{file}, lines {before.line} and {row.line}: the same frame {row.sequence} twice.",
                "",
                "If the file holds several cameras, it needs a column cam_id.",
            )
        if row.time <= before.time:
            raise InputError(
                f"{file}, lines {before.line} and {row.line}: the later frame is not later "
                f"({before.time} s, {row.time} s).",
                "Time stamps must increase from frame to frame.",
                "If the file holds several cameras, it needs a column cam_id.",
            )
    return np.array([float(row.time) for row in ordered], dtype=np.float64)
