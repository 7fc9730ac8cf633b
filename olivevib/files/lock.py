"""One process at a time on a folder: a lock that the system itself frees when its holder dies.

The file names its holder for a person. What counts is the system's lock on it, so nothing has to
be cleaned up after a kill or a power cut, and a process number that was given away again deceives
nobody.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from olivevib.errors import InputError, UsageError
from olivevib.files.atomic import as_input_error

FILE = "lock"
WAIT_S = 2.0  # a holder that was just killed needs a moment to be gone
_POLL_S = 0.05
_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
_BUSY = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)

if sys.platform == "win32":
    import msvcrt

    def _lock(file: BinaryIO) -> None:
        file.seek(1 << 20)  # beyond the words, which stay readable for others
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: BinaryIO) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextlib.contextmanager
def alone_in(folder: Path, private: str, wait_s: float = WAIT_S) -> Iterator[None]:
    """Hold the lock of ``folder`` (a file in its subfolder ``private``) while the body runs.

    Waits up to ``wait_s`` for another holder. Where nothing may be written there is nothing to
    keep apart: the body runs without a lock. Raises UsageError that names the holder, InputError
    where the folder is gone or its disk knows no locks. Not for nesting: a second holder in the
    same process is another holder.
    """
    path = folder / private / FILE
    file = _opened(path)
    if file is None:
        yield
        return
    with file:
        _acquire(file, path, folder, time.monotonic() + wait_s)
        _sign(file)
        try:
            yield
        finally:
            file.truncate(0)  # closing the file frees the lock


def _opened(path: Path) -> BinaryIO | None:
    try:
        path.parent.mkdir(exist_ok=True)
        return path.open("a+b")
    except OSError as error:
        if error.errno in _FORBIDDEN:
            return None
        raise as_input_error(error, path) from error


def _acquire(file: BinaryIO, path: Path, folder: Path, until: float) -> None:
    while True:
        try:
            return _lock(file)
        except OSError as error:
            if error.errno not in _BUSY:
                raise _no_locks(path, error) from error
            if time.monotonic() > until:
                raise _busy(folder, file) from error
        time.sleep(_POLL_S)


def _sign(file: BinaryIO) -> None:
    file.truncate(0)
    file.write(f"process {os.getpid()} on {socket.gethostname()}\n".encode())
    file.flush()


def _busy(folder: Path, file: BinaryIO) -> UsageError:
    file.seek(0)
    holder = file.read(200).decode("utf-8", "replace").strip() or "another process"
    return UsageError(
        f"{folder} is being worked on by {holder}.",
        "Two at once would do the same work twice.",
        "Wait until it has ended, or end it; then run the same command again.",
    )


def _no_locks(path: Path, error: OSError) -> InputError:
    return InputError(
        f"{path} cannot be locked.",
        f"The disk it is on does not offer locks ({error.strerror or error}).",
        "Move the trial to a local disk, or to a share that knows locks.",
    )
