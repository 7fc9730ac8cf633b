"""The workspace's book of cameras: what was measured of each, in each of its modes.

``cameras.toml`` beside trials/: one ``[[camera]]`` a camera and mode, with its row time.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from olivevib.errors import InputError
from olivevib.files.atomic import write_text_atomic

FILE = "cameras.toml"
BOARD = "waved board"  # how the source of such an entry begins
SAME_FPS = 0.02  # a share: nominal and true rate of one mode differ by less


@dataclass(frozen=True)
class CameraMode:
    """A camera and how it runs: serial number, or its title where it has none; size; frames/s."""

    camera: str
    size_px: tuple[int, int]
    fps: float

    def same(self, other: CameraMode) -> bool:
        """Whether both are one camera in one mode."""
        near = abs(self.fps - other.fps) <= SAME_FPS * max(self.fps, other.fps)
        return self.camera == other.camera and self.size_px == other.size_px and near


@dataclass(frozen=True)
class Entry:
    """A measured row time, µs per raw row, signed; source says how it was found."""

    mode: CameraMode
    row_time_us: float
    sigma_us: float
    source: str

    @property
    def kind(self) -> str:
        """What measured it, as trial.toml says it: "led" or "board"."""
        return "board" if self.source.startswith(BOARD) else "led"


def workspace_of(folder: Path) -> Path | None:
    """The workspace that a trial's folder, or a file in it, belongs to; None outside of one."""
    for place in (folder.resolve(), *folder.resolve().parents):
        if (place / "trials").is_dir():
            return place
    return None


def read_book(workspace: Path) -> list[Entry]:
    """Every entry; none where there is no book. InputError, naming the fault, for a broken one."""
    path = workspace / FILE
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
        return [_entry(row) for row in told.get("camera", [])]
    except FileNotFoundError:
        return []
    except (OSError, tomllib.TOMLDecodeError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path} cannot be read.",
            f"{type(error).__name__}: {error}",
            "Correct it, or remove it and measure the row times again: olivevib rowtime",
        ) from error


def recall(workspace: Path, mode: CameraMode) -> Entry | None:
    """What was measured of a camera in this mode; None if nothing was."""
    return next((e for e in read_book(workspace) if e.mode.same(mode)), None)


def remember(workspace: Path, entry: Entry) -> Path:
    """Write an entry into the book, in the place of an older one of the same camera and mode."""
    kept = [e for e in read_book(workspace) if not e.mode.same(entry.mode)]
    doc = tomlkit.document()
    doc.add(tomlkit.comment("Row times of this workspace's cameras (olivevib rowtime)."))
    rows = tomlkit.aot()
    for each in sorted([*kept, entry], key=lambda e: (e.mode.camera, e.mode.size_px, e.mode.fps)):
        row = tomlkit.table()
        row["camera"] = each.mode.camera
        row["size_px"] = list(each.mode.size_px)
        row["fps"] = each.mode.fps
        row["row_time_us"] = each.row_time_us
        row["row_time_sigma_us"] = each.sigma_us
        row["source"] = each.source
        rows.append(row)
    doc["camera"] = rows
    path = workspace / FILE
    write_text_atomic(path, tomlkit.dumps(doc))
    return path


def _entry(row: dict[str, Any]) -> Entry:
    width, height = row["size_px"]
    mode = CameraMode(str(row["camera"]), (int(width), int(height)), float(row["fps"]))
    return Entry(
        mode, float(row["row_time_us"]), float(row["row_time_sigma_us"]), str(row["source"])
    )
