"""Recordings as grey frames: places, stamps, damage, cuts, refusals."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_videos import SIZE, cut, damage, index_of, make_video, packet_places, picture

from olivevib.errors import InputError, OlivevibError, UsageError
from olivevib.files.frame_order import FrameOrder
from olivevib.files.packets import Slip, frame_stamps, scan_video
from olivevib.files.video import Frame, Video
from olivevib.progress import Cancelled

UNEVEN = [0.0, 0.033, 0.068, 0.150, 0.1834, 0.3]  # a variable rate, s


def walk(path: Path, start: int = 0) -> tuple[list[Frame], Video]:
    with Video.open(path) as video:
        return list(video.frames(start)), video


@pytest.mark.parametrize(
    ("name", "codec", "within_s"),
    [
        ("v.nut", "mjpeg", 1e-6),
        ("v.mp4", "libx264", 1e-6),
        ("v.mov", "mjpeg", 1e-6),
        ("v.mkv", "libx264", 0.0005),
        ("v.avi", "mjpeg", 1 / 60),
    ],
)
def test_frames_and_stamps_are_those_that_were_written(
    tmp_path: Path, name: str, codec: str, within_s: float
) -> None:
    path = make_video(tmp_path / name, codec, UNEVEN)
    frames, video = walk(path)
    assert [f.index for f in frames] == list(range(len(UNEVEN)))
    assert [index_of(f.grey) for f in frames if f.grey is not None] == list(range(len(UNEVEN)))
    got = np.array([f.stamp_s for f in frames])
    assert np.abs(got - UNEVEN).max() <= within_s
    assert np.array_equal(frame_stamps(path), got)
    assert video.info.size_px == SIZE and video.info.stamps == "container"
    assert video.cautions == () and video.truncated is None


def test_frames_that_an_avi_leaves_out_are_no_cut(tmp_path: Path) -> None:
    path = make_video(tmp_path / "v.avi", stamps_s=[k / 30 for k in range(40) if k not in (5, 6)])
    frames, video = walk(path)
    assert len(frames) == 38 and video.cautions == ()
    assert abs(frames[5].stamp_s - frames[4].stamp_s - 0.1) < 1e-9


def test_grey_is_the_luma_plane_untouched(tmp_path: Path) -> None:
    for pixels, expected in (("yuv420p", 16), ("yuyv422", 16), ("gray", 0), ("yuv420p10le", 16)):
        codec = "ffv1" if pixels == "yuv420p10le" else "rawvideo"
        path = make_video(tmp_path / f"{pixels}.nut", codec, frames=2, pixels=pixels)
        with av.open(str(path)) as container:
            plane = next(container.decode(video=0))
            raw = np.frombuffer(memoryview(plane.planes[0]), np.uint8)
            raw = raw.reshape(plane.height, -1)
        grey = walk(path)[0][0].grey
        assert grey is not None and grey.shape == SIZE[::-1] and grey.flags.c_contiguous
        step = {"yuyv422": 2}.get(pixels, 1)
        if pixels == "yuv420p10le":
            wide = raw[:, : 2 * SIZE[0]].copy().view("<u2")
            assert np.array_equal(grey, wide >> 2)
        else:
            assert np.array_equal(grey, raw[:, : step * SIZE[0] : step])
        # limited range stays limited: 30 of the drawing is coded as 16 + 30 * 219 / 255
        dark = grey[12:20, 8:12].mean()
        assert abs(dark - (expected + 30 * (219 / 255 if expected else 1))) < 1.5


def test_rgb_and_upside_down_storage(tmp_path: Path) -> None:
    path = make_video(tmp_path / "v.avi", "rawvideo", frames=2, pixels="bgr24")
    frames, _ = walk(path)
    assert frames[1].grey is not None
    assert np.abs(frames[1].grey.astype(int) - picture(1)).max() <= 2


def test_line_stride_of_an_odd_width(tmp_path: Path) -> None:
    path = make_video(tmp_path / "v.nut", "ffv1", frames=1, pixels="gray", size=(131, 67))
    grey = walk(path)[0][0].grey
    assert grey is not None and np.array_equal(grey, picture(0, (131, 67)))


def test_grey_survives_the_video(tmp_path: Path) -> None:
    frames, _ = walk(make_video(tmp_path / "v.nut"))
    gc.collect()
    assert [index_of(f.grey) for f in frames if f.grey is not None] == list(range(30))


@pytest.mark.parametrize(("name", "codec"), [("v.nut", "mjpeg"), ("v.mp4", "libx264")])
def test_a_resumed_walk_gives_the_same_frames(tmp_path: Path, name: str, codec: str) -> None:
    path = make_video(tmp_path / name, codec)
    whole, resumed = walk(path)[0], walk(path, start=17)[0]
    assert len(resumed) == 13
    for a, b in zip(whole[17:], resumed, strict=True):
        assert a[:2] == b[:2] and np.array_equal(a.grey, b.grey)


def test_display_rotation_is_told_but_never_applied(tmp_path: Path) -> None:
    frames, video = walk(make_video(tmp_path / "v.mp4", "libx264", frames=3, rotation=90))
    assert video.info.rotation_deg == 90 and video.info.size_px == SIZE
    assert frames[2].grey is not None and index_of(frames[2].grey) == 2


# --- damage --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["v.nut", "v.mkv", "v.avi", "v.mov"])
def test_a_damaged_mjpeg_frame_keeps_its_place(tmp_path: Path, name: str) -> None:
    path = damage(make_video(tmp_path / name), packet=7, share=0.05, count=400)
    frames, video = walk(path)
    assert [f.index for f in frames if f.grey is None] == [7]
    assert [index_of(f.grey) for f in frames if f.grey is not None] == [*range(7), *range(8, 30)]
    assert np.array_equal([f.stamp_s for f in frames], frame_stamps(path))
    assert [c.code for c in video.cautions] == ["video-damaged"]


def test_damage_spreads_to_the_next_key_frame_of_h264(tmp_path: Path) -> None:
    """Every frame that differs from the sound recording is reported, and nothing far from it."""
    sound = make_video(tmp_path / "v.nut", "libx264", frames=60)
    whole = walk(sound)[0]
    path = damage(sound, packet=15, count=20)
    frames, video = walk(path)
    bad = [f.index for f in frames if f.grey is None]
    changed = [
        a.index
        for a, b in zip(frames, whole, strict=True)
        if a.grey is not None and not np.array_equal(a.grey, b.grey)
    ]
    assert changed == []
    assert bad and min(bad) >= 12 and max(bad) == 23  # key frames stand at 0, 12, 24, …
    assert video.cautions[0].code == "video-damaged"


def test_every_frame_damaged_is_an_error(tmp_path: Path) -> None:
    path = make_video(tmp_path / "v.nut", frames=4)
    data = bytearray(path.read_bytes())
    for at, size in packet_places(path):
        data[at + size // 8 : at + size - 8] = bytes(size - 8 - size // 8)
    path.write_bytes(data)
    with pytest.raises(InputError, match="no frame that can be decoded"):
        Video.open(path)


# --- cuts ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "codec", "options", "meant"),
    [
        ("v.mkv", "mjpeg", {}, "of about (2[6-9]|3[0-4]) expected"),
        ("v.mkv", "libx264", {}, "of about (2[6-9]|3[0-4]) expected"),
        ("v.avi", "mjpeg", {}, "of about 30 expected"),
        ("v.mp4", "libx264", {"movflags": "faststart"}, "of 30 expected"),
        ("v.nut", "mjpeg", {}, "frames are there"),
    ],
)
def test_a_cut_recording_plays_up_to_the_cut(
    tmp_path: Path, name: str, codec: str, options: dict[str, str], meant: str
) -> None:
    sound = make_video(tmp_path / name, codec, options=options)
    assert scan_video(sound).truncated is None
    path = cut(sound, 0.6)
    frames, video = walk(path)
    good = [index_of(f.grey) for f in frames if f.grey is not None]
    assert 10 <= len(good) < 30
    if codec == "mjpeg":
        assert good == list(range(len(good)))
    assert video.truncated is not None and video.truncated.code == "video-truncated"
    assert f"{len(frames)} frames" in video.truncated.text
    assert re.search(meant, video.truncated.text)
    scan = scan_video(path)
    assert scan.truncated == video.truncated and scan.frames == len(frames)


def test_a_cut_plain_mp4_says_that_its_index_is_gone(tmp_path: Path) -> None:
    path = cut(make_video(tmp_path / "v.mp4", "libx264"), 0.6)
    with pytest.raises(InputError, match="index was never written") as caught:
        Video.open(path)
    assert "NUT" in caught.value.remedy


def test_killed_recorder_with_flushed_packets_loses_no_frame(tmp_path: Path) -> None:
    path = tmp_path / "v.nut"
    code = f"""
import os, signal, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
import av
from small_videos import make_video
plain = av.container.OutputContainer.mux
count = 0
def mux(self, packet):
    global count
    plain(self, packet)
    count += 1
    if count == 20:
        os.kill(os.getpid(), signal.SIGKILL)
av.open  # the recorder
import small_videos as sv
class Recorder:
    def __init__(self, inner): self.inner = inner
    def __enter__(self): return self
    def __exit__(self, *a): self.inner.close()
    def add_stream(self, *a, **k): return self.inner.add_stream(*a, **k)
    def mux(self, packet): mux(self.inner, packet)
opened = av.open
sv.av.open = lambda *a, **k: Recorder(opened(*a, **k))
make_video(__import__('pathlib').Path({str(path)!r}), options={{'flush_packets': '1'}})
"""
    subprocess.run([sys.executable, "-c", code], check=False)
    frames, video = walk(path)
    assert [index_of(f.grey) for f in frames if f.grey is not None] == list(range(20))
    assert video.truncated is not None


# --- refusals ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    ["http://host/v.mp4", "concat:a.ts|b.ts", "file:v.mp4", "//host/share/v.mp4", "\\\\host\\v"],
)
def test_names_that_are_no_files_are_refused(name: str) -> None:
    with pytest.raises(UsageError, match="not the name of a file"):
        Video.open(name)


def test_device_names_are_refused() -> None:
    with pytest.raises(UsageError, match="device"):
        Video.open("CON.mp4")


def test_a_list_of_files_is_not_followed(tmp_path: Path) -> None:
    make_video(tmp_path / "v.nut", frames=3)
    listing = tmp_path / "list.mp4"
    listing.write_text(f"ffconcat version 1.0\nfile '{tmp_path / 'v.nut'}'\n")
    with pytest.raises(InputError, match="not a video that can be read"):
        Video.open(listing)
    still = tmp_path / "still.png"
    av.VideoFrame.from_ndarray(picture(0), format="gray").save(str(still))
    with pytest.raises(InputError, match="not a video that can be read"):
        Video.open(still)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "does not exist"),
        ("folder", "is a folder"),
        (b"", "empty"),
        (b"time,ax\n0,1\n" * 50, "not a video that can be read"),
        (bytes(5000), "not a video that can be read"),
    ],
)
def test_each_bad_input_has_its_own_message_and_remedy(
    tmp_path: Path, content: bytes | str | None, message: str
) -> None:
    path = tmp_path / "left.mp4"
    if content == "folder":
        path.mkdir()
    elif isinstance(content, bytes):
        path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        Video.open(path)
    assert str(path) in caught.value.what and caught.value.remedy


def test_sound_without_pictures(tmp_path: Path) -> None:
    path = tmp_path / "v.mkv"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.int16), layout="mono")
        frame.sample_rate = 8000
        out.mux(stream.encode(frame))
    with pytest.raises(InputError, match="holds no video"):
        Video.open(path)


def test_a_change_of_size_on_the_way(tmp_path: Path) -> None:
    parts = [
        make_video(tmp_path / f"{w}.mjpeg", frames=3, size=(w, 96), container="mjpeg")
        for w in (128, 160)
    ]
    path = tmp_path / "both.mjpeg"
    path.write_bytes(b"".join(part.read_bytes() for part in parts))
    with Video.open(path) as video:
        assert video.info.stamps == "none"
        frames = video.frames()
        assert np.isnan(next(frames).stamp_s)
        with pytest.raises(InputError, match="changes its picture size at frame 3"):
            list(frames)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=40))
def test_any_damage_gives_frames_or_an_error_for_people(
    tmp_path_factory: pytest.TempPathFactory, at: int, junk: bytes
) -> None:
    folder = tmp_path_factory.mktemp("fuzz")
    data = bytearray(make_video(folder / "v.mkv", frames=6).read_bytes())
    at %= len(data)
    data[at : at + len(junk)] = junk
    path = folder / "w.mkv"
    path.write_bytes(data)
    try:
        with Video.open(path) as video:
            for frame in video.frames():
                assert frame.grey is None or frame.grey.shape == video.info.size_px[::-1]
    except OlivevibError as error:
        assert error.what and "\x00" not in str(error)


# --- streaming -----------------------------------------------------------------------------


def test_leaving_a_walk_releases_the_file(tmp_path: Path) -> None:
    path = make_video(tmp_path / "v.nut")
    with Video.open(path) as video:
        next(video.frames())
    assert not video._playing
    assert video.cautions == ()


def test_scan_can_be_cancelled(tmp_path: Path) -> None:
    def stop(done: int, total: int | None, note: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        scan_video(make_video(tmp_path / "v.nut"), stop)


def test_memory_does_not_grow_with_the_length(tmp_path: Path) -> None:
    code = """
import resource, sys
from olivevib.files.video import Video
with Video.open(sys.argv[1]) as video:
    n = sum(1 for _ in video.frames())
print(n, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    peak = {}
    for frames in (100, 1000):
        path = make_video(tmp_path / f"{frames}.nut", frames=frames, size=(320, 240))
        run = [sys.executable, "-c", code, str(path)]
        count, kb = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
        assert int(count) == frames
        peak[frames] = int(kb)
    assert peak[1000] < 1.05 * peak[100]


# --- the order of frames, alone ------------------------------------------------------------


def slip(index: int, order: int, *, key: bool = False, corrupt: bool = False) -> Slip:
    return Slip(index, order, float(order), True, key, corrupt)


def test_order_with_reordered_pictures_and_damage() -> None:
    """Decoded I0 P3 B1 B2 I6 B4 B5: a flaw in P3 taints B1 and B2, shown before it; I6 is clean,
    but B4 and B5 lean on both sides."""
    packets = [slip(0, 0, key=True), slip(1, 3), slip(2, 1), slip(3, 2)]
    packets += [slip(4, 6, key=True), slip(5, 4), slip(6, 5)]
    order: FrameOrder[str] = FrameOrder(known_order=True)
    out = []
    for p in packets:
        order.sent(p)
    for index, name in (
        (0, "I0"),
        (2, "B1"),
        (3, "B2"),
        (1, "P3"),
        (5, "B4"),
        (6, "B5"),
        (4, "I6"),
    ):
        out += order.decoded(index, name, flawed=index == 1)
    out += order.ended()
    assert [p.slip.order for p in out] == list(range(7))
    assert [p.picture for p in out] == ["I0", None, None, None, None, None, "I6"]


@settings(deadline=None, max_examples=60)
@given(st.sets(st.integers(0, 39)), st.integers(1, 12))
def test_every_packet_gets_one_place(lost: set[int], group: int) -> None:
    order: FrameOrder[int] = FrameOrder(known_order=True)
    out = []
    for k in range(40):
        order.sent(slip(k, k, key=k % group == 0))
        if k not in lost:
            out += order.decoded(k, k, flawed=False)
    out += order.ended()
    assert [p.slip.index for p in out] == list(range(40))
    assert {p.slip.index for p in out if p.picture is None} == lost
    assert not order._pending and not order._group


# --- real recordings -----------------------------------------------------------------------


@pytest.mark.shared
@pytest.mark.parametrize("camera", [0, 3])
def test_real_webcams(shared_data: Path, camera: int) -> None:
    path = shared_data / "calibration" / "webcam4_charuco_A" / f"cam_{camera}.mp4"
    scan = scan_video(path)
    assert scan.frames == 111 and scan.truncated is None
    with Video.open(path) as video:
        assert video.info.size_px == (1280, 720)
        assert [f.index for f in video.frames() if f.grey is not None] == list(range(111))
        assert video.cautions == ()
