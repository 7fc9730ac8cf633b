"""The door of the importer: an accelerometer file of any make, by what its first bytes say."""

from __future__ import annotations

from pathlib import Path

from olivevib.errors import InputError
from olivevib.files.accelerometer.interpret import interpret
from olivevib.files.accelerometer.record import AccelerometerRecord, ImportOptions, Table
from olivevib.files.accelerometer.text import read_text

LARGEST_BYTES = 2**31


def read_accelerometer(path: Path, options: ImportOptions | None = None) -> AccelerometerRecord:
    """Read an accelerometer file of any known format as acceleration in m/s2 on its own clock.

    The file is never changed. Raises InputError (what, why, remedy) where it is no acceleration,
    where its unit or times are not certain, or where it cannot be read; UsageError where an option
    contradicts it. Gravity is not removed, gaps are not filled.
    """
    options = options or ImportOptions()
    path = Path(path)
    table = _read_table(_bytes(path), options, path)
    return interpret(table, options, path.name)


def _bytes(path: Path) -> bytes:
    try:
        if not path.is_file():
            raise InputError(
                f"{path} is not there." if not path.exists() else f"{path} is no file.",
                "",
                "Give the accelerometer's recording as the logger wrote it.",
            )
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(
                f"{path.name} is larger than 2 GiB.",
                "",
                "Cut the shaking out with the logger's tool.",
            )
        return path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path} cannot be read.", str(error.strerror or error), "Check its permissions."
        ) from error


def _read_table(data: bytes, options: ImportOptions, path: Path) -> Table:
    return read_text(data, options, path.name)
