"""Parts of a long study that are kept as soon as they are measured; a later run goes on from there.

A cell is measured anew where the draws or any source file of the measuring rooms differ.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import olivevib
from olivevib.files.atomic import write_text_atomic

FOLDER = Path("reports/benchmark/cells")
BESIDES = ("tui", "report", "cli", "batch", "studies", "trial", "files")  # measure nothing


def kept(study: str, name: str, draw: Any, measure: Callable[[], Any]) -> Any:
    """What ``measure`` gave (lists, dicts, numbers, words), from its cell or measured now.

    draw: all that the cell was drawn with, as JSON can hold it. NaN survives.
    """
    path = FOLDER / study / f"{name}.json"
    key = {"source": source_stamp(), "draw": json.loads(json.dumps(draw))}
    if path.is_file():
        told = json.loads(path.read_text(encoding="utf-8"))
        if told["key"] == key:
            return _restored(told["measured"])
    measured = measure()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text_atomic(path, json.dumps({"key": key, "measured": _plain(measured)}, indent=1))
    return _restored(_plain(measured))


@cache
def source_stamp() -> str:
    """SHA-256 of the sources of all rooms that measure."""
    root = Path(olivevib.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        inside = path.relative_to(root)
        if inside.parts[0] not in BESIDES:
            digest.update(inside.as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def _plain(value: Any) -> Any:
    """JSON has neither NaN nor infinity: they are kept as words."""
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": str(value)}
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return [_plain(v) for v in value] if isinstance(value, list | tuple) else value


def _restored(value: Any) -> Any:
    if isinstance(value, dict):
        return float(value["float"]) if set(value) == {"float"} else _each(value)
    return [_restored(v) for v in value] if isinstance(value, list) else value


def _each(value: dict[str, Any]) -> dict[str, Any]:
    return {k: _restored(v) for k, v in value.items()}
