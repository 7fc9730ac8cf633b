"""Whole files, written beside the old one and put in its place in one step.

Whatever happens in between (power cut, full disk, kill), the name holds either the complete old
file or the complete new one.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from olivevib.errors import InputError

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a path beside ``path`` to write to; on success it replaces ``path``, synced to disk.

    The yielded path keeps the suffix, so that writers which look at it are content. If the body
    fails nothing is replaced and the yielded file is removed. Raises InputError for a full disk,
    a missing folder or a forbidden one; other errors of the body pass through unchanged.
    """
    target = Path(path)
    beside = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        yield beside
        _sync(beside)
        beside.replace(target)
        _sync_folder(target.parent)
    except OSError as error:
        raise as_input_error(error, target) from error
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)


def write_bytes_atomic(path: str | Path, data: bytes) -> None:
    """Write ``data`` as the whole of ``path``; raises InputError (full disk, forbidden)."""
    with replacing(path) as beside:
        beside.write_bytes(data)


def write_text_atomic(path: str | Path, text: str) -> None:
    """Write ``text`` (UTF-8, line ends as given) as the whole of ``path``; raises InputError."""
    write_bytes_atomic(path, text.encode("utf-8"))


def as_input_error(error: OSError, target: Path) -> InputError:
    """What a failed write means to a person: which file, why, what to do."""
    what = f"{target} could not be written."
    if error.errno in _FULL:
        return InputError(
            what,
            "The disk is full, or a quota or file-size limit was reached.",
            "Free some space and run the same command again; what was there before is unchanged.",
        )
    if error.errno in _FORBIDDEN:
        return InputError(
            what,
            "Writing there is not permitted.",
            f"Check the rights of {target.parent}, or work on a copy in a folder of your own.",
        )
    if isinstance(error, FileNotFoundError):
        return InputError(
            what, f"The folder {target.parent} does not exist.", "Make it, or name another one."
        )
    return InputError(what, error.strerror or str(error), "Check the disk and run it again.")


def _sync(path: Path) -> None:
    with path.open("rb+") as handle:
        os.fsync(handle.fileno())


def _sync_folder(folder: Path) -> None:
    """Make the new name itself safe from a power cut, where the system can (not on Windows)."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    with contextlib.suppress(OSError):  # some network folders cannot be synced: the file is
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
