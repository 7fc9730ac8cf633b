"""What the command line says: one of a thing, a name that means two trials, standing warnings."""

from __future__ import annotations

import shutil

import pytest
import tui_scene as scene

from olivevib.cli import main
from olivevib.trial import Trial
from olivevib.values import counted
from olivevib.vibration import LineStatus


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("words") / "olive"
    for name in ("trials", "reports", "markers"):
        (folder / name).mkdir(parents=True)
    scene.measured_trial(folder / "trials" / "T04")
    scene.measured_trial(folder / "trials" / "T05", LineStatus.AMBIGUOUS, sensor=False)
    return folder


@pytest.fixture
def workspace(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path / "olive")
    monkeypatch.chdir(tmp_path / "olive")
    return tmp_path / "olive"


def test_things_are_counted():
    assert [counted(n, "frame") for n in (0, 1, 2)] == ["no frames", "1 frame", "2 frames"]


def test_a_second_run_without_work_still_tells_the_warnings(workspace, capsys):
    assert main(["run", "T05"]) == 3
    assert "1 warning of earlier runs: olivevib show T05" in capsys.readouterr().err
    assert main(["run", "T04"]) == 0


def test_a_name_that_means_two_trials_is_told(workspace, capsys):
    assert main(["show", "T04"]) == 0
    assert "taken is" not in capsys.readouterr().err
    shutil.copytree(workspace / "trials" / "T05", workspace / "T04")
    assert main(["show", "T04", "--json"]) == 0
    told = capsys.readouterr()
    assert "T04: taken is ./T04; the trial trials/T04 is another one" in told.err
    assert "frequency-undecided" in told.out  # it is the one that was named
    shutil.rmtree(workspace / "T04")
    assert main(["show", "trials/T04"]) == 0
    assert "taken is" not in capsys.readouterr().err


def test_the_browser_says_how_it_is_installed(monkeypatch, capsys):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["serve"]) == 2
    assert "pip install textual-serve" in capsys.readouterr().err


def test_compare_says_what_came_out(workspace, monkeypatch, capsys):
    monkeypatch.setattr("olivevib.pipeline.run_stage", lambda *_: ())
    assert main(["compare", "T04"]) == 0
    told = capsys.readouterr().err
    (found,) = Trial.open(workspace / "trials" / "T04").comparison
    assert f"  {found.sensor} at marker {found.marker}: {found.verdict}" in told
    assert found.reason in told
    assert f"gain (camera over sensor) {found.gain:.2f}" in told
    assert main(["compare", "T05"]) == 0
    assert "nothing was compared: no accelerometer" in capsys.readouterr().err
