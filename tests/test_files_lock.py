"""One process at a time on a trial; a lock dies with its holder."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from olivevib.errors import InputError, UsageError
from olivevib.files.lock import FILE, alone_in

HOLDER = """
import sys, time
from pathlib import Path
from olivevib.files.lock import alone_in
with alone_in(Path(sys.argv[1]), "own"):
    print("holds", flush=True)
    time.sleep(float(sys.argv[2]))
"""


def holder(folder: Path, seconds: float) -> subprocess.Popen:
    child = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(folder), str(seconds)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout.readline() == "holds\n"
    return child


@pytest.fixture
def held(tmp_path):
    child = holder(tmp_path, 60)
    yield child
    child.kill()
    child.wait()
    child.stdout.close()


def test_a_second_process_is_refused_and_told_who_holds_it(tmp_path, held):
    busy = pytest.raises(UsageError, match=f"worked on by process {held.pid}")
    with busy, alone_in(tmp_path, "own", wait_s=0.1):
        pytest.fail("two at once")


def test_a_lock_dies_with_its_holder(tmp_path, held):
    os.kill(held.pid, signal.SIGKILL)
    held.wait()
    assert (tmp_path / "own" / FILE).read_text()  # the words are left over and count for nothing
    with alone_in(tmp_path, "own", wait_s=0.0):
        assert f"process {os.getpid()} " in (tmp_path / "own" / FILE).read_text()


def test_it_waits_a_moment_for_a_holder_that_ends(tmp_path):
    child = holder(tmp_path, 0.3)
    with child, alone_in(tmp_path, "own", wait_s=20):
        assert child.wait() == 0


def test_it_is_free_again_after_an_error(tmp_path):
    with pytest.raises(ZeroDivisionError), alone_in(tmp_path, "own"):
        _ = 1 / 0
    started = time.monotonic()
    with alone_in(tmp_path, "own", wait_s=5):
        pass
    assert time.monotonic() - started < 2


def test_a_lost_folder_is_named(tmp_path):
    lost = pytest.raises(InputError, match="does not exist")
    with lost, alone_in(tmp_path / "gone", "own"):
        pytest.fail("nothing to lock")


def test_where_nothing_may_be_written_the_work_goes_on(tmp_path, monkeypatch):
    def forbidden(path, mode):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "open", forbidden)
    went_on = False
    with alone_in(tmp_path, "own"):
        went_on = True
    assert went_on
