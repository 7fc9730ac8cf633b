"""What the app remembers between two starts: theme, last trial, screen, marker."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from olivevib.errors import OlivevibError
from olivevib.tui.themes import DARK

LARGEST_BYTES = 20_000


@dataclass(frozen=True)
class Kept:
    """The state of the app that outlives it; ``trial`` is a name under ``trials/``."""

    theme: str = DARK
    trial: str = ""
    screen: str = ""
    marker: int = -1
    plane: int = 0
    axis: str = "all"
    folder: str = ""  # where a file was last picked

    def with_(self, **changes: Any) -> Kept:
        """The same with some values changed."""
        return replace(self, **changes)


def place_of(workspace: Path) -> Path:
    """The file of a workspace; derived data that may be deleted at any time."""
    return workspace / ".olivevib" / "app.json"


def read_kept(workspace: Path) -> Kept:
    """What was kept, or the defaults where there is nothing that can be used."""
    path = place_of(workspace)
    try:
        if path.stat().st_size > LARGEST_BYTES:
            return Kept()
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return Kept()
    if not isinstance(record, dict):
        return Kept()
    kinds = {f.name: type(f.default) for f in fields(Kept)}
    return Kept().with_(**{k: v for k, v in record.items() if type(v) is kinds.get(k)})


def write_kept(workspace: Path, kept: Kept) -> bool:
    """Keep it, in a workspace only; False where the disk would not have it (nothing is lost)."""
    if not (workspace / "trials").is_dir():
        return False
    from olivevib.files.atomic import write_text_atomic

    path = place_of(workspace)
    try:
        path.parent.mkdir(exist_ok=True)
        write_text_atomic(path, json.dumps(asdict(kept), indent=1))
    except (OSError, OlivevibError):
        return False
    return True
