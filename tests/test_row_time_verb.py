"""From the video of a flashing lamp to the row time of the next trial."""

from __future__ import annotations

import shutil

import cv2
import numpy as np
import pytest
from test_calibration_row_time import HEIGHT, profiles

from olivevib.cli import main
from olivevib.errors import InputError, UsageError
from olivevib.files.capture import CameraFacts, Controls, Recording, Shot
from olivevib.pipeline.row_time import measure_row_time
from olivevib.studies.capture.camera import MjpegServer, Plan
from olivevib.trial import Trial
from olivevib.trial.camera_book import CameraMode, Entry, read_book, recall, remember

LED_HZ, READOUT_S, WIDTH = 500.0, 0.027, 160


def film(folder, readout_s=READOUT_S, quality=85, led_hz=LED_HZ):
    """An MJPEG recording of the lamp, through paper, by a sensor with a known readout."""
    rows, t_s = profiles(readout_s, led_hz, noise=0.0, frames=45)
    rng = np.random.default_rng(3)
    shade = 1 - 0.3 * np.linspace(-1, 1, WIDTH) ** 2
    facts = CameraFacts("lamp", "lamp", "S1", "v4l2", "mjpeg", "", (WIDTH, HEIGHT), 30.0, "kernel")
    recording = Recording(folder / "left.nut", facts, 0)
    for row, t in zip(rows, t_s, strict=True):
        grey = row[:, None] * shade + rng.normal(0, 2.0, (HEIGHT, WIDTH))
        coded = cv2.imencode(
            ".jpg", np.clip(grey, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality]
        )[1]
        recording.append(Shot(coded.tobytes(), None, 0), round(t * 1e9), Controls())
    recording.close()
    return folder / "left.nut"


@pytest.mark.parametrize("readout_s", [0.027, -0.027])
def test_the_row_time_of_a_simulated_sensor_is_right_within_one_percent(tmp_path, readout_s):
    found = measure_row_time(film(tmp_path, readout_s), LED_HZ).found
    assert found.row_time_s == pytest.approx(readout_s / HEIGHT, rel=0.01)
    assert abs(found.row_time_s - readout_s / HEIGHT) < 4 * found.sigma_s
    assert found.sign_known


def test_the_verb_keeps_it_for_the_camera_and_its_mode(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trials").mkdir()
    video = film(tmp_path)
    assert main(["rowtime", str(video), "--led", "500"]) == 0
    out, told = capsys.readouterr()
    assert float(out.split()[2]) == pytest.approx(37.5, rel=0.01)
    assert "readout 27.0" in out
    assert "read downward" in out
    assert "Not kept" in told
    assert main(["rowtime", str(video), "--led", "500", "--camera", "S1"]) == 0
    (entry,) = read_book(tmp_path)
    assert entry.mode.same(CameraMode("S1", (WIDTH, HEIGHT), 30.0))
    assert entry.row_time_us == pytest.approx(37.5, rel=0.01)
    assert "500 Hz" in entry.source


def test_the_recorder_says_whose_recording_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trials").mkdir()
    film(tmp_path)
    (tmp_path / "capture.toml").write_text('[left]\ntitle = "HD Webcam"\nserial = "A1"\n')
    assert main(["rowtime", "left.nut", "--led", "500"]) == 0
    assert read_book(tmp_path)[0].mode.camera == "A1"


def test_a_recording_without_stripes_is_no_row_time(tmp_path):
    with pytest.raises(InputError, match=r"no stripes|too wide"):
        measure_row_time(film(tmp_path, readout_s=0.0), LED_HZ)
    with pytest.raises(UsageError, match="no frequency"):
        measure_row_time(tmp_path / "left.nut", -5.0)


def test_a_new_capture_takes_the_row_time_from_the_book(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trials").mkdir()
    mode = CameraMode("127.0.0.1", (128, 96), 100.0)
    remember(tmp_path, Entry(mode, 37.5, 0.04, "lamp at 500 Hz"))
    with MjpegServer(Plan(fps=100)) as left, MjpegServer(Plan(fps=100)) as right:
        command = ["capture", "T1", "--left", left.address, "--right", right.address]
        assert main([*command, "--seconds", "0.5", "--no-preview"]) == 0
    cameras = Trial.open(tmp_path / "trials" / "T1").settings.cameras
    assert cameras.shutter == "rolling"
    assert cameras.right.row_time_us == 37.5
    assert cameras.left.row_time_sigma_us == 0.04


def test_the_book_keeps_one_entry_a_camera_and_mode(tmp_path):
    modes = [CameraMode(c, s, f) for c in "AB" for s in ((640, 480), (1280, 720)) for f in (30, 60)]
    for k, mode in enumerate(modes * 2):
        remember(tmp_path, Entry(mode, float(k), 0.1, "test"))
    assert len(read_book(tmp_path)) == len(modes)
    found = recall(tmp_path, CameraMode("B", (640, 480), 29.97))
    assert found.row_time_us == len(modes) + modes.index(CameraMode("B", (640, 480), 30))
    assert recall(tmp_path, CameraMode("C", (640, 480), 30.0)) is None


def test_a_broken_book_is_named(tmp_path):
    (tmp_path / "cameras.toml").write_text("[[camera]]\nsize_px = 3\n")
    with pytest.raises(InputError, match=r"cameras\.toml"):
        read_book(tmp_path)
    shutil.rmtree(tmp_path)
    assert read_book(tmp_path) == []
