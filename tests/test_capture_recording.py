"""What is on the disk: bit-identical pictures, stamps to the microsecond, and what damage costs."""

from __future__ import annotations

import subprocess
import sys
import textwrap
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.errors import InputError, UsageError
from olivevib.files.capture import (
    CameraFacts,
    Controls,
    Recording,
    Shot,
    frame_list,
    join_parts,
    read_sidecar,
    sidecar_of,
    verify,
)
from olivevib.files.capture.sidecar import HEADER, Line
from olivevib.files.container import open_container
from olivevib.files.packets import Packets, scan_video
from olivevib.files.stamps import read_stamp_file
from olivevib.files.video import Video
from olivevib.studies.capture.camera import jpeg, number_of, numbered

FACTS = CameraFacts("test", "test", "S1", "http", "mjpeg", "", (128, 96), 30.0, "header")
PICTURES = [jpeg(seed=k) for k in range(3)]


def write(video, stamps_ns, origin_ns=0, facts=FACTS, close=True):
    """A recording with a numbered picture at each time; returns what was handed in."""
    recording = Recording(video, facts, origin_ns)
    shots = []
    for k, stamp in enumerate(stamps_ns):
        data = numbered(PICTURES[k % 3], k)
        shots.append(Shot(data, stamp - 5, stamp + 40_000))
        recording.append(shots[-1], stamp, Controls(1500.0, 4.0))
    if close:
        recording.close()
    return shots


def packets(video):
    container, stream = open_container(video)
    with container:
        return [(bytes(p), p.pts) for p, _ in Packets(video, container, stream)]


def test_pictures_are_bit_identical_and_stamps_keep_the_microsecond(tmp_path):
    rng = np.random.default_rng(1)
    origin = 987_654_321_987
    stamps = (origin + np.cumsum(rng.integers(2_000_000, 40_000_000, 200))).tolist()
    video = tmp_path / "left.nut"
    shots = write(video, stamps, origin)
    found = packets(video)
    assert [data for data, _ in found] == [shot.data for shot in shots]
    scanned = scan_video(video)
    assert scanned.truncated is None
    wanted_s = (np.array(stamps) - origin) * 1e-9
    assert np.abs(scanned.stamps_s - wanted_s).max() <= 0.51e-6
    by_file = read_stamp_file(sidecar_of(video), "left.nut", 200)
    assert np.abs(by_file - scanned.stamps_s).max() < 1e-9
    with Video.open(video) as opened:
        assert sum(f.grey is not None for f in opened.frames()) == 200
        assert opened.cautions == ()


def test_the_side_car_says_all_that_is_known_of_a_frame(tmp_path):
    video = tmp_path / "left.nut"
    shots = write(video, [1_000_000, 34_333_333])
    sidecar = read_sidecar(sidecar_of(video))
    assert sidecar.damaged == ()
    assert sidecar.lines[1] == Line(
        sequence=1,
        stamp_us=34_333,
        stamp_kind="header",
        device_ns=34_333_328,
        host_ns=34_373_333,
        size=len(shots[1].data),
        crc32=zlib.crc32(shots[1].data),
        exposure_us=1500.0,
        gain=4.0,
    )
    assert sidecar_of(video).read_bytes().startswith(HEADER)


def test_a_frame_without_a_stamp_of_its_own_says_so(tmp_path):
    recording = Recording(tmp_path / "left.nut", FACTS, 0)
    recording.append(Shot(PICTURES[0], None, 7_000), 7_000, Controls())
    recording.close()
    (line,) = read_sidecar(tmp_path / "left.stamps.csv").lines
    assert (line.stamp_kind, line.device_ns, line.exposure_us) == ("host", None, None)


def test_frames_from_before_the_start_are_left_out_and_stamps_increase(tmp_path):
    video = tmp_path / "left.nut"
    write(video, [5_000, 9_999_600, 10_000_400, 10_000_600, 10_000_700], origin_ns=10_000_000)
    assert [pts for _, pts in packets(video)] == [0, 1, 2, 3]
    assert [number_of(d) for d, _ in packets(video)] == [1, 2, 3, 4]


def test_nothing_is_ever_overwritten(tmp_path):
    (tmp_path / "left.stamps.csv").write_text("mine")
    with pytest.raises(UsageError, match="there already"):
        Recording(tmp_path / "left.nut", FACTS, 0)
    assert (tmp_path / "left.stamps.csv").read_text() == "mine"
    assert not (tmp_path / "left.nut").exists()


def test_a_recording_without_a_frame_leaves_nothing_behind(tmp_path):
    Recording(tmp_path / "left.nut", FACTS, 0).close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("pixels", ["yuyv422", "nv12", "gray"])
def test_raw_pictures_are_kept_as_they_are(tmp_path, pixels):
    size = {"yuyv422": 2, "nv12": 1.5, "gray": 1}[pixels]
    facts = replace(FACTS, codec="rawvideo", pixel_format=pixels, size_px=(64, 48))
    data = [bytes(np.random.default_rng(k).bytes(int(64 * 48 * size))) for k in range(4)]
    recording = Recording(tmp_path / "left.nut", facts, 0)
    for k, picture in enumerate(data):
        recording.append(Shot(picture, None, k * 10**7), k * 10**7, Controls())
    recording.close()
    assert [d for d, _ in packets(tmp_path / "left.nut")] == data
    with Video.open(tmp_path / "left.nut") as opened:
        greys = [f.grey for f in opened.frames()]
    step = 2 if pixels == "yuyv422" else 1
    luma = np.frombuffer(data[2], np.uint8)[: 64 * 48 * step : step].reshape(48, 64)
    assert np.array_equal(greys[2], luma)


@settings(deadline=None, max_examples=40)
@given(share=st.floats(0.05, 1.0))
def test_a_recorder_stopped_at_any_byte_loses_at_most_the_frame_in_flight(tmp_path_factory, share):
    folder = tmp_path_factory.mktemp("killed")
    video = folder / "left.nut"
    write(video, [k * 33_333_333 for k in range(40)], close=False)
    whole = video.read_bytes()
    cut = int(len(whole) * share)
    complete = [k for k, (_, end) in enumerate(payloads(video)) if end <= cut]
    video.write_bytes(whole[:cut])
    if not complete:
        return
    lines = sidecar_of(video).read_bytes().split(b"\n")
    sidecar_of(video).write_bytes(b"\n".join(lines[: len(complete) + 2]) + b"\n")
    with Video.open(video) as opened:
        frames = list(opened.frames())
        assert "video-truncated" in {c.code for c in opened.cautions}
    sound = [f.index for f in frames if f.grey is not None]
    assert sound[: len(complete)] == complete
    assert len(frames) - len(complete) <= 1
    assert read_stamp_file(sidecar_of(video), "left.nut", len(frames)).size == len(frames)
    told = verify(video)
    assert told.suspects == ()
    assert told.in_flight in (None, len(complete))


def test_a_killed_recorder_leaves_recordings_that_open(tmp_path):
    script = f"""
        import time
        from pathlib import Path
        from olivevib.files.capture import CameraFacts, Controls, Recording, Shot
        facts = CameraFacts("t", "t", "", "http", "mjpeg", "", (128, 96), 30.0, "header")
        recording = Recording(Path({str(tmp_path)!r}) / "left.nut", facts, 0)
        picture = bytes.fromhex({PICTURES[0].hex()!r})
        for k in range(100000):
            recording.append(Shot(picture, k * 10**6, k * 10**6), k * 10**6, Controls())
            print(k, flush=True)
            time.sleep(0.001)
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if int(line) >= 60:
                break
        process.kill()
        said = [int(line) for line in process.stdout if line.endswith("\n")]
    acknowledged = max([60, *said])
    with Video.open(tmp_path / "left.nut") as opened:
        sound = sum(f.grey is not None for f in opened.frames())
    assert acknowledged + 1 <= sound <= acknowledged + 2
    assert verify(tmp_path / "left.nut").suspects == ()


# --- disk full


def test_a_full_disk_takes_the_last_frame_back_and_keeps_the_rest(tmp_path):
    pytest.importorskip("resource", reason="file-size limits are POSIX")
    script = f"""
        import resource, signal
        from pathlib import Path
        from olivevib.errors import InputError
        from olivevib.files.capture import CameraFacts, Controls, DiskFull, Recording, Shot
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
        facts = CameraFacts("t", "t", "", "http", "mjpeg", "", (128, 96), 30.0, "header")
        recording = Recording(Path({str(tmp_path)!r}) / "left.nut", facts, 0)
        picture = bytes.fromhex({PICTURES[0].hex()!r})
        try:
            for k in range(1000):
                recording.append(Shot(picture, k * 10**6, k * 10**6), k * 10**6, Controls())
        except DiskFull as error:
            print(recording.frames, error.what)
        recording.close()
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    count = int(told.split()[0])
    assert "the disk is full" in told
    assert count == 50_000 // (len(PICTURES[0]) + 20)  # a frame costs some 20 bytes of container
    video = tmp_path / "left.nut"
    assert len(packets(video)) == count
    assert len(read_sidecar(sidecar_of(video)).lines) == count
    assert verify(video).suspects == ()


# --- checksums


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    video = tmp_path_factory.mktemp("sound") / "left.nut"
    write(video, [k * 33_333_333 for k in range(120)])
    return video


def copied(sound, folder):
    video = folder / "left.nut"
    video.write_bytes(sound.read_bytes())
    sidecar_of(video).write_bytes(sidecar_of(sound).read_bytes())
    return video


def payloads(video):
    data = video.read_bytes()
    at = [data.index(p) for p, _ in packets(video)]
    return [(a, a + len(p)) for a, (p, _) in zip(at, packets(video), strict=True)]


def test_a_sound_recording_raises_no_alarm(sound):
    told = verify(sound)
    assert told.whole
    assert told.words == "120 frames, every checksum right"


@pytest.mark.parametrize("seed", range(8))
def test_forty_flipped_bytes_are_named_frame_by_frame(sound, tmp_path, seed):
    rng = np.random.default_rng(seed)
    video = copied(sound, tmp_path)
    data = np.frombuffer(video.read_bytes(), np.uint8).copy()
    places = payloads(video)
    at = rng.choice(data.size, 40, replace=False)
    data[at] ^= rng.integers(1, 256, 40, dtype=np.uint8)
    truly = {k for k, (a, b) in enumerate(places) if ((at >= a) & (at < b)).any()}
    video.write_bytes(data.tobytes())
    told = verify(video)
    assert truly <= set(told.suspects) | {told.in_flight}
    inside = all(any(a <= x < b for a, b in places) for x in at)
    if inside:
        assert set(told.altered) == truly
    assert not told.whole


def test_one_flipped_bit_in_one_frame_names_that_frame_alone(sound, tmp_path):
    video = copied(sound, tmp_path)
    data = bytearray(video.read_bytes())
    begin, end = payloads(video)[57]
    data[(begin + end) // 2] ^= 1
    video.write_bytes(data)
    told = verify(video)
    assert told.suspects == told.altered == (57,)
    assert told.words == "frames altered since they were recorded: 57"


def test_a_damaged_side_car_is_not_blamed_on_the_frames(sound, tmp_path):
    video = copied(sound, tmp_path)
    lines = sidecar_of(video).read_bytes().split(b"\n")
    lines[11] = lines[11].replace(b",header,", b",hexder,")
    sidecar_of(video).write_bytes(b"\n".join(lines))
    told = verify(video)
    assert told.damaged_lines == (12,)
    assert told.suspects == ()
    assert told.unlisted == 1
    assert not told.whole


def test_a_cut_copy_misses_its_last_frames_by_number(sound, tmp_path):
    video = copied(sound, tmp_path)
    begin, _ = payloads(video)[100]
    video.write_bytes(video.read_bytes()[: begin - 30])
    told = verify(video)
    assert told.missing == tuple(range(100, 119))
    assert told.in_flight == 119


def test_a_recording_without_side_car_is_not_judged(sound, tmp_path):
    video = copied(sound, tmp_path)
    sidecar_of(video).unlink()
    assert verify(video) is None
    sidecar_of(video).write_text("time_s\n0.0\n")
    assert verify(video) is None


def test_numbers_are_told_as_stretches():
    assert frame_list((4, 7, 8, 9, 12)) == "4, 7-9, 12"
    assert frame_list(tuple(range(0, 60, 2))).endswith("and more, 30 in all")


# --- parts


def test_parts_become_one_recording_with_its_gap(tmp_path):
    first, second = tmp_path / "left.nut", tmp_path / "left-2.nut"
    early = write(first, [k * 33_333_333 for k in range(10)])
    late = write(second, [10**9 + k * 33_333_333 for k in range(7)])
    assert join_parts([first, second], FACTS) == first
    assert sorted(p.name for p in tmp_path.iterdir()) == ["left.nut", "left.stamps.csv"]
    found = packets(first)
    assert [d for d, _ in found] == [s.data for s in (*early, *late)]
    assert [p for _, p in found][9:11] == [300_000, 1_000_000]
    assert verify(first).whole
    lines = read_sidecar(sidecar_of(first)).lines
    assert [line.sequence for line in lines] == list(range(17))
    assert lines[12].exposure_us == 1500.0


def test_parts_stay_where_the_disk_has_no_room(tmp_path, monkeypatch):
    first, second = tmp_path / "left.nut", tmp_path / "left-2.nut"
    write(first, [0, 10**7])
    write(second, [10**9, 10**9 + 10**7])

    def full(self, shot, placed_ns, controls):
        raise InputError("the disk is full")

    monkeypatch.setattr(Recording, "append", full)
    with pytest.raises(InputError):
        join_parts([first, second], FACTS)
    names = ["left-2.nut", "left-2.stamps.csv", "left.nut", "left.stamps.csv"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
