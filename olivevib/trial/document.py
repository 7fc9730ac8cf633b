"""``trial.toml`` on disk: all faults at once with the nearest key; comments survive editing."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from pydantic import BaseModel, ValidationError
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Table

from olivevib.errors import InputError, UsageError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.trial_folders import FILE
from olivevib.trial.settings import TrialSettings

REMEDY = "Correct the file with any text editor and run again; nothing that was measured is lost."
LARGEST_BYTES = 1_000_000
LIST_OF_TABLES = "accelerometers"  # set as a whole: [{file = "…", marker = 1}]


def read_settings(folder: Path) -> TrialSettings:
    """The validated settings of a trial; InputError names the file and every fault."""
    path = folder / FILE
    document = _load(path)
    try:
        return TrialSettings.model_validate(document.unwrap())
    except ValidationError as error:
        faults = "\n".join(f"  {fault}" for fault in describe_faults(error, TrialSettings))
        raise InputError(f"{path} has {error.error_count()} fault(s):", faults, REMEDY) from None


def change_settings(folder: Path, changes: Mapping[str, Any]) -> TrialSettings:
    """Set dotted keys ("detection.fill") in trial.toml, comments kept; None removes a key.

    Nothing is written when a change is not valid (UsageError with the nearest key).
    """
    path = folder / FILE
    document = _load(path)
    for key, value in changes.items():
        _set(document, key, value)
    try:
        settings = TrialSettings.model_validate(document.unwrap())
    except ValidationError as error:
        faults = "\n".join(f"  {fault}" for fault in describe_faults(error, TrialSettings))
        what = ", ".join(changes)
        raise UsageError(f"cannot set {what} in {path}:", faults, "Nothing was changed.") from None
    write_text_atomic(path, tomlkit.dumps(document))
    return settings


def describe_faults(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """One line a fault: the key with its path, what is wrong, and the nearest key there is."""
    lines = []
    for fault in error.errors():
        location = [str(part) for part in fault["loc"]]
        key = ".".join(location)
        if fault["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
            near = difflib.get_close_matches(location[-1], _keys_at(model, location[:-1]), 1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            lines.append(f"{key}: there is no such key{hint}")
        else:
            message = fault["msg"].removeprefix("Value error, ")
            given = fault.get("input")
            shown = "" if isinstance(given, dict) else f" (it says {given!r})"
            lines.append(f"{key}: {message[0].lower()}{message[1:]}{shown}")
    return lines


def _keys_at(model: type[BaseModel], path: list[str]) -> list[str]:
    """The keys that may stand in the table at ``path``."""
    kind: Any = model
    for part in path:
        if part.isdigit():
            continue
        field = kind.model_fields.get(part) if hasattr(kind, "model_fields") else None
        if field is None:
            return []
        inner = [a for a in getattr(field.annotation, "__args__", ()) if a is not Ellipsis]
        kind = inner[0] if inner else field.annotation
    if hasattr(kind, "model_fields"):
        return list(kind.model_fields)
    return [f.name for f in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else []


def _load(path: Path) -> tomlkit.TOMLDocument:
    if not path.is_file():
        raise InputError(
            f"{path.parent} is not a trial: it holds no {FILE}.",
            "",
            "Make one with: olivevib new TRIAL --left FILE --right FILE",
        )
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path} is larger than 1 MB.", "That is no trial record.", REMEDY)
    try:
        return tomlkit.parse(path.read_text(encoding="utf-8"))
    except (TOMLKitError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read:", f"  {error}", REMEDY) from None


def _set(document: tomlkit.TOMLDocument, dotted: str, value: Any) -> None:
    *tables, key = dotted.split(".")
    if not tables and key != LIST_OF_TABLES:
        raise UsageError(f"{dotted!r} names no setting.", "", "Write it as table.key=value.")
    table: Any = document
    for name in tables:
        if name not in table:
            table[name] = tomlkit.table()
        table = table[name]
        if not isinstance(table, Table | dict):
            raise UsageError(f"{dotted!r}: {name} is a value, not a table.", "", "Check the key.")
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value
