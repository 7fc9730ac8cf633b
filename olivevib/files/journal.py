"""Rows kept safe while a long stage runs, so that a kill or a full disk loses nothing committed.

An SQLite file in write-ahead mode, removed when the stage's own file is complete.
"""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Self

from olivevib.errors import Caution, InputError, UsageError

VERSION = 1
_TABLES = """
CREATE TABLE IF NOT EXISTS journal (version INTEGER NOT NULL, key TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS row (
    camera TEXT NOT NULL, frame INTEGER NOT NULL, payload BLOB NOT NULL, crc INTEGER NOT NULL,
    PRIMARY KEY (camera, frame)
);
CREATE TABLE IF NOT EXISTS state (
    camera TEXT PRIMARY KEY, frame INTEGER NOT NULL, memory BLOB NOT NULL, crc INTEGER NOT NULL
);
"""


class JournalRow(NamedTuple):
    """What was found in one frame of one camera."""

    frame: int
    payload: bytes


class Journal:
    """Rows by camera and frame, and what the tracker remembered after the last of each camera.

    Use it from the one thread that opened it; another thread gets sqlite3.ProgrammingError. One
    process at a time: a second one gets an InputError. Only ``commit`` acknowledges: what was
    appended since then is lost in a kill, what was committed never (not in a power cut either).
    """

    def __init__(self, path: Path, db: sqlite3.Connection, cautions: tuple[Caution, ...]) -> None:
        self.path = path
        self.cautions = cautions
        self._db = db

    @classmethod
    def open(cls, path: str | Path, key: str) -> Self:
        """Open the journal of this work, or start an empty one.

        key: hash of the inputs and settings; a journal of other work is discarded silently, a
        damaged one with the caution journal-damaged. Raises UsageError where another process is
        at the same work, InputError where the file cannot be written.
        """
        file = Path(path)
        cautions: tuple[Caution, ...] = ()
        try:
            try:
                db = _connect(file)
                sound = _sound(db)
            except sqlite3.DatabaseError as error:
                if _code(error) in _ENVIRONMENT:
                    raise
                db, sound = None, False
            if not sound:
                cautions = (_damaged(file),)
            if db is None or not sound or not _belongs(db, key):
                if db is not None:
                    db.close()
                _discard(file)
                db = _connect(file)
            if _is_new(db):
                with db:
                    db.execute("INSERT INTO journal VALUES (?, ?)", (VERSION, key))
        except (sqlite3.Error, OSError) as error:
            raise _as_error(error, file) from error
        return cls(file, db, cautions)

    def append(self, camera: str, frame: int, payload: bytes, tracker_state: bytes) -> None:
        """Add a frame's row and what the tracker remembers after it; acknowledged by ``commit``.

        Frames of a camera are appended in order. Raises InputError where the disk is full: what
        was committed stays, and the work resumes there when there is space.
        """
        row = (camera, frame, payload, zlib.crc32(payload))
        state = (camera, frame, tracker_state, zlib.crc32(tracker_state))
        try:
            if not self._db.in_transaction:
                self._db.execute("BEGIN")
            self._db.execute("INSERT INTO row VALUES (?, ?, ?, ?)", row)
            self._db.execute("INSERT OR REPLACE INTO state VALUES (?, ?, ?, ?)", state)
        except sqlite3.IntegrityError as error:
            raise ValueError(f"frame {frame} of {camera} is in the journal already") from error
        except sqlite3.OperationalError as error:
            raise _as_error(error, self.path) from error

    def commit(self) -> None:
        """Acknowledge all rows appended so far: from now on they survive; raises InputError."""
        try:
            self._db.commit()
        except sqlite3.OperationalError as error:
            raise _as_error(error, self.path) from error

    def rows(self, camera: str) -> Iterator[JournalRow]:
        """The rows of one camera in the order of their frames, streamed."""
        query = "SELECT frame, payload FROM row WHERE camera = ? ORDER BY frame"
        yield from map(JournalRow._make, self._db.execute(query, (camera,)))

    def last(self, camera: str) -> tuple[int, bytes] | None:
        """The last frame of a camera and what the tracker remembered then, or None."""
        query = "SELECT frame, memory FROM state WHERE camera = ?"
        found = self._db.execute(query, (camera,)).fetchone()
        return None if found is None else (int(found[0]), bytes(found[1]))

    def close(self) -> None:
        """Close the file; rows appended since the last ``commit`` are dropped."""
        self._db.rollback()
        self._db.close()

    def remove(self) -> None:
        """Close it if need be and delete it: the stage's own file is complete."""
        self._db.close()
        _discard(self.path)


def _connect(file: Path) -> sqlite3.Connection:
    """A connection for this process alone, in write-ahead mode and synced at each commit."""
    db = sqlite3.connect(file, timeout=0.5, isolation_level=None)
    try:
        db.execute("PRAGMA locking_mode = EXCLUSIVE")
        db.execute("PRAGMA trusted_schema = OFF")
        db.execute("PRAGMA journal_mode = WAL").fetchone()
        db.execute("PRAGMA synchronous = FULL")
        db.executescript(f"BEGIN EXCLUSIVE; {_TABLES} COMMIT;")
    except sqlite3.Error:
        db.close()
        raise
    return db


def _sound(db: sqlite3.Connection) -> bool:
    """False where a page or a row is damaged, or a camera's state does not fit its rows."""
    if db.execute("PRAGMA quick_check(1)").fetchone() != ("ok",):
        return False
    for table, blob in (("row", "payload"), ("state", "memory")):
        for data, crc in db.execute(f"SELECT {blob}, crc FROM {table}"):
            if not isinstance(data, bytes) or zlib.crc32(data) != crc:
                return False
    ends = db.execute("SELECT camera, MAX(frame) FROM row GROUP BY camera ORDER BY camera")
    states = db.execute("SELECT camera, frame FROM state ORDER BY camera")
    return bool(ends.fetchall() == states.fetchall())


def _is_new(db: sqlite3.Connection) -> bool:
    return db.execute("SELECT 1 FROM journal").fetchone() is None


def _belongs(db: sqlite3.Connection, key: str) -> bool:
    """True for an empty journal, and for one of the same work in this form."""
    return _is_new(db) or db.execute("SELECT * FROM journal").fetchall() == [(VERSION, key)]


def _discard(file: Path) -> None:
    for suffix in ("", "-wal", "-shm", "-journal"):
        file.with_name(file.name + suffix).unlink(missing_ok=True)


def _damaged(file: Path) -> Caution:
    return Caution(
        "journal-damaged",
        f"The journal {file} was damaged and is started anew: the work begins from the start.",
        "Nothing else is affected. If it happens again, check the disk.",
    )


_ENVIRONMENT = (  # what is wrong is not the content of the file
    *(sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR),
    *(sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM, sqlite3.SQLITE_NOMEM),
)


def _code(error: Exception) -> int:
    return int(getattr(error, "sqlite_errorcode", 0)) & 0xFF


def _as_error(error: sqlite3.Error | OSError, file: Path) -> InputError | UsageError:
    code = _code(error)
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return UsageError(
            f"Another olivevib is at this work already: {file} is in use.",
            "",
            "Wait until it has finished, or stop it; what it has done is kept.",
        )
    if code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
        return InputError(
            f"The journal {file} could not be written.",
            "The disk is full, a limit was reached, or the disk failed.",
            "Free some space and run the same command again: it goes on where it stopped.",
        )
    return InputError(
        f"The journal {file} cannot be used.",
        str(error),
        f"Check that {file.parent} exists and may be written to.",
    )
