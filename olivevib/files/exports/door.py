"""The door to all exports: a trajectory into a file or stream of the format that was asked for."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from olivevib.errors import UsageError
from olivevib.files.atomic import replacing
from olivevib.files.exports.facts import ExportFacts, only_markers
from olivevib.reconstruction.trajectory import Trajectory

Writer = Callable[[Trajectory, ExportFacts, BinaryIO], None]


_MODULES = {
    "csv": "csv_rows",
    "txt": "txt_columns",
    "h5": "hdf5",
    "dxf": "dxf",
    "step": "step",
    "iges": "iges",
    "ply": "ply",
    "uff": "uff",
    "c3d": "c3d",
    "trc": "trc",
    "mat": "mat",
    "parquet": "parquet",
}
FORMATS: tuple[str, ...] = tuple(_MODULES)
EVEN = ("c3d", "trc")  # one rate for all rows: they hold ``even_part`` of the path


def export(
    trajectory: Trajectory,
    to: str,
    target: Path | BinaryIO,
    facts: ExportFacts | None = None,
    ids: tuple[int, ...] | None = None,
) -> None:
    """Write the paths of the markers ``ids`` (None: all) as ``to`` into a file or binary stream.

    A file appears whole or not at all; the same trajectory gives the same bytes. Gaps stay gaps.
    Raises UsageError for an unknown format or id, InputError where the disk refuses the file or its
    folder is not there.
    """
    writer = _writer(to)
    chosen = only_markers(trajectory, ids)
    facts = facts or ExportFacts()
    if isinstance(target, Path):
        _write_whole(target, lambda out: writer(chosen, facts, out))
    else:
        writer(chosen, facts, target)


def _writer(to: str) -> Writer:
    """``write_csv`` and so on; a format's module is loaded when it is asked for."""
    if to in _MODULES:
        module = importlib.import_module(f"olivevib.files.exports.{_MODULES[to]}")
        writer: Writer = getattr(module, f"write_{to}")
        return writer
    near = difflib.get_close_matches(to, FORMATS, n=1)
    raise UsageError(
        f"--to {to}: there is no such export format.",
        f"Did you mean {near[0]}?" if near else "",
        "The formats are " + ", ".join(FORMATS) + ".",
    )


def _write_whole(path: Path, write: Callable[[BinaryIO], None]) -> None:
    """Write beside ``path``, sync, rename: a reader sees the old file or the new one."""
    with replacing(path) as beside, beside.open("wb") as out:
        write(out)
