"""Two cameras at once: start, vanishing, silence, coming back, full disk, end; and the verb."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time

import pytest

from olivevib.cli import main
from olivevib.errors import InputError, UsageError
from olivevib.files.capture import read_sidecar, sidecar_of, verify
from olivevib.files.container import open_container
from olivevib.files.packets import Packets, scan_video
from olivevib.pipeline.capture import CapturePlan, capture, place_of, trial_from
from olivevib.pipeline.capture import session as session_room
from olivevib.progress import Cancelled
from olivevib.studies.capture.camera import MjpegServer, Plan, jpeg, number_of
from olivevib.trial import Trial

FAST = Plan(fps=100)


def plan(left, right, **more):
    told = {"seconds": 0.8, "preview": False, "warm_up_s": 0.2, "reserve_bytes": 1_000_000}
    return CapturePlan(left.address, right.address, **{**told, **more})


def packets(video):
    container, stream = open_container(video)
    with container:
        return [bytes(p) for p, _ in Packets(video, container, stream)]


def numbers(video):
    return [number_of(data) for data in packets(video)]


def without_gaps(found):
    return found == list(range(found[0], found[-1] + 1))


def test_both_cameras_are_recorded_bit_by_bit_and_judged(tmp_path):
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        states = []
        captured = capture(tmp_path / "T", plan(left, right), states.append)
        assert captured.error is None
        for side, server in (("left", left), ("right", right)):
            video = captured.videos[side]
            found = numbers(video)
            assert without_gaps(found)
            assert 60 <= len(found) <= 100
            assert packets(video) == [server.data(n) for n in found]
            assert verify(video).whole
            assert scan_video(video).truncated is None
    assert "0 drops" in captured.verdict.words
    assert captured.cautions == ()
    assert not states[0].recording
    assert states[-1].recording
    assert states[-1].cameras["left"].frames > 40
    record = (tmp_path / "T" / "capture.toml").read_text()
    assert "rate_hz" in record
    assert "0 drops" in record


def test_the_recording_becomes_a_trial_where_it_lies(tmp_path):
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        asked = plan(left, right, ids=(1, 2), band_hz=(5.0, 45.0))
        captured = capture(tmp_path / "T", asked)
    trial = trial_from(tmp_path / "T", asked, captured, size_mm=60.0)
    cameras = Trial.open(tmp_path / "T").settings.cameras
    assert (cameras.left.video, cameras.left.stamps) == ("left.nut", "left.stamps.csv")
    assert (cameras.right.video, cameras.right.stamps) == ("right.nut", "right.stamps.csv")
    assert trial.settings.markers.ids == (1, 2)
    assert trial.settings.vibration.band_hz == (5.0, 45.0)
    with pytest.raises(UsageError, match="a trial already"):
        place_of(tmp_path / "T", asked)


def test_a_camera_that_vanishes_closes_its_file_at_once_and_leaves_the_other_alone(tmp_path):
    seen = {}
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:

        def watch(state):
            camera = state.cameras["left"]
            if state.elapsed_s > 0.4 and "pulled" not in seen:
                left.vanish()
                seen["pulled"] = time.monotonic()
            if camera.gone and "closed" not in seen:
                seen["closed"] = time.monotonic()
                seen["truncated"] = scan_video(tmp_path / "T" / "left.nut").truncated

        captured = capture(tmp_path / "T", plan(left, right, seconds=1.5), watch)
    assert seen["closed"] - seen["pulled"] < 1.0
    assert seen["truncated"] is None
    assert without_gaps(numbers(captured.videos["right"]))
    assert len(numbers(captured.videos["right"])) > 130
    assert "camera-vanished" in {c.code for c in captured.cautions}
    assert verify(captured.videos["left"]).whole


def test_a_silent_camera_is_closed_within_a_second_and_goes_on_when_it_comes_back(tmp_path):
    seen = {}
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:

        def watch(state):
            camera = state.cameras["left"]
            if state.elapsed_s > 0.3 and "paused" not in seen:
                left.pause.set()
                seen["paused"] = time.monotonic()
            if camera.gone and "closed" not in seen:
                seen["closed"] = time.monotonic()
                seen["truncated"] = scan_video(tmp_path / "T" / "left.nut").truncated
                left.pause.clear()

        captured = capture(tmp_path / "T", plan(left, right, seconds=2.2), watch)
    assert seen["closed"] - seen["paused"] < 1.0
    assert seen["truncated"] is None
    video = captured.videos["left"]
    found = numbers(video)
    assert without_gaps(found)  # nothing that the camera sent was lost
    assert len(found) > 90
    assert verify(video).whole
    assert not (tmp_path / "T" / "left-2.nut").exists()
    assert without_gaps(numbers(captured.videos["right"]))


@pytest.mark.slow
def test_a_pause_of_our_own_is_not_the_cameras_silence(tmp_path):
    slept = []

    def watch(state):
        if state.elapsed_s > 0.2 and not slept:
            slept.append(time.sleep(1.1))

    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        captured = capture(tmp_path / "T", plan(left, right, seconds=1.6), watch)
    assert captured.cautions == ()
    assert without_gaps(numbers(captured.videos["left"]))


@pytest.mark.slow
def test_a_camera_that_is_plugged_in_again_is_found_again(tmp_path):
    address = {}
    with MjpegServer(FAST) as right:
        left = MjpegServer(FAST)
        port = int(left.address.rsplit(":", 1)[1].split("/")[0])

        def watch(state):
            if state.elapsed_s > 0.3 and "gone" not in address:
                left.vanish()
                address["gone"] = state.cameras["left"].frames
            if state.cameras["left"].gone and "back" not in address:
                address["back"] = MjpegServer(FAST, port=port)

        captured = capture(tmp_path / "T", plan(left, right, seconds=2.5), watch)
        address["back"].vanish()
    found = numbers(captured.videos["left"])
    assert len(found) > address["gone"] + 40
    assert found[-1] < 400  # it began to count anew
    stamps = [line.stamp_us for line in read_sidecar(sidecar_of(captured.videos["left"])).lines]
    assert stamps == sorted(stamps)
    assert verify(captured.videos["left"]).whole


def test_somebody_ends_an_open_recording_by_cancelling(tmp_path):
    def watch(state):
        if state.elapsed_s > 0.3:
            raise Cancelled

    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        captured = capture(tmp_path / "T", plan(left, right, seconds=None), watch)
    assert captured.error is None
    assert scan_video(captured.videos["left"]).truncated is None
    assert 0.3 < scan_video(captured.videos["left"]).stamps_s[-1] < 1.0


def test_an_error_in_the_screen_still_closes_both_files(tmp_path):
    def watch(state):
        if state.elapsed_s > 0.2:
            raise ZeroDivisionError

    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        with pytest.raises(ZeroDivisionError):
            capture(tmp_path / "T", plan(left, right), watch)
        assert scan_video(tmp_path / "T" / "left.nut").truncated is None
        assert scan_video(tmp_path / "T" / "right.nut").truncated is None
    assert not [t for t in threading.enumerate() if "camera" in t.name]


def test_what_cannot_be_recorded_is_told_before_anything_is_written(tmp_path):
    with MjpegServer(FAST) as left, MjpegServer(Plan(size=(64, 48))) as other:
        with pytest.raises(UsageError, match="128 x 96"):
            capture(tmp_path / "T", plan(left, other))
        with pytest.raises(UsageError, match="--seconds 0"):
            capture(tmp_path / "T", plan(left, left, seconds=0.0))
        with pytest.raises(UsageError, match="no marker 4000"):
            capture(tmp_path / "T", plan(left, left, ids=(4000,)))
        with pytest.raises(InputError, match="nearly full"):
            capture(tmp_path / "T", plan(left, other, reserve_bytes=10**18))
        with pytest.raises(UsageError, match="no camera"):
            capture(tmp_path / "T", CapturePlan(left.address, "camera 17", preview=False))
        (tmp_path / "T" / "left.mkv").write_bytes(b"")
        with pytest.raises(UsageError, match="there already"):
            capture(tmp_path / "T", plan(left, left))
    assert [p.name for p in (tmp_path / "T").iterdir()] == ["left.mkv"]


def full_after(monkeypatch, seconds):
    """The disk has room for so long, then nearly none."""
    begun = time.monotonic()

    def free_bytes(folder):
        return 500_000 if time.monotonic() - begun > seconds else 10**12

    monkeypatch.setattr(session_room, "_free_bytes", free_bytes)


def test_recording_stops_before_the_disk_is_full(tmp_path, monkeypatch):
    full_after(monkeypatch, 1.2)
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        captured = capture(tmp_path / "T", plan(left, right, seconds=30))
    assert isinstance(captured.error, InputError)
    assert "nearly full" in captured.error.what
    assert verify(captured.videos["left"]).whole
    assert verify(captured.videos["right"]).whole


def test_a_full_disk_is_an_error_with_everything_kept(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    full_after(monkeypatch, 1.8)
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        command = ["capture", "T01", "--left", left.address, "--right", right.address]
        assert main([*command, "--seconds", "30", "--no-preview"]) == 1
    out, told = capsys.readouterr()
    assert "nearly full" in told
    assert "drops" in out
    assert (tmp_path / "T01" / "left.nut").is_file()


# --- the verb


def test_the_verb_records_a_trial_and_says_what_it_is_good_for(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        command = ["capture", "T01", "--left", left.address, "--right", right.address]
        assert main([*command, "--seconds", "0.5", "--no-preview"]) == 0
        out, told = capsys.readouterr()
        assert out.startswith("0 drops, cameras ")
        assert "good for" in out
        assert "made T01" in told
        assert main([*command, "--seconds", "0.5", "--no-preview"]) == 2
        assert main(["capture", "T02", "--left", "7", "--right", "8"]) == 2
    assert main(["check", "T01"]) == 0
    assert "every checksum right" in capsys.readouterr().out


def recorded_trial(folder):
    """A trial with half a second of two cameras."""
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        asked = plan(left, right, seconds=0.4)
        trial_from(folder, asked, capture(folder, asked))


def test_check_names_the_frames_that_were_altered_afterwards(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    recorded_trial(tmp_path / "T01")
    video = tmp_path / "T01" / "left.nut"
    frames = packets(video)
    data = bytearray(video.read_bytes())
    data[data.index(frames[20]) + 900] ^= 4
    video.write_bytes(data)
    capsys.readouterr()
    assert main(["check", "T01"]) == 3
    assert "altered since they were recorded: 20" in capsys.readouterr().out


def test_a_copied_recording_keeps_its_checksums(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    recorded_trial(tmp_path / "T01")
    again = ["new", "T02", "--left", "T01/left.nut", "--right", "T01/right.nut"]
    again += ["--left-stamps", "T01/left.stamps.csv", "--right-stamps", "T01/right.stamps.csv"]
    assert main(again) == 0
    assert (tmp_path / "T02" / "right.stamps.csv").is_file()
    assert main(["check", "T02"]) == 0
    assert capsys.readouterr().out.count("every checksum right") == 2


def test_the_board_waits_for_its_tree_and_the_tree_for_its_board(tmp_path):
    board = "coded:5x5,pitch=60,size=44"
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        for name, order in (("before", (board, None)), ("after", (None, board))):
            for spec in order:
                asked = plan(left, right, seconds=0.2, warm_up_s=0.1, board=spec)
                place = place_of(tmp_path / name, asked)
                trial_from(tmp_path / name, asked, capture(place, asked))
    for name in ("before", "after"):
        told = Trial.open(tmp_path / name).settings.calibration
        assert (told.left, told.right) == ("calibration/left.nut", "calibration/right.nut")
        assert told.board == board


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.slow
@pytest.mark.parametrize(("seconds", "code"), [(None, 0), ("60", 130)])
def test_ctrl_c_ends_the_recording_cleanly(tmp_path, seconds, code):
    with MjpegServer(FAST) as left, MjpegServer(FAST) as right:
        command = [sys.executable, "-m", "olivevib", "capture", str(tmp_path / "T")]
        command += ["--left", left.address, "--right", right.address, "--no-preview"]
        command += ["--seconds", seconds] if seconds else []
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            while not (tmp_path / "T" / "right.nut").exists():
                time.sleep(0.02)
            time.sleep(0.3)
            process.send_signal(signal.SIGINT)
            out, told = process.communicate(timeout=20)
    assert process.returncode == code, told.decode()
    assert b"good for" in out
    assert verify(tmp_path / "T" / "left.nut").whole
    assert (tmp_path / "T" / "trial.toml").is_file()


def test_slow_and_dropping_cameras_are_told(tmp_path):
    lossy = Plan(fps=100, drop=frozenset(range(60, 140, 9)), pictures=[jpeg()])
    with MjpegServer(lossy) as left, MjpegServer(FAST) as right:
        captured = capture(tmp_path / "T", plan(left, right, seconds=1.2))
    codes = {c.code for c in captured.cautions}
    assert "dropped-frames" in codes
    dropped = captured.verdict.fits["left"].dropped.size
    gaps = numbers(captured.videos["left"])
    assert dropped == gaps[-1] - gaps[0] + 1 - len(gaps)
