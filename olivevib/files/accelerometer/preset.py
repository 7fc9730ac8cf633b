"""How the files of one make of logger are read, kept as a TOML file for other trials."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from olivevib.errors import InputError
from olivevib.files.accelerometer.record import ImportOptions
from olivevib.files.atomic import write_text_atomic

_NOT_KEPT = ("start",)  # of one recording alone
_LISTS = ("columns", "axes")
_NUMBERS = ("per_g", "rate_hz")


def write_preset(path: Path, options: ImportOptions) -> None:
    """Keep options for other files of the same logger; its start time is left out."""
    document = tomlkit.document()
    document.add(tomlkit.comment("How olivevib reads the files of one accelerometer."))
    for name, value in asdict(options).items():
        if value and name not in _NOT_KEPT:
            document[name] = list(value) if isinstance(value, tuple) else value
    write_text_atomic(path, tomlkit.dumps(document))


def read_preset(path: Path) -> ImportOptions:
    """The options of a preset; InputError names the file and the key at fault."""
    try:
        found = tomlkit.parse(path.read_text(encoding="utf-8")).unwrap()
    except FileNotFoundError as error:
        raise InputError(
            f"the preset {path} is missing.",
            "",
            "Keep one with olivevib preset TRIAL NAME, or clear accelerometers.preset.",
        ) from error
    except (OSError, UnicodeDecodeError, TOMLKitError) as error:
        raise InputError(f"the preset {path} cannot be read.", str(error), _REMEDY) from error
    known = {f.name for f in fields(ImportOptions)}
    bad = [name for name, value in found.items() if name not in known or not _fits(name, value)]
    if bad:
        keys = ", ".join(sorted(known))
        raise InputError(
            f"{path}: {bad[0]} = {found[bad[0]]!r} is not possible.", f"Keys: {keys}.", _REMEDY
        )
    lists = {name: tuple(found[name]) for name in _LISTS if name in found}
    return ImportOptions(**(found | lists))


_REMEDY = "Correct it with any text editor, or keep a new one with olivevib preset."


def _fits(name: str, value: Any) -> bool:
    if name in _LISTS:
        return isinstance(value, list) and all(isinstance(v, str) for v in value)
    if name in _NUMBERS:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(value, str)
