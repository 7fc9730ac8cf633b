"""The door of the importer: an accelerometer file of any make, by what its first bytes say."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from olivevib.errors import InputError
from olivevib.files.accelerometer.arrays import is_mat, is_npy, read_mat, read_npy, read_npz
from olivevib.files.accelerometer.ide import is_ide, read_ide
from olivevib.files.accelerometer.interpret import interpret
from olivevib.files.accelerometer.lvm import is_lvm, read_lvm
from olivevib.files.accelerometer.phyphox import (
    beside,
    read_archive,
    read_folder,
    with_times,
)
from olivevib.files.accelerometer.record import AccelerometerRecord, ImportOptions, Table
from olivevib.files.accelerometer.text import read_text
from olivevib.files.accelerometer.uff import is_uff, read_uff
from olivevib.files.accelerometer.wav import is_wav, read_wav

LARGEST_BYTES = 2**31


def read_accelerometer(path: Path, options: ImportOptions | None = None) -> AccelerometerRecord:
    """Read an accelerometer file of any known format as acceleration in m/s2 on its own clock.

    path: a file, or a folder as phyphox exports it; it is never changed. Raises InputError (what,
    why, remedy) where it is no acceleration, where its unit or times are not certain, or where it
    cannot be read; UsageError where an option contradicts it. Gravity stays in, gaps stay gaps.
    """
    options = options or ImportOptions()
    path = Path(path)
    try:
        table = (
            read_folder(path, options)
            if path.is_dir()
            else _read_table(_bytes(path), options, path)
        )
    except OSError as error:
        raise InputError(
            f"{path} cannot be read.", str(error.strerror or error), "Check its permissions."
        ) from error
    return interpret(table, options, path.name)


def _bytes(path: Path) -> bytes:
    if not path.is_file():
        raise InputError(
            f"{path} is no file." if path.exists() else f"{path} is not there.",
            "",
            "Give the accelerometer's recording as the logger wrote it.",
        )
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(
            f"{path.name} is larger than 2 GiB.", "", "Cut the shaking out with the logger's tool."
        )
    return path.read_bytes()


def _read_table(data: bytes, options: ImportOptions, path: Path) -> Table:
    """The reader that the first bytes ask for; what is no known recording is tried as text."""
    head, source = data[:2000], path.name
    for fits, read in _READERS:
        if fits(head):
            return read(data, source)
    if is_ide(head):
        return read_ide(path, options)
    if head.startswith(b"PK\x03\x04"):
        packed = b".npy" in head[:200]
        return read_npz(data, source) if packed else read_archive(data, options, source)
    for magic, what in _FOREIGN:
        if head.startswith(magic):
            raise InputError(
                f"{source} is {what}.", "This format is not read.", "Export it as CSV."
            )
    table = read_text(data, options, source)
    return with_times(table, beside(path.parent)) if _looks_like_phyphox(table) else table


def _looks_like_phyphox(table: Table) -> bool:
    return bool(table.channels) and table.channels[0].name == "Time (s)" and not table.metadata[1:]


_READERS: tuple[tuple[Callable[[bytes], bool], Callable[[bytes, str], Table]], ...] = (
    (is_lvm, read_lvm),
    (is_uff, read_uff),
    (is_wav, read_wav),
    (is_mat, read_mat),
    (is_npy, read_npy),
)
_FOREIGN = (
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file (as MATLAB 7.3 writes it; save with -v7)"),
    (b"TDSm", "a LabVIEW TDMS file"),
    (b"\x1a\x45\xdf\xa3", "an EBML or Matroska file"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file"),
    (b"\x1f\x8b", "packed with gzip"),
    (b"SQLite format 3", "an SQLite database"),
    (b"%PDF", "a PDF"),
    (b"\x89PNG", "a picture"),
)
