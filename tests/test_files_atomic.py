"""Whole files: either the old one or the new one, never half of it."""

from __future__ import annotations

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from olivevib.errors import InputError
from olivevib.files.atomic import replacing, write_bytes_atomic, write_text_atomic


def test_writes_new_and_replaces_old(tmp_path: Path) -> None:
    target = tmp_path / "rig.toml"
    write_text_atomic(target, "a = 1\r\nµ\n")
    assert target.read_bytes() == "a = 1\r\nµ\n".encode()
    write_bytes_atomic(target, b"\x00new")
    assert target.read_bytes() == b"\x00new"
    assert [p.name for p in tmp_path.iterdir()] == ["rig.toml"]


def test_new_files_have_the_usual_rights(tmp_path: Path) -> None:
    (tmp_path / "plain").write_bytes(b"")
    write_bytes_atomic(tmp_path / "atomic", b"")
    rights = [stat.S_IMODE((tmp_path / n).stat().st_mode) for n in ("plain", "atomic")]
    assert rights[0] == rights[1]


def test_failing_body_keeps_the_old_file_and_leaves_nothing_behind(tmp_path: Path) -> None:
    target = tmp_path / "tracks.h5"
    target.write_bytes(b"old")
    with pytest.raises(ZeroDivisionError), replacing(target) as beside:
        assert beside.suffix == ".h5" and beside.parent == tmp_path
        beside.write_bytes(b"half")
        _ = 1 / 0
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(
    ("number", "words"),
    [(errno.ENOSPC, "full"), (errno.EACCES, "not permitted"), (errno.EIO, "Check the disk")],
)
def test_errors_say_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    target = tmp_path / "x.bin"
    target.write_bytes(b"old")

    def fail(_: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match=words) as caught:
        write_bytes_atomic(target, b"new")
    assert str(target) in caught.value.what and caught.value.remedy
    assert target.read_bytes() == b"old" and list(tmp_path.iterdir()) == [target]


def test_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere does not exist"):
        write_bytes_atomic(tmp_path / "nowhere" / "x", b"")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs limits of the operating system")
def test_real_limit_of_the_disk(tmp_path: Path) -> None:
    target = tmp_path / "big.bin"
    target.write_bytes(b"old")
    code = f"""
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
from olivevib.errors import InputError
from olivevib.files.atomic import write_bytes_atomic
try:
    write_bytes_atomic({str(target)!r}, bytes(100_000))
except InputError as error:
    print(error.why)
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "full" in out.stdout
    assert target.read_bytes() == b"old" and list(tmp_path.iterdir()) == [target]


def test_kill_while_writing_leaves_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "x.bin"
    target.write_bytes(b"old")
    code = f"""
import os, signal
from olivevib.files.atomic import replacing
with replacing({str(target)!r}) as beside:
    beside.write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""
    subprocess.run([sys.executable, "-c", code], check=False)
    assert target.read_bytes() == b"old"
