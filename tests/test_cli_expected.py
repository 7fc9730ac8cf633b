"""What the command line expects is said where something else was typed, and where nothing is."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from small_videos import recordings

from olivevib import pipeline
from olivevib.cli import main
from olivevib.errors import Caution
from olivevib.pipeline import NewTrial, new_trial
from olivevib.pipeline.check import _without


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        (["shwo", "T1"], "Did you mean show?"),
        (["clibrate", "T1"], "Did you mean calibrate?"),
        (["export", "T1", "--to", "c3"], "Did you mean c3d?"),
        (["markers", "shet"], "Did you mean sheet?"),
    ],
)
def test_a_word_that_is_nearly_right_gets_its_like(typed, meant, capsys):
    with pytest.raises(SystemExit) as left:
        main(typed)
    assert left.value.code == 2
    assert meant in capsys.readouterr().err


def test_a_word_that_is_like_nothing_gets_the_list(capsys):
    with pytest.raises(SystemExit):
        main(["zzzzz"])
    told = capsys.readouterr().err
    assert "Did you mean" not in told
    assert "There are: init, capture" in told


def test_a_number_that_is_none_gets_kind_unit_and_an_example(capsys):
    with pytest.raises(SystemExit):
        main(["plan", "--distance", "1,4"])
    told = capsys.readouterr().err
    assert "'1,4' was given; MM is a number with a point, such as 1400" in told
    assert "invalid float" not in told
    with pytest.raises(SystemExit):
        main(["plan", "--rows", "7.5"])
    assert "N is a whole number, such as 720" in capsys.readouterr().err


def test_help_says_what_olivevib_alone_does(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "olivevib alone opens the app" in capsys.readouterr().out


def test_show_where_no_trial_is_says_so_and_what_to_do(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["show"]) == 0
    told = capsys.readouterr()
    assert told.out == ""
    assert "No trial is here" in told.err
    assert "olivevib new" in told.err
    assert main(["show", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


@pytest.fixture
def trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(recordings(tmp_path))
    new_trial(Path("trials/T1"), NewTrial("left.avi", "right.avi"))
    return tmp_path / "trials" / "T1"


def test_show_counts_archived_trials_it_does_not_list(trial, capsys):
    assert main(["archive", "T1"]) == 0
    assert main(["show"]) == 0
    told = capsys.readouterr()
    assert told.out == ""
    assert "1 archived trial not shown" in told.err
    assert "No trial is here" not in told.err


def test_a_file_that_is_there_is_faulty_and_one_that_is_gone_is_lost(trial, capsys):
    (trial / "left.avi").write_bytes(b"no video")
    (trial / "right.avi").unlink()
    states = {f.what: f.state for f in pipeline.check(trial)}
    assert (states["left.avi"], states["right.avi"]) == ("faulty", "lost")
    text = (trial / "trial.toml").read_text(encoding="utf-8")
    (trial / "trial.toml").write_text(text.replace("[session]", "[session]\nfoo = 3"))
    assert main(["check", "T1"]) == 1
    told = capsys.readouterr().out
    assert told.startswith("faulty   trial.toml")
    assert "lost" not in told.splitlines()[0]
    assert "session.foo: there is no such key" in told
    assert all(line[:6] in ("faulty", " " * 6) for line in told.splitlines())


def test_check_names_a_file_once_a_line(trial, monkeypatch):
    path = (trial / "left.avi").resolve()
    assert _without(path, f"{path} ends early: 61 frames are there.") == (
        "ends early: 61 frames are there"
    )

    class Cut:
        cautions = (
            Caution("video-truncated", f"{path} ends early: 3 frames are there.", ""),
            Caution("video-damaged", f"{path}: 1 frame left out: damaged.", ""),
        )

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

        def frames(self):
            return iter(range(3))

    monkeypatch.setattr(sys.modules["olivevib.pipeline.check"], "open_source", lambda *_: Cut())
    (finding,) = (f for f in pipeline.check(trial) if f.what == "left.avi")
    assert finding.state == "damaged"
    assert finding.words == "ends early: 3 frames are there; 1 frame left out: damaged"
