"""Every kind of camera behind the one door, and what Linux says of a device."""

from __future__ import annotations

import errno
import itertools
import os
import random
import socket
import struct
import threading
import time

import av
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_videos import make_video

from olivevib.errors import InputError, UsageError
from olivevib.files.capture import Controls, Listed, Mode, Shot, find_camera, open_camera
from olivevib.files.capture import device as device_room
from olivevib.files.capture import v4l2 as linux
from olivevib.files.capture.clock import StampClock
from olivevib.files.capture.device import open_options
from olivevib.files.capture.jpeg import JpegSplitter
from olivevib.files.capture.listing import modes_in
from olivevib.studies.capture.camera import MjpegServer, Plan, jpeg, number_of, numbered


def take(camera, count):
    """The first pictures of a camera."""
    stop = threading.Event()
    try:
        return list(itertools.islice(camera.shots(stop), count))
    finally:
        stop.set()
        camera.close()


@pytest.mark.parametrize("framing", ["length", "chunked", "unframed", "bare"])
def test_every_framing_of_mjpeg_over_http_gives_the_bytes_that_were_sent(framing):
    with MjpegServer(Plan(framing=framing, fps=400)) as server:
        camera = open_camera(server.address, Mode(), "left")
        assert (camera.facts.kind, camera.facts.codec) == ("http", "mjpeg")
        assert camera.facts.size_px == (128, 96)
        shots = take(camera, 12)
        numbers = [number_of(shot.data) for shot in shots]
        assert numbers == list(range(12))
        assert [s.data for s in shots] == [server.data(n) for n in numbers]
        if framing in ("length", "chunked"):
            assert [s.device_ns for s in shots] == [server.stamp_ns(n) for n in numbers]
            assert camera.facts.stamp_kind == "header"
        else:
            assert {s.device_ns for s in shots} == {None}
            assert camera.facts.stamp_kind == "host"


def answering(answer):
    """A server that answers one client with fixed bytes; returns its address."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve():
        client, _ = listener.accept()
        with client, listener:
            client.recv(4096)
            client.sendall(answer)

    threading.Thread(target=serve, daemon=True).start()
    return f"http://127.0.0.1:{listener.getsockname()[1]}/"


def test_an_address_without_a_camera_is_refused_with_the_remedy():
    with socket.create_server(("127.0.0.1", 0)) as closed:
        port = closed.getsockname()[1]
    with pytest.raises(InputError, match="cannot be used"):
        open_camera(f"http://127.0.0.1:{port}/", Mode(), "left")
    with pytest.raises(InputError, match="404 Not Found"):
        open_camera(answering(b"HTTP/1.0 404 Not Found\r\n\r\n"), Mode(), "left")
    page = b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<html>no camera</html>"
    with pytest.raises(InputError, match="MJPEG"):
        open_camera(answering(page), Mode(), "left")
    with pytest.raises(UsageError, match="MJPEG"):
        open_camera("rtsp://127.0.0.1/stream", Mode(), "left")


def test_a_password_is_sent_but_never_told():
    heard = []
    listener = socket.create_server(("127.0.0.1", 0))
    picture = jpeg()

    def serve():
        client, _ = listener.accept()
        with client, listener:
            heard.append(client.recv(4096))
            head = b"HTTP/1.0 200 OK\r\nContent-Type: video/x-motion-jpeg\r\n\r\n"
            client.sendall(head + picture)

    threading.Thread(target=serve, daemon=True).start()
    address = f"http://anna:geh%40eim@127.0.0.1:{listener.getsockname()[1]}/cam?x=1"
    camera = open_camera(address, Mode(), "left")
    camera.close()
    assert b"GET /cam?x=1 HTTP/1.0" in heard[0]
    assert b"Authorization: Basic YW5uYTpnZWhAZWlt" in heard[0]
    assert "geh" not in camera.facts.name


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 10_000), longest=st.integers(1, 900))
def test_pictures_are_cut_out_of_a_stream_however_it_comes(seed, longest):
    rng = random.Random(seed)
    thumbnail = jpeg((32, 24), seed=9)  # inside a header segment, with its own end mark
    body = jpeg((64, 48), seed=seed % 4)
    segment = b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2, "big") + thumbnail
    pictures = [numbered(body, 1), body[:2] + segment + body[2:], numbered(body, 3)]
    stream = b"".join(rng.randbytes(seed % 20).replace(b"\xff", b"") + p for p in pictures)
    splitter, out, at = JpegSplitter(), [], 0
    while at < len(stream):
        step = rng.randint(1, longest)
        out += splitter.feed(stream[at : at + step])
        at += step
    assert out == pictures


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes are POSIX")
def test_a_named_pipe_of_pictures_is_a_camera_until_its_writer_ends(tmp_path):
    fifo = tmp_path / "camera"
    os.mkfifo(fifo)

    def write():
        with fifo.open("wb") as pipe:
            for k in range(6):
                pipe.write(numbered(jpeg(), k))
                pipe.flush()
                time.sleep(0.005)

    threading.Thread(target=write, daemon=True).start()
    camera = open_camera(str(fifo), Mode(), "left")
    assert camera.facts.kind == "pipe"
    got = []
    with pytest.raises(OSError, match="has ended"):
        for picture in camera.shots(threading.Event()):
            got.append(number_of(picture.data))
    camera.close()
    camera.close()
    assert got == list(range(6))


def test_a_recording_is_handed_on_unchanged_at_its_own_pace(tmp_path):
    stamps = [0.0, 0.04, 0.06, 0.11]
    video = make_video(tmp_path / "old.nut", stamps_s=stamps)
    began = time.monotonic()
    shots = take(open_camera(str(video), Mode(), "left"), 9)
    assert time.monotonic() - began >= 0.1
    assert [s.device_ns for s in shots] == [round(t * 1e9) for t in stamps]
    with av.open(str(video)) as container:
        packets = [bytes(p) for p in container.demux(video=0) if p.size]
    assert [s.data for s in shots] == packets


def test_only_mjpeg_recordings_stand_in_for_a_camera(tmp_path):
    with pytest.raises(InputError, match="MJPEG"):
        open_camera(str(make_video(tmp_path / "old.mp4", "libx264")), Mode(), "left")


def test_stills_are_shown_at_an_even_rate(tmp_path):
    for k in range(5):
        (tmp_path / f"left_{k}.jpg").write_bytes(numbered(jpeg(), k))
        (tmp_path / f"right_{k}.jpg").write_bytes(numbered(jpeg(), 10 + k))
    shots = take(open_camera(str(tmp_path), Mode(fps=200.0), "right"), 9)
    assert [number_of(s.data) for s in shots] == [10, 11, 12, 13, 14]
    assert [s.device_ns for s in shots] == [k * 5_000_000 for k in range(5)]


def test_the_test_pattern_needs_no_camera():
    camera = open_camera("pattern:", Mode((320, 240), 100.0), "left")
    shots = take(camera, 3)
    assert camera.facts.size_px == (320, 240)
    assert all(s.data.startswith(b"\xff\xd8") for s in shots)
    assert shots[1].device_ns - shots[0].device_ns == 10_000_000


# --- names and lists


def cameras():
    return [
        Listed("v4l2", "/dev/video0", "HD Webcam C920", "A1"),
        Listed("v4l2", "/dev/video2", "HD Webcam C920", "B2"),
        Listed("v4l2", "/dev/video4", "Integrated Camera", ""),
    ]


def test_a_camera_is_found_by_number_address_serial_or_part_of_its_name():
    known = cameras()
    assert find_camera("1", known) is known[1]
    assert find_camera("/dev/video4", known) is known[2]
    assert find_camera("B2", known) is known[1]
    assert find_camera("integrated", known) is known[2]
    with pytest.raises(UsageError, match="several cameras"):
        find_camera("C920", known)
    with pytest.raises(UsageError, match="no camera") as caught:
        find_camera("7", known)
    assert "/dev/video2" in caught.value.why


def test_modes_are_read_out_of_what_ffmpeg_prints():
    dshow = (
        '[dshow @ 0] DirectShow video device options\n[dshow @ 0]  Pin "Capture"\n'
        "[dshow @ 0]   pixel_format=yuyv422  min s=640x480 fps=5 max s=640x480 fps=30\n"
        "[dshow @ 0]   vcodec=mjpeg  min s=1280x720 fps=5 max s=1280x720 fps=30\n"
        "[dshow @ 0]   vcodec=mjpeg  min s=1280x720 fps=5 max s=1280x720 fps=60.0002\n"
    )
    assert [m.words for m in modes_in(dshow)] == ["yuyv422 640x480 30", "mjpeg 1280x720 60"]
    mac = "Supported modes:\n  1280x720@[1.000000 30.000030]fps\n  640x480@[15.0 30.0]fps\n"
    assert [m.words for m in modes_in(mac)] == ["raw 1280x720 30", "raw 640x480 30"]
    assert modes_in("nothing of the kind") == ()


def test_a_device_is_asked_for_mjpeg_in_the_wanted_mode():
    mode = Mode((1280, 720), 30.0)
    wanted = {"video_size": "1280x720", "framerate": "30"}
    v4l2 = open_options("v4l2", mode)
    assert v4l2 == {**wanted, "input_format": "mjpeg", "timestamps": "default"}
    assert open_options("avfoundation", mode) == wanted
    assert "rtbufsize" in open_options("dshow", Mode())


def test_a_device_hands_on_what_ffmpeg_reads_until_it_is_unplugged(tmp_path, monkeypatch):
    """A NUT file stands in for the device: the same way through PyAV, and an end that is sudden."""
    monkeypatch.setitem(device_room.STAMP_KINDS, "nut", "kernel")
    video = make_video(tmp_path / "device.nut", frames=12)
    listed = Listed("nut", str(video), "HD Webcam", "A1")
    camera = device_room.DeviceCamera(listed, Mode(), lambda: Controls(1500.0, 2.0))
    assert (camera.facts.title, camera.facts.serial) == ("HD Webcam", "A1")
    assert (camera.facts.codec, camera.facts.size_px) == ("mjpeg", (128, 96))
    assert camera.controls().exposure_us == 1500.0
    got = []
    with pytest.raises(OSError, match="no more pictures"):
        for picture in camera.shots(threading.Event()):
            got.append(picture)
    camera.close()
    with av.open(str(video)) as container:
        packets = [(bytes(p), p.pts * 1000) for p in container.demux(video=0) if p.size]
    assert [(s.data, s.device_ns) for s in got] == packets


def test_a_device_that_does_not_open_or_codes_otherwise_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(device_room.STAMP_KINDS, "mp4", "kernel")
    gone = Listed("mp4", str(tmp_path / "gone.mp4"), "HD Webcam")
    with pytest.raises(InputError, match="does not open with 1280 x 720 at 30 frames/s"):
        device_room.DeviceCamera(gone, Mode((1280, 720), 30.0), Controls)
    coded = Listed("mp4", str(make_video(tmp_path / "h264.mp4", "libx264")), "HD Webcam")
    with pytest.raises(InputError, match="h264"):
        device_room.DeviceCamera(coded, Mode(), Controls)


class FakeDriver:
    """A camera as the kernel answers for it, one ioctl after another."""

    sizes = ((1280, 720), (640, 480))
    rates = ((1, 30), (1, 15))

    def __init__(self, stubborn=False):
        self.values = {linux.EXPOSURE_AUTO: 3, linux.EXPOSURE_ABSOLUTE: 156, linux.GAIN: 7}
        self.stubborn = stubborn

    def __call__(self, handle, request, buffer):
        name = {getattr(linux, n): n for n in dir(linux) if n.isupper()}
        getattr(self, f"_{name[request].lower()}")(buffer)

    def _querycap(self, buffer):
        struct.pack_into(
            "<16s32s32sIII", buffer, 0, b"uvcvideo", b"HD Webcam", b"usb", 0, 0x84A00001, 0x04200001
        )

    def _enum_fmt(self, buffer):
        if struct.unpack_from("<I", buffer)[0] > 0:
            raise OSError(errno.EINVAL, "end")
        struct.pack_into("<I", buffer, 44, int.from_bytes(b"MJPG", "little"))

    def _enum_framesizes(self, buffer):
        index = struct.unpack_from("<I", buffer)[0]
        if index >= len(self.sizes):
            raise OSError(errno.EINVAL, "end")
        struct.pack_into("<III", buffer, 8, 1, *self.sizes[index])

    def _enum_frameintervals(self, buffer):
        index = struct.unpack_from("<I", buffer)[0]
        if index >= len(self.rates):
            raise OSError(errno.EINVAL, "end")
        struct.pack_into("<III", buffer, 16, 1, *self.rates[index])

    def _queryctrl(self, buffer):
        if struct.unpack_from("<I", buffer)[0] not in self.values:
            raise OSError(errno.EINVAL, "unknown control")

    def _g_ctrl(self, buffer):
        control = struct.unpack_from("<I", buffer)[0]
        if control not in self.values:
            raise OSError(errno.EINVAL, "unknown control")
        struct.pack_into("<i", buffer, 4, self.values[control])

    def _s_ctrl(self, buffer):
        control, value = struct.unpack_from("<Ii", buffer)
        if not (self.stubborn and control == linux.EXPOSURE_AUTO):
            self.values[control] = value


def device(driver):
    return linux.V4l2Device(os.devnull, driver)


def test_what_the_kernel_says_of_a_camera():
    sizes = (linux.QUERYCAP, linux.ENUM_FMT, linux.ENUM_FRAMESIZES, linux.ENUM_FRAMEINTERVALS)
    kernel = (0x80685600, 0xC0405602, 0xC02C564A, 0xC034564B)  # videodev2.h on every machine
    assert sizes == kernel
    assert (linux.G_CTRL, linux.S_CTRL, linux.QUERYCTRL) == (0xC008561B, 0xC008561C, 0xC0445624)
    with device(FakeDriver()) as camera:
        assert camera.captures
        assert camera.card == "HD Webcam"
        assert [m.words for m in camera.modes()] == ["MJPG 1280x720 30/15", "MJPG 640x480 30/15"]
        assert camera.controls() == (15600.0, 7.0)


def test_manual_exposure_is_tried_and_put_back():
    for stubborn in (False, True):
        driver = FakeDriver(stubborn)
        with device(driver) as camera:
            assert camera.manual_exposure_holds() is not stubborn
            assert camera.manual_focus_holds() is None
        assert driver.values[linux.EXPOSURE_AUTO] == 3


def test_exposure_and_focus_are_set_by_hand():
    driver = FakeDriver()
    with device(driver) as camera:
        assert camera.set_by_hand(2000.0)
    assert driver.values[linux.EXPOSURE_AUTO] == linux.EXPOSURE_MANUAL
    assert driver.values[linux.EXPOSURE_ABSOLUTE] == 20
    assert (driver.values[linux.FOCUS_AUTO], driver.values[linux.EXPOSURE_PRIORITY]) == (0, 0)
    driver = FakeDriver()
    driver.values = {}
    driver._s_ctrl = driver._g_ctrl
    with device(driver) as camera:
        assert not camera.set_by_hand(2000.0)


# --- clocks


def shot(device_ns, host_ns):
    return Shot(b"", device_ns, host_ns)


def test_a_camera_on_the_computers_own_clock_keeps_its_stamps():
    clock, host = StampClock(), 7_000_000_000
    placed = [
        clock.place(shot(host + k * 33_000_000 - 4_000_000, host + k * 33_000_000))
        for k in range(5)
    ]
    assert placed == [host + k * 33_000_000 - 4_000_000 for k in range(5)]
    assert clock.shared


def test_a_foreign_clock_is_shifted_once_and_its_intervals_stay_exact():
    clock = StampClock()
    device_ns = [10_000_000 * k for k in range(6)]
    host_ns = [
        9_000_000_000 + d + late for d, late in zip(device_ns, (0, 7, 3, 9, 1, 4), strict=True)
    ]
    placed = [clock.place(shot(d, h)) for d, h in zip(device_ns, host_ns, strict=True)]
    assert [p - placed[0] for p in placed] == device_ns
    assert placed[0] == host_ns[0]
    assert not clock.shared


def test_a_clock_that_is_set_anew_never_runs_backward():
    clock = StampClock()
    places = [
        clock.place(shot(d, h))
        for d, h in [(5_000, 100_000_000), (15_000, 110_000_000), (0, 120_000_000)]
    ]
    places.append(clock.place(shot(10**13, 130_000_000)))
    places.append(clock.place(shot(None, 129_000_000)))  # arrival, but never before the last
    assert places == sorted(places)
    assert len(set(places)) == 5
    assert clock.restarts == 2
