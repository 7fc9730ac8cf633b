"""Stills, their sizes, and the one door for calibration paths."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_videos import SIZE, cut, index_of, make_video, picture

from olivevib.errors import InputError
from olivevib.files.image_size import image_size
from olivevib.files.stills import IMAGE_SUFFIXES, list_stills, open_source, read_grey


def still(path: Path, index: int = 0, size: tuple[int, int] = SIZE) -> Path:
    assert cv2.imwrite(str(path), picture(index, size))
    return path


def test_names_are_counted_as_people_do(tmp_path: Path) -> None:
    for name in ("b10.png", "b9.jpg", "B1.tif", "b2.bmp", "notes.txt", ".hidden.png"):
        (tmp_path / name).write_bytes(b"x")
    assert [p.name for p in list_stills(tmp_path, "left")] == [
        *("B1.tif", "b2.bmp", "b9.jpg", "b10.png"),
    ]


def test_a_folder_of_both_sides(tmp_path: Path) -> None:
    for name in ("left_1.png", "Right_1.png", "LEFT_02.png", "other.png"):
        (tmp_path / name).write_bytes(b"x")
    assert [p.name for p in list_stills(tmp_path, "left")] == ["left_1.png", "LEFT_02.png"]
    assert [p.name for p in list_stills(tmp_path, "right")] == ["Right_1.png"]
    (tmp_path / "Right_1.png").unlink()
    with pytest.raises(InputError, match="no pictures whose names begin with right"):
        list_stills(tmp_path, "right")


def test_folders_without_pictures(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no pictures"):
        list_stills(tmp_path, "left")
    with pytest.raises(InputError, match="cannot be read"):
        list_stills(tmp_path / "none", "left")


@pytest.mark.parametrize("suffix", IMAGE_SUFFIXES)
def test_every_kind_is_read(tmp_path: Path, suffix: str) -> None:
    path = still(tmp_path / f"x{suffix}", 5)
    grey = read_grey(path)
    assert grey.dtype == np.uint8 and grey.shape == SIZE[::-1] and index_of(grey) == 5
    if "jp" not in suffix:
        assert np.array_equal(grey, picture(5))
    assert image_size(path.read_bytes()) == SIZE


def test_colour_and_sixteen_bits(tmp_path: Path) -> None:
    colour = cv2.cvtColor(picture(3), cv2.COLOR_GRAY2BGR)
    cv2.imwrite(str(tmp_path / "c.png"), colour)
    assert np.array_equal(read_grey(tmp_path / "c.png"), picture(3))
    cv2.imwrite(str(tmp_path / "d.png"), picture(3).astype(np.uint16) * 257)
    assert np.abs(read_grey(tmp_path / "d.png").astype(int) - picture(3)).max() <= 1


def test_a_turn_in_the_exif_data_is_not_applied(tmp_path: Path) -> None:
    path = still(tmp_path / "x.jpg", 6)
    tiff = b"II*\x00\x08\x00\x00\x00" + struct.pack("<HHHIHHI", 1, 0x0112, 3, 1, 6, 0, 0)
    exif = b"Exif\x00\x00" + tiff
    segment = b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif
    data = path.read_bytes()
    path.write_bytes(data[:2] + segment + data[2:])
    assert cv2.imread(str(path)).shape[:2] == SIZE  # the note is understood, and turns it
    assert read_grey(path).shape == SIZE[::-1] and index_of(read_grey(path)) == 6
    assert image_size(path.read_bytes()) == SIZE


def test_a_monster_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0)
    path = tmp_path / "bomb.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IEND", b""))
    with pytest.raises(InputError, match="too large"):
        read_grey(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "does not exist"), (b"", "is empty"), (b"hello" * 100, "not a picture")],
)
def test_bad_pictures(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "x.png"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_grey(path)
    assert str(path) in caught.value.what and caught.value.remedy


@settings(deadline=None, max_examples=80)
@given(st.sampled_from(IMAGE_SUFFIXES), st.integers(0, 5000), st.binary(max_size=8), st.booleans())
def test_damage_gives_a_picture_or_an_error_for_people(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, at: int, junk: bytes, short: bool
) -> None:
    path = still(tmp_path_factory.mktemp("s") / f"x{suffix}")
    data = bytearray(path.read_bytes())
    at %= len(data)
    data[at : at + len(junk)] = junk
    path.write_bytes(data[:at] if short else data)
    try:
        assert read_grey(path).dtype == np.uint8
    except InputError as error:
        assert error.what


def test_one_door_for_stills(tmp_path: Path) -> None:
    for k in (1, 2, 10):
        still(tmp_path / f"left_{k}.png", k)
    source = open_source(tmp_path, "left")
    assert (source.kind, source.size_px, source.count_hint) == ("stills", SIZE, 3)
    assert source.names == ("left_1.png", "left_2.png", "left_10.png")
    frames = list(source.frames())
    assert [f.index for f in frames] == [0, 1, 2] and np.isnan([f.stamp_s for f in frames]).all()
    assert [index_of(f.grey) for f in frames if f.grey is not None] == [1, 2, 10]
    still(tmp_path / "left_11.png", 0, (96, 128))
    with pytest.raises(InputError, match=r"96 x 128 .* is 128 x 96"):
        list(open_source(tmp_path, "left").frames())


def test_one_door_for_videos(tmp_path: Path) -> None:
    path = make_video(tmp_path / "v.mp4", "libx264", frames=4)
    source = open_source(path, "left")
    assert (source.kind, source.size_px, source.count_hint) == ("video", SIZE, 4)
    frames = list(source.frames())
    assert [index_of(f.grey) for f in frames if f.grey is not None] == [0, 1, 2, 3]
    assert source.names == () and source.cautions == () and not np.isnan(frames[1].stamp_s)
    with open_source(cut(make_video(tmp_path / "w.avi"), 0.6), "left") as short:
        assert len(list(short.frames())) < 30
        assert short.cautions[0].code == "video-truncated"
    with pytest.raises(InputError, match="does not exist"):
        open_source(tmp_path / "none", "left")


@pytest.mark.shared
def test_real_stills(shared_data: Path) -> None:
    folder = shared_data / "calibration" / "opencv_stereo_chess13"
    left = open_source(folder, "left")
    assert left.count_hint == 13 and left.size_px == (640, 480)
    right = open_source(folder, "right")
    assert [n.replace("right", "left") for n in right.names] == list(left.names)
