"""What is wrong with the plan of a new trial is told at once, with the field that it is about."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import tui_scene as scene
from small_videos import make_video

from olivevib.cli import main
from olivevib.files.rig_file import write_rig
from olivevib.pipeline import NewTrial, faults, unsaid
from olivevib.trial import Trial


@pytest.fixture
def raw(tmp_path) -> Path:
    for side in ("left", "right"):
        make_video(tmp_path / f"{side}.avi", frames=4)  # 128 x 96 px
        (tmp_path / side).mkdir()
        cv2.imwrite(str(tmp_path / side / "1.png"), np.zeros((96, 128), np.uint8))
    return tmp_path


def plan(raw: Path, **more) -> NewTrial:
    return NewTrial(str(raw / "left.avi"), str(raw / "right.avi"), **more)


def board(raw: Path, **more) -> NewTrial:
    stills = {f"calibration_{side}": str(raw / side) for side in ("left", "right")}
    return plan(raw, **({"board": "coded:5x5,pitch=60,size=44"} | stills | more))


def fields(of: NewTrial) -> list[str]:
    return [fault.field for fault in faults(of)]


def test_a_sound_plan_has_no_fault(raw):
    assert fields(board(raw, size_mm=60.0, ids=(1, 2))) == []


def test_each_fault_names_its_field(raw):
    (raw / "broken.avi").write_bytes(b"no video")
    (raw / "empty").mkdir()
    write_rig(raw / "rig.toml", scene.rig(), {})  # 640 x 480 px
    cv2.imwrite(str(raw / "right" / "1.png"), np.zeros((90, 128), np.uint8))
    assert fields(NewTrial(str(raw / "broken.avi"), str(raw / "right.avi"))) == ["left"]
    assert fields(plan(raw, rig=str(raw / "rig.toml"))) == ["rig"]
    assert fields(board(raw)) == ["calibration_right"]
    assert fields(board(raw, calibration_right=str(raw / "empty"))) == ["calibration_right"]
    assert fields(plan(raw, calibration_left=str(raw / "left"))) == ["calibration_right"]
    assert fields(plan(raw, board="coded:5")) == ["board"]
    assert fields(plan(raw, markers="aruco:NONE")) == ["markers"]
    assert fields(plan(raw, ids=(1, 400))) == ["ids"]
    assert fields(plan(raw, size_mm=-1.0)) == ["size_mm"]
    assert fields(plan(raw, exposure_ms=0.0)) == ["exposure_ms"]
    bound = plan(raw, ids=(1, 2), accelerometer=str(raw / "none.csv"), accelerometer_marker=3)
    assert fields(bound) == ["accelerometer_marker", "accelerometer"]
    assert fields(plan(raw, accelerometer=str(raw / "none.csv"))) == ["accelerometer"]


def test_several_faults_are_all_told(raw):
    assert fields(NewTrial("gone.avi", str(raw / "right.avi"), size_mm=0.0)) == ["size_mm", "left"]


def test_what_is_not_said_is_told_and_what_is_said_is_not(raw):
    words = " ".join(unsaid(plan(raw, markers="aruco:DICT_4X4_1000")))
    for part in ("marker size", "board", "marker ids", "exposure", "band", "row time"):
        assert part in words
    said = {"size_mm": 60.0, "exposure_ms": 2.0, "band_hz": (5.0, 14.0), "shutter": "global"}
    assert unsaid(board(raw, **said)) == ()


def test_new_takes_the_exposure_and_tells_what_is_not_said(raw, monkeypatch, capsys):
    monkeypatch.chdir(raw)
    (raw / "trials").mkdir()
    words = ["new", "T1", "--left", "left.avi", "--right", "right.avi", "--exposure", "2.5"]
    assert main([*words, "--size", "wide"]) == 2
    assert main([*words, "--size", "2:68.4"]) == 0
    markers = Trial.open(raw / "trials" / "T1").settings.markers
    assert (markers.size_of(1), markers.size_of(2)) == (None, 68.4)
    cameras = Trial.open(raw / "trials" / "T1").settings.cameras
    assert (cameras.left.exposure_ms, cameras.right.exposure_ms) == (2.5, 2.5)
    told = capsys.readouterr().err
    assert "not said: band" in told
    assert "not said: exposure" not in told
