"""Stamp files as recorders write them."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.errors import InputError, OlivevibError, UsageError
from olivevib.files.packets import scan_video
from olivevib.files.stamps import pick_camera, read_stamp_file


def write(tmp_path: Path, text: str, name: str = "stamps.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "1.5\n1.6\n1.75\n",
        "# host clock\n1.5\n\n1.6\n1.75",
        "stamp_s\n1.5\n1.6\n1.75\n",
        "frame,time_ms\n0,1500\n1,1600\n2,1750\n",
        "frame;time (ms)\n0;1500,0\n1;1600,0\n2;1750,0\n",
        "frame_time\tframe_index\n1.75\t2\n1.5\t0\n1.6\t1\n",
        "timestamp [us]\n1500000\n1600000\n1750000\n",
        "sequence,device_stamp,host_monotonic_ns\n0,1.5,9\n1,1.6,10\n2,1.75,11\n",
        "time_ns,crc32\n1500000000,7\n1600000000,8\n1750000000,9\n",
        "Timestamp\n1.6\n1.5\n1.75\n",
        "seconds\n1.5\n1.6\n1.75\n",
        "\ufefftime_s,frame\r\n1.5,0\r\n1.6,1\r\n1.75,2\r\n",
        "time_s frame\n1.5 0\n1.6 1\n1.75 2\n",
    ],
)
def test_ways_to_write_the_same_stamps(tmp_path: Path, text: str) -> None:
    got = read_stamp_file(write(tmp_path, text), "left.mp4", 3)
    assert got.dtype == np.float64 and got.tolist() == [1.5, 1.6, 1.75]


TWO = "cam_id,sync_index,frame_time\n" + "".join(
    f"{cam},{n},{n / 6 + 0.01 * cam}\n" for n in range(4) for cam in (0, 2, 10)
)


@pytest.mark.parametrize(
    ("video", "camera"),
    [
        ("cam_0.mp4", 0),
        ("cam_2.mp4", 2),
        ("CAM02.avi", 2),
        ("take_3_cam10.mkv", 10),
        ("cam_2_take_10.mkv", 2),
        ("2.mp4", 2),
        ("left10.mp4", 10),
    ],
)
def test_the_camera_is_named_by_the_video(tmp_path: Path, video: str, camera: int) -> None:
    path = write(tmp_path, TWO)
    assert pick_camera(path, video) == str(camera)
    got = read_stamp_file(path, video, 4)
    assert np.allclose(got, np.arange(4) / 6 + 0.01 * camera)


@pytest.mark.parametrize("video", ["left.mp4", "cam_1.mp4", "take_0_2.mp4"])
def test_an_unclear_camera_is_asked_for(tmp_path: Path, video: str) -> None:
    path = write(tmp_path, TWO)
    with pytest.raises(UsageError, match="0, 2, 10") as caught:
        read_stamp_file(path, video, 4)
    assert "stamps.csv#0" in caught.value.remedy


def test_explicit_camera(tmp_path: Path) -> None:
    path = write(tmp_path, TWO)
    assert read_stamp_file(f"{path}#10", "left.mp4", 4)[0] == 0.1
    assert read_stamp_file(Path(f"{path}#10"), "cam_0.mp4", 4)[0] == 0.1
    with pytest.raises(UsageError, match="no camera '7'"):
        read_stamp_file(f"{path}#7", "left.mp4", 4)
    single = write(tmp_path, "1\n2\n", "one.csv")
    assert pick_camera(single, "left.mp4") is None
    with pytest.raises(UsageError, match="no column of cameras"):
        read_stamp_file(f"{single}#7", "left.mp4", 2)


def test_a_file_whose_name_holds_the_mark(tmp_path: Path) -> None:
    path = write(tmp_path, "1\n2\n", "take#2.csv")
    assert read_stamp_file(path, "left.mp4", 2).tolist() == [1, 2]


def test_another_number_of_frames_names_both(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"3 time stamps.* has 5 frames"):
        read_stamp_file(write(tmp_path, "1\n2\n3\n"), "left.mp4", 5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no time stamps"),
        ("1\n2\nx\n", "line 3: 'x' is not a number"),
        ("1\n2\nnan\n", "line 3: 'nan' is not a number"),
        ("time_s,frame\n1,0\n2,\n", "line 3"),
        ("1,2\n3,4\n", "2 columns without names"),
        ("size,crc\n1,2\n", "no column of times"),
        ("1\n2\n2\n", "not later"),
        ("frame,time_s\n0,1\n1,3\n2,2\n", "lines 3 and 4"),
        ("frame,time_s\n0,1\n0,3\n2,4\n", "same frame 0 twice"),
        ("\x00\x01\x02", "not a text file"),
    ],
)
def test_bad_files_name_the_line(tmp_path: Path, text: str, message: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=message) as caught:
        read_stamp_file(path, "left.mp4", 3)
    assert str(path) in caught.value.what


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_stamp_file(tmp_path / "no.csv", "left.mp4", 3)


def test_stamps_since_1970_keep_what_a_float_can_hold(tmp_path: Path) -> None:
    text = "time_ns\n1763000000123456789\n1763000000156789123\n"
    got = read_stamp_file(write(tmp_path, text), "left.mp4", 2)
    assert got[0] == 1763000000.123456789 and got[1] == 1763000000.156789123


@settings(deadline=None, max_examples=40)
@given(st.lists(st.integers(0, 10**9), min_size=2, max_size=20, unique=True), st.randoms())
def test_any_order_of_rows(
    tmp_path_factory: pytest.TempPathFactory, times: list[int], rng: random.Random
) -> None:
    times.sort()
    rows = [f"{n},{t}" for n, t in enumerate(times)]
    rng.shuffle(rows)
    path = write(tmp_path_factory.mktemp("s"), "frame,time_us\n" + "\n".join(rows))
    got = read_stamp_file(path, "left.mp4", len(times))
    assert np.array_equal(got, np.array(times) / 1e6)


@settings(deadline=None, max_examples=60)
@given(st.text(max_size=60))
def test_no_text_crashes(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("s") / "s.csv"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        assert read_stamp_file(path, "left.mp4", 1).shape == (1,)
    except OlivevibError as error:
        assert error.what


@pytest.mark.shared
@pytest.mark.parametrize(
    ("folder", "frames"), [("webcam4_charuco_A", 111), ("webcam4_charuco_C_mirrored_cam", 48)]
)
def test_real_webcams(shared_data: Path, folder: str, frames: int) -> None:
    here = shared_data / "calibration" / folder
    for camera in range(4):
        video = here / f"cam_{camera}.mp4"
        assert scan_video(video).frames == frames
        stamps = read_stamp_file(here / "timestamps.csv", video.name, frames)
        steps = np.diff(stamps)
        assert 0.155 < np.median(steps) < 0.18 and steps.min() > 0.05
