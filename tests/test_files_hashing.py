"""Content hashes and their cache."""

from __future__ import annotations

import hashlib
import json
import os
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.errors import InputError
from olivevib.files import hashing
from olivevib.files.hashing import HashCache, sha256_file, sha256_folder


def old(path: Path, data: bytes, age_s: float = 60.0) -> Path:
    path.write_bytes(data)
    then = time.time() - age_s
    os.utime(path, (then, then))
    return path


def test_file_hash_is_the_plain_sha256(tmp_path: Path) -> None:
    data = bytes(range(256)) * 9000  # more than two blocks
    (tmp_path / "v").write_bytes(data)
    assert sha256_file(tmp_path / "v") == hashlib.sha256(data).hexdigest()


@pytest.mark.parametrize("read", [sha256_file, sha256_folder])
def test_missing_is_an_input_error(tmp_path: Path, read: object) -> None:
    with pytest.raises(InputError, match="nothing"):
        read(tmp_path / "nothing")  # type: ignore[operator]


def test_folder_hash_sees_names_contents_and_subfolders(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.png").write_bytes(b"1")
    (tmp_path / "sub" / "b.png").write_bytes(b"2")
    first = sha256_folder(tmp_path)
    assert sha256_folder(tmp_path) == first
    (tmp_path / "a.png").rename(tmp_path / "c.png")
    renamed = sha256_folder(tmp_path)
    (tmp_path / "sub" / "b.png").write_bytes(b"3")
    assert len({first, renamed, sha256_folder(tmp_path)}) == 3
    assert HashCache(tmp_path.parent / "c.json").folder(tmp_path) == sha256_folder(tmp_path)


def test_what_file_managers_leave_behind_does_not_count(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"1")
    first = sha256_folder(tmp_path)
    (tmp_path / ".DS_Store").write_bytes(b"x")
    (tmp_path / "Thumbs.db").write_bytes(b"x")
    assert sha256_folder(tmp_path) == first


@settings(deadline=None, max_examples=30)
@given(st.dictionaries(st.text("ab/", min_size=1, max_size=4), st.binary(max_size=3), max_size=4))
def test_folder_hash_is_unambiguous(tmp_path_factory: pytest.TempPathFactory, files: dict) -> None:
    """Moving bytes between name and content changes the hash."""
    seen = {}
    for swap in (False, True):
        folder = tmp_path_factory.mktemp("f")
        for name, data in files.items():
            text = name.replace("/", "_")
            (folder / (text + "x" if swap else text)).write_bytes(data)
        seen[swap] = sha256_folder(folder)
    assert (seen[False] == seen[True]) == (not files)


def test_a_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    video = old(tmp_path / "v.nut", b"frames")
    reads = []
    plain = hashing.sha256_file
    monkeypatch.setattr(hashing, "sha256_file", lambda p: reads.append(p) or plain(p))
    cache = tmp_path / "state" / "hashes.json"
    for _ in range(3):
        assert HashCache(cache).of(video) == hashlib.sha256(b"frames").hexdigest()
    assert len(reads) == 1
    old(video, b"FRAMES", age_s=50)  # same size, other content, other time
    assert HashCache(cache).file(video) == hashlib.sha256(b"FRAMES").hexdigest()
    assert len(reads) == 2


def test_a_file_that_just_changed_is_not_remembered(tmp_path: Path) -> None:
    video = old(tmp_path / "v.nut", b"one", age_s=0)
    cache = HashCache(tmp_path / "hashes.json")
    stamp = video.stat().st_mtime_ns
    first = cache.file(video)
    video.write_bytes(b"two")
    os.utime(video, ns=(stamp, stamp))  # a change that time stamps cannot show
    assert cache.file(video) != first


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "null", '{"x": 3}', '{"x": [1,2,3,4]}', "\x00", "[" * 100_000]
)
def test_damaged_cache_is_rebuilt(tmp_path: Path, content: str) -> None:
    video = old(tmp_path / "v.nut", b"frames")
    path = tmp_path / "hashes.json"
    path.write_text(content)
    assert HashCache(path).file(video) == hashlib.sha256(b"frames").hexdigest()
    assert list(json.loads(path.read_text())) == [str(video.resolve())]


def test_unwritable_cache_costs_only_time(tmp_path: Path) -> None:
    video = old(tmp_path / "v.nut", b"frames")
    cache = HashCache(video / "hashes.json")
    assert cache.file(video) == hashlib.sha256(b"frames").hexdigest()


def test_two_caches_keep_each_others_finds(tmp_path: Path) -> None:
    a, b = old(tmp_path / "a", b"a"), old(tmp_path / "b", b"b")
    path = tmp_path / "hashes.json"
    first, second = HashCache(path), HashCache(path)
    first.file(a)
    second.file(b)
    assert len(json.loads(path.read_text())) == 2
