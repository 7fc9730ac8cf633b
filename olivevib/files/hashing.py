"""Content hashes of recordings, with a cache so that a big video is read for it only once.

Whether a stage is done or stale is decided by these hashes alone.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from pathlib import Path

from olivevib.errors import InputError
from olivevib.files.atomic import write_text_atomic

CACHE_LIMIT = 5000  # entries; the oldest go first
_SETTLED_S = 2.0  # a file changed this recently may change again within the same time stamp
_BLOCK = 1 << 20
_SYSTEM_NAMES = ("thumbs.db", "desktop.ini")  # written by file managers, no content of the user's

Key = tuple[int, int, int]  # size, mtime_ns, inode


def sha256_file(path: str | Path) -> str:
    """SHA-256 of a file's content as 64 hex digits, read in blocks of 1 MiB; raises InputError."""
    digest = hashlib.sha256()
    try:
        with Path(path).open("rb") as handle:
            while block := handle.read(_BLOCK):
                digest.update(block)
    except OSError as error:
        raise _unreadable(Path(path), error) from error
    return digest.hexdigest()


def sha256_folder(path: str | Path) -> str:
    """SHA-256 of the names and contents of all files in a folder and below, sorted by name.

    Files that begin with a dot and those that file managers leave behind do not count.
    Raises InputError where the folder or a file in it cannot be read.
    """
    return _folder_digest(Path(path), {})


class HashCache:
    """Content hashes remembered by (absolute path, size, modification time, inode).

    Kept in a JSON file that is derived data: where it is missing or damaged it is simply built
    again, and it is never an error. A file changed within the last two seconds is not remembered,
    because it might change again without its time stamp showing it.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._known = _load(self.path)

    def file(self, path: str | Path) -> str:
        """SHA-256 of a file, from the cache where the file is unchanged; raises InputError."""
        name, key = _identity(Path(path))
        known = self._known.get(name)
        if known is not None and known[0] == key:
            return known[1]
        digest = sha256_file(name)
        if _identity(Path(path)) == (name, key) and time.time_ns() - key[1] > _SETTLED_S * 1e9:
            self._remember(name, key, digest)
        return digest

    def folder(self, path: str | Path) -> str:
        """The same value as sha256_folder, each file from the cache where it is unchanged."""
        files = {file: self.file(file) for file in _files(Path(path))}
        return _folder_digest(Path(path), files)

    def of(self, path: str | Path) -> str:
        """SHA-256 of a file or of a folder, whichever ``path`` is; raises InputError."""
        return self.folder(path) if Path(path).is_dir() else self.file(path)

    def _remember(self, name: str, key: Key, digest: str) -> None:
        self._known = {**_load(self.path), **self._known}  # what others found meanwhile
        self._known.pop(name, None)
        self._known[name] = (key, digest)
        keep = list(self._known)[-CACHE_LIMIT:]
        self._known = {file: self._known[file] for file in keep}
        data = {file: [*entry[0], entry[1]] for file, entry in self._known.items()}
        try:
            self.path.parent.mkdir(exist_ok=True)
            write_text_atomic(self.path, json.dumps(data, indent=0) + "\n")
        except (InputError, OSError):
            return  # a cache that cannot be written costs time, never the measurement


def _load(path: Path) -> dict[str, tuple[Key, str]]:
    """The entries of a cache file that make sense; empty where there is none."""
    try:
        data = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(data, dict):
        return {}
    return {name: ((e[0], e[1], e[2]), e[3]) for name, e in data.items() if _sound(e)}


def _sound(entry: object) -> bool:
    if not (isinstance(entry, list) and len(entry) == 4 and isinstance(entry[3], str)):
        return False
    hexadecimal = len(entry[3]) == 64 and set(entry[3]) <= set("0123456789abcdef")
    return hexadecimal and all(type(number) is int for number in entry[:3])


def _identity(path: Path) -> tuple[str, Key]:
    try:
        real = path.resolve(strict=True)
        stat = real.stat()
    except OSError as error:
        raise _unreadable(path, error) from error
    return str(real), (stat.st_size, stat.st_mtime_ns, stat.st_ino)


def _files(folder: Path) -> list[Path]:
    """All files of a folder and below that count, sorted by their names within it."""
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder.", "", "Check the name.")
    found = []
    for root, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        counts = (n for n in names if not n.startswith(".") and n.lower() not in _SYSTEM_NAMES)
        found += [Path(root) / name for name in counts]
    return sorted(found, key=lambda file: file.relative_to(folder).as_posix())


def _folder_digest(folder: Path, known: dict[Path, str]) -> str:
    digest = hashlib.sha256()
    for file in _files(folder):
        name = file.relative_to(folder).as_posix().encode("utf-8", "surrogateescape")
        content = known.get(file) or sha256_file(file)
        digest.update(len(name).to_bytes(4, "big") + name + bytes.fromhex(content))
    return digest.hexdigest()


def _unreadable(path: Path, error: OSError) -> InputError:
    if isinstance(error, FileNotFoundError):
        return InputError(f"{path} does not exist.", "", "Check the name, or put the file there.")
    return InputError(
        f"{path} cannot be read.", error.strerror or str(error), "Check its rights and the disk."
    )
