"""What ``olivevib doctor`` says of cameras and of the disk."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import pytest

from olivevib.files.capture import Listed, Mode, open_camera
from olivevib.files.capture.v4l2 import CameraMode
from olivevib.pipeline import machine
from olivevib.pipeline.capture import devices
from olivevib.studies.capture.camera import MjpegServer, Plan

MODES = (
    CameraMode("YUYV", (640, 480), (30.0,)),
    CameraMode("MJPG", (640, 480), (60.0, 30.0)),
    CameraMode("MJPG", (1280, 720), (30.0, 15.0)),
)


def report(address, measure_s=0.4):
    listed = Listed("test", address, "HD Webcam", "A1", MODES)
    return devices.report_camera(listed, open_camera, measure_s)


def test_the_true_rate_of_a_camera_is_measured():
    with MjpegServer(Plan(fps=100)) as server:
        told = report(server.address)
    assert told.fps == pytest.approx(100, rel=1e-3)
    assert told.rate_bytes_s == pytest.approx(100 * len(server.data(0)), rel=0.1)
    assert told.words.startswith("HD Webcam (A1); 100.0 frames/s measured; modes: MJPG 1280x720@30")


def test_modes_are_told_by_coding_and_size():
    assert devices.mode_words(MODES) == "MJPG 1280x720@30, MJPG 640x480@60, YUYV 640x480@30"
    many = tuple(CameraMode("MJPG", (100 + k, 100), (30.0,)) for k in range(20))
    assert devices.mode_words(many).endswith("…")


def test_a_camera_that_does_not_open_or_hangs_is_told_and_holds_nobody_up(monkeypatch):
    monkeypatch.setattr(devices, "PATIENCE_S", 0.2)
    assert "names no camera" in report("camera 17").words
    forever = threading.Event()

    def hanging(name, mode, side):
        forever.wait(5)
        return open_camera("pattern:", Mode(), "left")

    told = devices.report_camera(Listed("test", "x", "HD Webcam"), hanging, 0.1)
    forever.set()
    assert told.fault == "it hangs"
    assert math.isnan(told.fps)


def test_the_doctor_lists_cameras_and_the_minutes_that_the_disk_has_left(tmp_path, monkeypatch):
    listed = Listed("v4l2", "/dev/video0", "HD Webcam", "A1", MODES)
    good = devices.CameraReport(listed, 29.97, 3e6, True, None)
    weak = replace(good, exposure_holds=False, focus_holds=False)
    monkeypatch.setattr(devices, "report_cameras", lambda: [good, weak])
    checks = [c for c in machine.examine(tmp_path) if c.group in ("cameras", "disk")]
    assert [c.what for c in checks[:2]] == ["0: /dev/video0", "1: /dev/video0"]
    assert [c.state for c in checks[:2]] == ["ok", "note"]
    assert "30.0 frames/s measured; manual exposure holds" in checks[0].words
    assert "manual exposure does NOT hold; manual focus does NOT hold" in checks[1].words
    assert "minutes of two MJPEG webcams" in checks[2].words
    monkeypatch.setattr(devices, "report_cameras", list)
    assert any(c.what == "none" for c in machine.examine(tmp_path) if c.group == "cameras")
