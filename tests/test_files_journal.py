"""Rows that were committed survive anything."""

from __future__ import annotations

import random
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from olivevib.errors import InputError, UsageError
from olivevib.files.journal import Journal, JournalRow


def payload(camera: str, frame: int) -> bytes:
    return random.Random(f"{camera}{frame}").randbytes(50 + frame % 400)


def fill(journal: Journal, camera: str, frames: range) -> None:
    for frame in frames:
        journal.append(camera, frame, payload(camera, frame), f"after {frame}".encode())


def test_rows_come_back_in_order_by_camera(tmp_path: Path) -> None:
    path = tmp_path / "track.journal"
    journal = Journal.open(path, "key")
    assert journal.last("left") is None and list(journal.rows("left")) == []
    for n in range(30):  # the cameras take turns
        fill(journal, "left", range(n, n + 1))
        fill(journal, "right", range(2 * n, 2 * n + 2))
    journal.commit()
    journal.close()
    again = Journal.open(path, "key")
    assert again.cautions == ()
    assert list(again.rows("left")) == [JournalRow(n, payload("left", n)) for n in range(30)]
    assert [row.frame for row in again.rows("right")] == list(range(60))
    assert again.last("left") == (29, b"after 29") and again.last("right") == (59, b"after 59")
    again.remove()
    assert list(tmp_path.iterdir()) == []


def test_what_was_not_committed_is_dropped(tmp_path: Path) -> None:
    journal = Journal.open(tmp_path / "j", "key")
    fill(journal, "left", range(5))
    journal.commit()
    fill(journal, "left", range(5, 9))
    journal.close()
    journal = Journal.open(tmp_path / "j", "key")
    assert journal.last("left") == (4, b"after 4") and len(list(journal.rows("left"))) == 5
    journal.close()


def test_a_frame_can_be_appended_once(tmp_path: Path) -> None:
    journal = Journal.open(tmp_path / "j", "key")
    fill(journal, "left", range(2))
    with pytest.raises(ValueError, match="frame 1 of left"):
        journal.append("left", 1, b"", b"")
    journal.close()


def test_a_journal_of_other_work_is_discarded(tmp_path: Path) -> None:
    journal = Journal.open(tmp_path / "j", "key")
    fill(journal, "left", range(5))
    journal.commit()
    journal.close()
    other = Journal.open(tmp_path / "j", "other settings")
    assert other.last("left") is None and other.cautions == ()
    other.close()


@pytest.mark.parametrize("where", ["head", "middle", "all", "payload", "text", "cut"])
def test_a_damaged_journal_is_discarded_with_a_caution(tmp_path: Path, where: str) -> None:
    path = tmp_path / "j"
    journal = Journal.open(path, "key")
    fill(journal, "left", range(300))
    journal.commit()
    journal.close()
    data = bytearray(path.read_bytes())
    if where == "head":
        data[:100] = bytes(100)
    elif where == "middle":
        middle = len(data) // 2
        data[middle : middle + 5000] = b"\xff" * 5000
    elif where == "all":
        data[:] = random.Random(1).randbytes(len(data))
    elif where == "payload":
        data[data.find(payload("left", 200)) + 20] ^= 1
    elif where == "text":
        data[:] = b"not a journal"
    else:
        del data[len(data) // 2 :]
    path.write_bytes(data)
    journal = Journal.open(path, "key")
    assert [c.code for c in journal.cautions] == ["journal-damaged"]
    assert journal.last("left") is None
    fill(journal, "left", range(3))
    journal.commit()
    journal.close()
    journal = Journal.open(path, "key")
    assert journal.cautions == () and len(list(journal.rows("left"))) == 3
    journal.close()


RUN = """
import sys
sys.path.insert(0, {here!r})
from pathlib import Path
from test_files_journal import Journal, fill
journal = Journal.open({path!r}, "key")
last = journal.last("left")
frame = 0 if last is None else last[0] + 1
while True:
    fill(journal, "left", range(frame, frame + 7))
    frame += 7
    journal.commit()
    print(frame, flush=True)
"""


def test_kill_loses_nothing_that_was_committed(tmp_path: Path) -> None:
    path = tmp_path / "j"
    code = RUN.format(here=str(Path(__file__).parent), path=str(path))
    rng = random.Random(5)
    acknowledged = 0
    for _ in range(6):
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as run:
            assert run.stdout is not None
            first = run.stdout.readline()
            time.sleep(rng.uniform(0, 0.08))
            run.send_signal(signal.SIGKILL)
            lines = [first, *run.stdout.read().splitlines()]
        acknowledged = max(acknowledged, *(int(line) for line in lines if line.strip()))
        journal = Journal.open(path, "key")
        assert journal.cautions == ()
        rows = list(journal.rows("left"))
        assert len(rows) >= acknowledged and len(rows) % 7 == 0
        assert rows == [JournalRow(n, payload("left", n)) for n in range(len(rows))]
        assert journal.last("left") == (len(rows) - 1, f"after {len(rows) - 1}".encode())
        journal.close()
    assert acknowledged > 20


def test_two_processes_cannot_do_the_same_work(tmp_path: Path) -> None:
    path = tmp_path / "j"
    journal = Journal.open(path, "key")
    fill(journal, "left", range(3))
    journal.commit()
    code = f"""
from olivevib.errors import UsageError
from olivevib.files.journal import Journal
for key in ("key", "other"):
    try:
        Journal.open({str(path)!r}, key)
    except UsageError as error:
        print(error.what)
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.count("Another olivevib") == 2
    with pytest.raises(UsageError, match="Another olivevib"):
        Journal.open(path, "other")
    assert journal.last("left") == (2, b"after 2")
    journal.close()


def test_another_thread_is_refused(tmp_path: Path) -> None:
    journal = Journal.open(tmp_path / "j", "key")
    caught: list[BaseException] = []

    def use() -> None:
        try:
            journal.append("left", 0, b"", b"")
        except sqlite3.ProgrammingError as error:
            caught.append(error)

    thread = threading.Thread(target=use)
    thread.start()
    thread.join()
    assert len(caught) == 1
    journal.close()


def test_full_disk_keeps_what_was_committed(tmp_path: Path) -> None:
    path = tmp_path / "j"
    journal = Journal.open(path, "key")
    fill(journal, "left", range(50))
    journal.commit()
    pages = journal._db.execute("PRAGMA page_count").fetchone()[0]
    journal._db.execute(f"PRAGMA max_page_count = {pages + 3}")
    with pytest.raises(InputError, match="full") as caught:
        fill(journal, "left", range(50, 500))
    assert "goes on where it stopped" in caught.value.remedy
    journal.close()
    journal = Journal.open(path, "key")
    assert journal.cautions == () and journal.last("left") == (49, b"after 49")
    journal.close()


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
def test_a_real_limit_keeps_what_was_committed(tmp_path: Path) -> None:
    path = tmp_path / "j"
    code = f"""
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_files_journal import InputError, Journal, fill
resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))
journal = Journal.open({str(path)!r}, "key")
frame = 0
try:
    while True:
        fill(journal, "left", range(frame, frame + 10))
        journal.commit()
        frame += 10
except InputError as error:
    print(frame)
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    journal = Journal.open(path, "key")
    rows = list(journal.rows("left"))
    assert journal.cautions == () and len(rows) >= int(out.stdout) > 0
    assert rows == [JournalRow(n, payload("left", n)) for n in range(len(rows))]
    journal.close()


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be used"):
        Journal.open(tmp_path / "no" / "j", "key")
