"""From a trial folder on disk to its page and to the season page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import report_scene as scene
from test_report_page import Reader

from olivevib.errors import Caution, InputError
from olivevib.files.rig_file import write_rig
from olivevib.files.store import write_stage
from olivevib.reconstruction import Reconstruction, TrialClock
from olivevib.report import content_of, write_season_report, write_trial_report
from olivevib.trial import Trial
from olivevib.trial.records.calibration import calibration_file
from olivevib.trial.records.comparison import comparison_file
from olivevib.trial.records.tracks import CameraRecord, StoredTracks, tracks_file
from olivevib.trial.records.trajectory import trajectory_file
from olivevib.trial.records.vibration import vibration_file
from olivevib.trial.stages import Fingerprint

TOML = """
[session]
date = 2026-11-20
place = "Bari <plot 7>"
simulated = true

[tree]
cultivar = "Coratina"
trunk_diameter_mm = 182.0

[markers]
library = "aruco:DICT_4X4_50"
size_mm = 60.0
[[markers.marker]]
id = 1
place = "trunk"
[[markers.marker]]
id = 4
place = "branch"
branch_diameter_mm = 31.0

[cameras.left]
video = "left.mkv"
[cameras.right]
video = "right.mkv"

[outcome]
removed_kg = 31.4
"""


def make_trial(folder: Path) -> Trial:
    """A folder with every stage file of the made-up trial."""
    folder.mkdir(parents=True)
    (folder / "trial.toml").write_text(TOML, encoding="utf-8")
    content = scene.content([1, 4, 17], seconds=5.0)
    now = Fingerprint({"left video": "ab" * 32}, {"fill": 0.7})
    caution = Caution("lag-unknown", "The lag is not known.", "Record the board waved.")
    path = content.trajectory
    clock = TrialClock(0.00912, 5e-5, 360.0, "calibration", 27.8e-6, 0.0)
    cameras = {
        side: CameraRecord(
            video=f"{side}.mkv", codec="mjpeg", size_px=(1280, 720), frames=300, dropped=1,
            damaged=0, stamp_kind="container", method="line", rate_hz=30.0, rate_sigma_hz=4e-4,
            jitter_s=3e-4, worst_s=1e-3, row_time_s=27.8e-6, row_time_sigma_s=4e-7,
            row_time_source="declared",
        )
        for side in ("left", "right")
    }  # fmt: skip
    tracks = StoredTracks(
        content.tracks[:3], content.tracks[3:], cameras,
        dict.fromkeys(cameras, path.t_s), (), "edges", (caution,),
    )  # fmt: skip
    write_rig(folder / "rig.toml", content.rig, {})
    write_stage(folder / "calibration.h5", calibration_file(content.calibration, now))
    write_stage(folder / "tracks.h5", tracks_file(tracks, now))
    result = Reconstruction(path, clock, 1.1, 0.4, ())
    write_stage(folder / "trajectory.h5", trajectory_file(result, now))
    write_stage(folder / "vibration.h5", vibration_file(content.vibration, now))
    write_stage(folder / "comparison.h5", comparison_file(content.comparisons, (), now))
    return Trial.open(folder)


@pytest.fixture(scope="module")
def trial(tmp_path_factory) -> Trial:
    return make_trial(tmp_path_factory.mktemp("season") / "T04")


def test_content_carries_everything_that_the_trial_knows(trial):
    content = content_of(trial)
    assert content.places == {1: "trunk", 4: "branch, 31 mm thick"}
    assert content.simulated
    assert len(content.tracks) == 6
    assert content.comparisons[0].sensor == "accelerometer.csv"
    assert [c.code for c in content.cautions] == [  # its recordings are not there
        "stage-failed", "results-left", "results-left", "lag-unknown",
    ]  # fmt: skip
    assert content.provenance["command"] == "olivevib report T04"
    assert content.provenance["tracks.h5 from left video, SHA-256"] == "ab" * 32
    assert np.isfinite(content.lines()[1].f_hz)


def test_the_page_is_written_whole_and_twice_the_same(trial, tmp_path):
    first, second = tmp_path / "a.html", tmp_path / "b.html"
    notes = []
    write_trial_report(trial, first, lambda done, total, note: notes.append(note))
    write_trial_report(Trial.open(trial.folder), second)
    assert first.read_bytes() == second.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.html", "b.html"]
    reader = Reader(first.read_text(encoding="utf-8"))
    assert reader.open == []
    text = reader.visible.replace("\u00a0", " ")
    expected = (
        "T04", "This trial is simulated", "Bari <plot 7>", "2026-11-20", "31.4 kg",
        "branch, 31 mm thick", "9.120 ± 0.050 ms (source: calibration)",
        "Record the board waved.", "charuco:4x5", "mjpeg", "view 12: blurred",
        "left.mkv is missing.",
    )  # fmt: skip
    for words in expected:
        assert words in text, words
    assert not re.search(r"\b(nan|None|null)\b", text)
    assert notes
    assert str(trial.folder) not in text


def test_a_new_trial_has_a_page_too(tmp_path):
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "trial.toml").write_text("", encoding="utf-8")
    page = tmp_path / "new.html"
    write_trial_report(Trial.open(tmp_path / "new"), page)
    text = Reader(page.read_text(encoding="utf-8")).visible
    assert "No marker has been located in space yet." in text
    assert not re.search(r"\b(nan|None|null)\b", text)


def test_season_links_only_to_pages_below_it(trial, tmp_path):
    season = tmp_path / "season.html"
    write_season_report([(trial, tmp_path / "T 04.html"), (trial, None)], season)
    text = season.read_text(encoding="utf-8")
    assert 'href="T%2004.html"' in text
    assert text.count("<a href") == 1
    assert "2 of 2 trials were computed" in Reader(text).visible.replace("\u00a0", " ")


def test_a_missing_folder_is_told(tmp_path):
    (tmp_path / "trial.toml").write_text("", encoding="utf-8")
    trial = Trial.open(tmp_path)
    with pytest.raises(InputError, match="could not be written"):
        write_trial_report(trial, tmp_path / "nowhere" / "a.html")
