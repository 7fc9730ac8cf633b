"""The main job on recordings that nobody here made: two webcams and a hand-held board."""

from pathlib import Path

import numpy as np
import pytest

from olivevib.cli import main
from olivevib.trial import Trial
from olivevib.trial.summary import summary

BOARD = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000,inverted"
PAIRS = {(0, 2): 0.45, (0, 3): 0.80, (2, 3): 1.10}  # rms % of left-out corner distances at most
CODED = range(10)  # the markers of that board
pytestmark = [pytest.mark.shared, pytest.mark.slow]


def command(*words: str) -> int:
    """One command line; exit code 3 says done with quality warnings."""
    return main([*words, "-q"])


@pytest.fixture(scope="module", params=PAIRS, ids=lambda p: f"{p[0]}-{p[1]}")
def measured(request, shared_data, tmp_path_factory) -> tuple[Trial, float]:
    left, right = request.param
    videos = shared_data / "calibration" / "webcam4_charuco_A"
    one, two = (str(videos / f"cam_{k}.mp4") for k in (left, right))
    stamps = str(videos / "timestamps.csv")
    folder = tmp_path_factory.mktemp("real") / f"A{left}{right}"
    words = ["new", str(folder), "--left", one, "--right", two]
    words += ["--calibration-left", one, "--calibration-right", two, "--board", BOARD]
    words += ["--left-stamps", stamps, "--right-stamps", stamps]
    words += ["--markers", "aruco:DICT_4X4_1000", "--size", "40.5"]
    assert command(*words) == 0
    assert command("run", str(folder)) in (0, 3)
    return Trial.open(folder), PAIRS[request.param]


def test_all_stages_and_left_out_distances(measured):
    trial, limit = measured
    facts = summary(trial)
    states = {name: stage["state"] for name, stage in facts["stages"].items()}
    assert states.pop("compare") == "skipped"
    assert set(states.values()) == {"done"}
    assert facts["calibration"]["holdout_rms_percent"] <= limit
    record = trial.calibration.facts
    assert record["holdout_frames"] >= 18
    assert record["holdout_usable"] >= 0.9


def test_the_coded_markers_are_tracked_where_the_board_is(measured, shared_data):
    import cv2

    trial, _ = measured
    tracks = trial.tracks
    table = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
    detector = cv2.aruco.CharucoDetector(cv2.aruco.CharucoBoard((4, 5), 54.0, 40.5, table))
    from olivevib.files.video import Video

    for side in ("left", "right"):
        video = trial.path(getattr(trial.settings.cameras, side).video)
        with Video.open(video) as opened:
            boards = [detector.detectBoard(255 - f.grey)[1] for f in opened.frames()]
        shown = np.array([ids is not None and len(ids) >= 4 for ids in boards])
        seen = [np.isfinite(t.centre_px[:, 0]) for t in tracks.of(side) if t.id in CODED]
        enough = np.sum(seen, axis=0) >= 8
        assert enough[shown].mean() >= 0.93
        assert {t.id for t in tracks.of(side)} == set(CODED)  # weak codes: strays are told apart


def test_no_bare_frequency_and_a_report(measured, tmp_path):
    trial, _ = measured
    for marker in summary(trial)["markers"]:
        assert marker["frequency_hz"] is None
        assert marker["frequency_status"] in ("ambiguous", "aliased", "blind", "none", "chirp")
    assert command("report", str(trial.folder), "-o", str(tmp_path)) == 0
    page = (tmp_path / f"{trial.name}.html").read_text(encoding="utf-8")
    for words in ("Cameras, markers and paths", "Rig and calibration", "unused"):
        assert words in page
    assert command("export", str(trial.folder), "--to", "csv", "-o", str(tmp_path / "a.csv")) == 0
    assert len(Path(tmp_path / "a.csv").read_text().splitlines()) > 10 * 110


def test_distances_between_markers_are_rigid(measured):
    """The tracked markers sit on one board: their distances are constant in space."""
    trial, _ = measured
    xyz = trial.trajectory.xyz_mm
    pairs = [(a, b) for a in range(10) for b in range(a)]
    spread = []
    for a, b in pairs:
        d = np.linalg.norm(xyz[:, a] - xyz[:, b], axis=1)
        d = d[np.isfinite(d)]
        spread.append(1.4826 * np.median(np.abs(d - np.median(d))) / np.median(d))
    assert np.median(spread) < 0.01
