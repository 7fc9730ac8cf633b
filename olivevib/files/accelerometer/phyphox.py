"""phyphox recordings: a folder or zip archive of CSV files with the absolute times beside them."""

from __future__ import annotations

import csv
import io
import zipfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import InputError
from olivevib.files.accelerometer.arrays import check_archive
from olivevib.files.accelerometer.foreign import foreign_parser
from olivevib.files.accelerometer.names import meaning
from olivevib.files.accelerometer.record import ImportOptions, Table
from olivevib.files.accelerometer.text import read_text
from olivevib.files.accelerometer.units import ACCELERATION

TIMES = "meta/time.csv"
_LARGEST_META = 2**20


def read_folder(folder: Path, options: ImportOptions) -> Table:
    """The acceleration among a folder's CSV files, with its absolute start where it is told."""
    names = sorted(p.name for p in folder.iterdir() if p.suffix.casefold() in (".csv", ".txt"))
    if not names:
        raise InputError(
            f"{folder} holds no CSV file.", "", "Give the logger's file, or phyphox' folder."
        )
    return _best(
        {n: (folder / n).read_bytes() for n in names[:20]}, options, folder.name, beside(folder)
    )


def read_archive(data: bytes, options: ImportOptions, source: str) -> Table:
    """The acceleration among the CSV files of a zip archive."""
    with foreign_parser(source, "zip archive"):
        members = {m.filename: m for m in check_archive(data, source)}
        names = [n for n in members if n.casefold().endswith(".csv")]
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            files = {n: archive.read(n) for n in names[:40]}
    meta = next((files.pop(n) for n in list(files) if n.casefold().endswith(TIMES)), b"")
    own = {n: f for n, f in files.items() if "meta" not in PurePosixPath(n).parts}
    if not own:
        raise InputError(
            f"{source} is an archive without a CSV file.",
            "It holds " + (", ".join(list(members)[:8]) or "nothing") + ".",
            "Spreadsheets must be saved as CSV; an NPZ must hold .npy arrays.",
        )
    return _best(own, options, source, meta)


def beside(folder: Path) -> bytes:
    """The bytes of ``meta/time.csv`` in a folder; empty where there is none."""
    path = folder / TIMES
    small = path.is_file() and path.stat().st_size <= _LARGEST_META
    return path.read_bytes() if small else b""


def _best(files: dict[str, bytes], options: ImportOptions, source: str, meta: bytes) -> Table:
    """The file that holds accelerations with gravity, else linear acceleration, else the first."""
    tables: list[tuple[int, str, Table]] = []
    refusals: list[str] = []
    for name, data in files.items():
        try:
            table = read_text(data, options, f"{source}/{name}")
        except InputError as error:
            refusals.append(f"{name}: {error.what}")
            continue
        tables.append((_rank(table), name, table))
    if not tables:
        raise InputError(
            f"{source} holds no readable table.", "; ".join(refusals[:5]), "Export it again as CSV."
        )
    rank, name, table = min(tables, key=lambda found: found[:2])
    same = [n for r, n, _ in tables if r == rank]
    if rank == 0 and len(same) > 1:
        raise InputError(
            f"{source} holds several accelerometer files.",
            "They are " + ", ".join(same) + ".",
            "Give one of them.",
        )
    return with_times(replace(table, format="phyphox" if meta else table.format), meta)


def _rank(table: Table) -> int:
    found = {m.quantity for m in (meaning(c.name, c.unit) for c in table.channels) if m.axis}
    return 0 if ACCELERATION in found else 1 if "linear acceleration" in found else 2


def with_times(table: Table, meta: bytes) -> Table:
    """The table with phyphox' absolute start; stamps after a pause are moved by its length."""
    events = _events(meta)
    if not events:
        return table
    start_s = events[0][1] - events[0][0]
    start = datetime.fromtimestamp(start_s, tz=UTC)
    at = next((k for k, c in enumerate(table.channels) if meaning(c.name).quantity == "time"), None)
    if at is None or len(events) == 1:
        return replace(table, start=start)
    channel = table.channels[at]
    moved = replace(channel, values=_moved(channel.values, events, start_s))
    channels = (*table.channels[:at], moved, *table.channels[at + 1 :])
    return replace(table, start=start, channels=channels)


def _events(meta: bytes) -> list[tuple[float, float]]:
    """(experiment time, system time) of each START, s."""
    rows = csv.reader(io.StringIO(meta.decode("utf-8", errors="replace")))
    found = []
    for row in rows:
        if len(row) >= 3 and row[0].strip() == "START":
            try:
                found.append((float(row[1].replace(",", ".")), float(row[2].replace(",", "."))))
            except ValueError:
                continue
    plausible = all(9e8 < system < 5e9 and 0 <= own < 1e7 for own, system in found)
    return found if plausible else []


def _moved(t_s: Floats, events: list[tuple[float, float]], start_s: float) -> Floats:
    own = np.array([e[0] for e in events])
    shift = np.array([e[1] - e[0] - start_s for e in events])
    which = np.clip(np.searchsorted(own, t_s, side="right") - 1, 0, len(events) - 1)
    return np.asarray(t_s + np.maximum.accumulate(shift)[which])
