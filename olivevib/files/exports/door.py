"""The door to all exports: a trajectory into a file or stream of the format that was asked for."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from olivevib.errors import UsageError
from olivevib.files.atomic import as_input_error, replacing
from olivevib.files.exports.csv_rows import write_csv
from olivevib.files.exports.facts import ExportFacts, only_markers
from olivevib.files.exports.txt_columns import write_txt
from olivevib.reconstruction.trajectory import Trajectory

Writer = Callable[[Trajectory, ExportFacts, BinaryIO], None]


def _h5(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    from olivevib.files.exports.hdf5 import write_h5

    write_h5(trajectory, facts, out)


WRITERS: dict[str, Writer] = {"csv": write_csv, "txt": write_txt, "h5": _h5}
FORMATS: tuple[str, ...] = tuple(WRITERS)


def export(
    trajectory: Trajectory,
    to: str,
    target: Path | BinaryIO,
    facts: ExportFacts | None = None,
    ids: tuple[int, ...] | None = None,
) -> None:
    """Write the paths of the markers ``ids`` (None: all) as ``to`` into a file or binary stream.

    A file appears whole or not at all; the same trajectory gives the same bytes. Gaps stay gaps.
    Raises UsageError for an unknown format or id, InputError where the disk refuses the file.
    """
    writer = _writer(to)
    chosen = only_markers(trajectory, ids)
    facts = facts or ExportFacts()
    if isinstance(target, Path):
        _write_whole(target, lambda out: writer(chosen, facts, out))
    else:
        writer(chosen, facts, target)


def _writer(to: str) -> Writer:
    if to in WRITERS:
        return WRITERS[to]
    near = difflib.get_close_matches(to, FORMATS, n=1)
    raise UsageError(
        f"--to {to}: there is no such export format.",
        f"Did you mean {near[0]}?" if near else "",
        "The formats are " + ", ".join(FORMATS) + ".",
    )


def _write_whole(path: Path, write: Callable[[BinaryIO], None]) -> None:
    """Write beside ``path``, sync, rename: a reader sees the old file or the new one."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise as_input_error(error, path) from error
    with replacing(path) as beside, beside.open("wb") as out:
        write(out)
