"""What is in a folder, for picking: folders first, then files with their size."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from rich.text import Text

from olivevib.tui.harmless import harmless

MOST = 500  # entries shown: more are found by typing
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


@dataclass(frozen=True)
class Entry:
    """A file or a folder; size in bytes of a file."""

    path: Path
    folder: bool
    size: int = 0


def entries_of(folder: Path, words: str = "") -> tuple[Entry, ...]:
    """Folders, then files, as a person counts (2 before 10), whose names hold every word.

    Hidden ones are left out. Raises OSError where the folder cannot be read.
    """
    wanted = words.lower().split()
    found = []
    for path in folder.iterdir():
        name = path.name.lower()
        if not name.startswith(".") and all(word in name for word in wanted):
            is_folder = path.is_dir()
            found.append(Entry(path, is_folder, 0 if is_folder else _size(path)))
    return tuple(sorted(found, key=lambda e: (not e.folder, _natural(e.path.name)))[:MOST])


def pictures_in(folder: Path) -> int:
    """How many pictures a folder holds; 0 where it cannot be read."""
    try:
        return sum(p.suffix.lower() in PICTURES for p in folder.iterdir())
    except OSError:
        return 0


def entry_text(entry: Entry) -> Text:
    """One line: the name, and what it is."""
    pictures = pictures_in(entry.path) if entry.folder else 0
    held = f"{pictures} pictures" if pictures else ""
    about = held if entry.folder else bytes_words(entry.size)
    name = f"▸ {harmless(entry.path.name, 60)}/" if entry.folder else harmless(entry.path.name, 60)
    return Text(f"{name:<44} {about:>12}", no_wrap=True)


def bytes_words(size: int) -> str:
    """A size as a person reads it."""
    if size < 1000:
        return f"{size} bytes"
    for unit, factor in (("kB", 1e3), ("MB", 1e6)):
        if size < 1000 * factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size / 1e9:.3g} GB"


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _natural(name: str) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", name.lower())
    return [(int(p), "") if p.isdigit() else (-1, p) for p in parts]
