"""What a newcomer types that is no trial, port, folder or setting: told before anything is made."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from small_videos import recordings

from olivevib.cli import main
from olivevib.errors import UsageError
from olivevib.pipeline import NewTrial, new_trial, unsaid
from olivevib.pipeline.capture import CapturePlan
from olivevib.pipeline.capture import capture as record
from olivevib.pipeline.simulated import simulated_trial, truth_folder
from olivevib.simulation import SCENARIOS
from olivevib.trial.workspace import named


@pytest.fixture
def raw(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with two short recordings; the current folder."""
    monkeypatch.chdir(recordings(tmp_path))
    return tmp_path


def test_the_folder_here_has_a_name_of_its_own(tmp_path, monkeypatch):
    (tmp_path / "mine" / "below").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "mine" / "below")
    assert named(Path()).name == "below"
    assert named(Path("..")).name == "mine"
    assert named(Path("T1")) == Path("T1")
    with pytest.raises(UsageError, match="cannot be a trial"):
        named(Path("/"))


def test_a_trial_may_be_made_in_the_folder_here(raw, monkeypatch):
    (raw / "T1").mkdir()
    monkeypatch.chdir(raw / "T1")
    trial = new_trial(Path(), NewTrial("../left.avi", "../right.avi"))
    assert trial.name == "T1"
    assert (raw / "T1" / "left.avi").is_file()
    with pytest.raises(UsageError, match="is a trial already"):
        simulated_trial(Path(), SCENARIOS[0].name)
    assert truth_folder(named(Path())) == raw / "T1-truth"
    assert main(["demo", "."]) == 2  # and no ValueError of a folder without a name


@pytest.mark.parametrize("port", ["99999", "0", "-1"])
def test_a_port_that_is_none_is_refused_before_an_address_is_told(port, capsys):
    pytest.importorskip("textual_serve")
    assert main(["serve", "--port", port]) == 2
    told = capsys.readouterr().err
    assert f"--port {port} is no port" in told
    assert "Open http" not in told


def test_a_port_that_is_taken_is_told_before_an_address(capsys):
    pytest.importorskip("textual_serve")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["serve", "--port", str(port)]) == 2
    told = capsys.readouterr().err
    assert "choose another one with --port" in told
    assert "Open http" not in told


def test_a_workspace_that_cannot_be_made_is_told(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["init", str(tmp_path / "file" / "olive")]) == 1
    told = capsys.readouterr().err
    assert "could not be written" in told
    assert "unforeseen" not in told


def test_a_forbidden_file_is_no_fault_of_the_program(monkeypatch, capsys):
    def refuse(*_: object) -> object:
        raise PermissionError(13, "Permission denied", "/there/trials")

    monkeypatch.setattr("olivevib.trial.workspace.make_workspace", refuse)
    assert main(["init"]) == 1
    told = capsys.readouterr().err
    assert "/there/trials may not be read or written." in told
    assert "unforeseen" not in told


def test_settings_are_checked_before_anything_is_copied(raw, monkeypatch, capsys):
    copied = []
    monkeypatch.setattr("olivevib.pipeline.new._copy", lambda *a: copied.append(a))
    words = ["new", "T17", "--left", "left.avi", "--right", "right.avi"]
    assert main([*words, "--set", "detection.fil=0.7"]) == 2
    told = capsys.readouterr().err
    assert "did you mean 'fill'" in told
    assert "Nothing was made" in told
    assert ".part" not in told
    assert copied == []
    assert list((raw / "trials").iterdir()) == []
    monkeypatch.undo()
    monkeypatch.chdir(raw)
    assert main([*words, "--set", "detection.fill=0.7"]) == 0
    assert "fill = 0.7" in (raw / "trials" / "T17" / "trial.toml").read_text(encoding="utf-8")


def test_no_camera_leaves_no_folder(tmp_path):
    plan = CapturePlan(left="no such camera", right="nor this", board="coded:5x5,pitch=60,size=44")
    place = tmp_path / "trials" / "T1" / "calibration"
    (tmp_path / "trials").mkdir()
    with pytest.raises(UsageError):
        record(place, plan)
    assert list((tmp_path / "trials").iterdir()) == []
    (tmp_path / "trials" / "T1").mkdir()  # a folder that was there stays
    with pytest.raises(UsageError):
        record(place, plan)
    assert list((tmp_path / "trials").iterdir()) == [tmp_path / "trials" / "T1"]


def test_a_sensor_without_a_marker_is_said_to_be_compared_with_nothing(raw):
    told = unsaid(NewTrial("left.avi", "right.avi", accelerometer="a.csv"))
    assert any("--accelerometer-marker" in words for words in told)
    bound = NewTrial("left.avi", "right.avi", accelerometer="a.csv", accelerometer_marker=3)
    assert not any("--accelerometer-marker" in words for words in unsaid(bound))
    assert not any("accelerometer" in w for w in unsaid(NewTrial("left.avi", "right.avi")))
