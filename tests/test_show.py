"""What `show` and `report` say first, what of their numbers is old, and how many digits stand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import report_scene
import tui_scene as scene

from olivevib.cli import main
from olivevib.cli.summary_text import concise, frequency, significant, summary_text
from olivevib.errors import InputError
from olivevib.reconstruction import Trajectory
from olivevib.trial import Trial
from olivevib.trial.quality import quality_of, stage_lines
from olivevib.trial.records.tracks import CameraRecord, StoredTracks
from olivevib.trial.stages import BY_NAME, write_failure
from olivevib.trial.standing import standing
from olivevib.trial.summary import seen_fractions, summary
from olivevib.trial.survey_summary import vibration_summary
from olivevib.vibration import LineStatus, largest


@pytest.fixture
def trial(tmp_path, monkeypatch) -> Trial:
    (tmp_path / "trials").mkdir()
    monkeypatch.chdir(tmp_path)
    return Trial.open(scene.measured_trial(tmp_path / "trials" / "T04"))


def blocks(text: str) -> list[str]:
    return text.split("\n\n")


def block(text: str, head: str) -> str:
    return next(b for b in blocks(text) if b.startswith(head))


def test_a_sound_trial_has_nothing_to_say_first(trial):
    assert standing(trial) == ()
    text = summary_text(summary(trial))
    assert "mind this first" not in text and "  ! " not in text


def test_numbers_from_before_a_change_say_so_first_and_where_they_stand(trial, capsys):
    changed = trial.changed({"markers.size_mm": 61.0})
    (told,) = standing(changed)
    assert told.code == "results-stale"
    assert told.text == (
        "The numbers of reconstruct, analyse and compare are from before the setting "
        "markers.size_mm changed."
    )
    assert main(["show", "T04"]) == 0
    text = capsys.readouterr().out
    assert blocks(text)[1].startswith("mind this first [results-stale]")
    mark = "  ! these numbers are from before the setting markers.size_mm changed"
    for head in ("timing", "markers", "accelerometer"):
        assert block(text, head).split("\n")[1] == mark
    assert "  ! " not in block(text, "calibration")


def test_a_report_of_old_numbers_says_so_on_the_terminal(trial, capsys):
    assert main(["report", "T04"]) == 0
    assert "warning" not in capsys.readouterr().err
    trial.changed({"markers.size_mm": 61.0})
    assert main(["report", "T04"]) == 3
    assert "warning [results-stale]: The numbers of reconstruct, analyse and compare" in (
        capsys.readouterr().err
    )
    page = (trial.folder / "report.html").read_text(encoding="utf-8")
    assert "reconstruct, analyse and compare are not up to date" in page
    mark = "<strong>These numbers are from before the setting markers.size_mm changed.</strong>"
    marked = [part[: part.index('"')] for part in page.split('<section id="')[1:] if mark in part]
    assert {"markers", "frequency", "comparison"} <= set(marked)
    assert not {"calibration", "seen"} & set(marked)


def test_why_a_stage_failed_and_what_to_do_is_kept(trial, capsys):
    (trial.folder / "trajectory.h5").unlink()
    fault = InputError("left is right.", "Its markers fit the rig exchanged.", "Exchange them.")
    write_failure(trial.folder, BY_NAME["reconstruct"], trial.fingerprint("reconstruct"), fault)
    assert main(["show", "T04"]) == 0
    first = blocks(capsys.readouterr().out)[1]
    assert "reconstruct failed: left is right. Its markers fit the rig exchanged." in first
    assert "\n    Exchange them." in first
    facts = summary(trial)
    assert facts["warnings"][0]["remedy"] == "Exchange them."
    assert facts["stages"]["analyse"]["old"].endswith("(reconstruct failed: left is right)")


def test_what_keeps_a_stage_from_running_is_told_once_with_its_remedy(trial):
    (trial.folder / "left.avi").rename(trial.folder / "moved.avi")
    (told,) = standing(trial)
    assert told.code == "stage-failed"
    assert told.text.startswith("track cannot run: ") and "left.avi is missing" in told.text
    assert told.remedy.startswith("Put the file back")
    assert "left.avi is missing" in summary(trial)["stages"]["analyse"]["old"]


def test_a_comparison_that_nobody_asks_for_any_more_says_so(trial):
    text = (trial.folder / "trial.toml").read_text(encoding="utf-8")
    kept = [line for line in text.split("\n") if not line.strip().startswith("marker = ")]
    (trial.folder / "trial.toml").write_text("\n".join(kept), encoding="utf-8")
    now = trial.reopen()
    assert [c.code for c in standing(now)] == ["results-left"]
    told = block(summary_text(summary(now)), "accelerometer")
    assert "no longer asked for" in told.split("\n")[1]
    assert quality_of(stage_lines(trial), trial).word == "clean"
    assert quality_of(stage_lines(now), now).why == "1: results-left"


def test_the_largest_amplitude_is_the_long_half_axis_of_the_orbit():
    """Against the largest excursion in any direction over one turn, and sigma against sampling."""
    rng = np.random.default_rng(4)
    line = replace(
        report_scene.line(LineStatus.DIRECT, 12.0),
        amplitude=np.array([4.0, 3.0, 1.0]), phase_rad=np.array([0.2, 1.5, -0.7]),
        amplitude_sigma=np.array([0.004, 0.003, 0.001]),
    )  # fmt: skip

    def reach(one) -> float:
        turn = np.linspace(0, 2 * np.pi, 20001)[:, None]
        return float(np.linalg.norm(one.amplitude * np.cos(turn + one.phase_rad), axis=1).max())

    size, sigma = largest(line)
    assert size == pytest.approx(reach(line), rel=1e-6)
    alike = [reach(replace(line, amplitude=line.amplitude * (1 + 1e-3 * e)))
             for e in rng.standard_normal(200)]  # fmt: skip
    assert np.std(alike) * 0.9 < sigma < np.std(alike) * 1.5


def test_the_marker_that_moves_most_is_that_of_the_largest_amplitude(trial):
    facts = summary(trial)
    sizes = {m["id"]: m["amplitude_largest_mm"] for m in facts["markers"]}
    best = max(sizes, key=lambda i: sizes[i])
    assert f"moves most (largest amplitude in any direction): marker {best}" in summary_text(facts)


@pytest.mark.parametrize(
    ("value", "sigma", "words"),
    [
        (4.9532, 0.00497, "4.9532(50)"), (15.83, 0.0104, "15.830(10)"), (9.7, 1.3, "9.7(1.3)"),
        (1238.0, 48.0, "1238(48)"), (2.5, None, "2.500"), (None, 0.1, "–"),
        (4.95, 0.0998, "4.950(100)"),
    ],
)  # fmt: skip
def test_a_sigma_stands_in_units_of_the_last_digit(value, sigma, words):
    assert concise(value, sigma, 3) == words


def test_small_numbers_are_never_rounded_to_zero():
    assert significant(0.0037, "%") == "0.0037 %"
    assert significant(0.31, "mm") == "0.31 mm"
    assert significant(12.3, "px") == "12 px"
    assert significant(None, "px") == "not known"


def test_a_frequency_has_no_more_digits_than_the_cameras_clock_allows():
    m = {
        "frequency_status": "direct", "frequency_hz": 12.0699963, "frequency_sigma_hz": 2.7e-6,
        "frequency_clock_sigma_hz": 6.03e-4,
    }  # fmt: skip
    assert frequency(m) == "12.07000 ± 0.00060 Hz, direct"
    assert frequency({**m, "frequency_clock_sigma_hz": None}).startswith("12.0699963 ± 0.0000027")


def fitted(path: Trajectory) -> Trajectory:
    """The path as of a fitted motion: eight instants a frame, the first of which nobody saw."""
    n = 8 * path.t_s.size
    rows = {
        name: np.repeat(getattr(path, name), 8, axis=0)
        for name in ("sample_t_s", "xyz_mm", "sigma_xyz_mm", "covariance_mm2", "rotation_rad",
                     "sigma_rotation_rad", "state", "epipolar_px")
    }  # fmt: skip
    return replace(path, t_s=np.arange(n) / 240.0, method="continuous", **rows)


def test_noise_of_a_fitted_motion_is_the_sigma_of_its_positions():
    """What a line leaves of a fitted curve is next to nothing, and no noise of a measurement."""
    content = report_scene.content([1, 2, 17], seconds=5.0)
    path, vibration = content.trajectory, content.vibration
    measured = vibration_summary(vibration, path)["figures"][0]
    assert measured["displacement_mm"]["noise"]["x"] == 0.05
    told = vibration_summary(vibration, fitted(path))["figures"][0]
    inside = (path.t_s >= told["start_s"]) & (path.t_s <= told["end_s"]) & path.seen[:, 0]
    expected = np.sqrt(np.mean(path.sigma_xyz_mm[inside, 0, 0] ** 2))
    assert told["displacement_mm"]["noise"]["x"] == pytest.approx(expected, rel=0.02)
    assert told["acceleration_m_s2"]["noise"] == {"x": None, "y": None, "z": None}


def test_seen_is_a_share_of_the_frames_of_both_cameras_where_a_motion_was_fitted():
    path = report_scene.trajectory([1, 2, 17], 4.0)
    both = report_scene.tracks(path)
    camera = CameraRecord(
        video="left.avi", codec="mjpeg", size_px=(1280, 720), frames=120, dropped=0, damaged=0,
        stamp_kind="container", method="line", rate_hz=30.0, rate_sigma_hz=4e-4, jitter_s=3e-4,
        worst_s=1e-3, row_time_s=0.0, row_time_sigma_s=0.0, row_time_source="global",
    )  # fmt: skip
    sides = ("left", "right")
    tracks = StoredTracks(
        both[:3], both[3:], dict.fromkeys(sides, camera), dict.fromkeys(sides, path.t_s), (),
        "edges", (),
    )  # fmt: skip
    shares = seen_fractions(fitted(path), tracks)
    left, right = (next(t for t in both if t.camera == side and t.id == 2) for side in sides)
    expected = np.mean((left.state <= 1) & (right.state <= 1))
    assert shares[2] == pytest.approx(expected)
    assert shares[2] != pytest.approx(float(path.seen[:, 1].mean()))  # lost in one camera alone
    assert seen_fractions(path, tracks)[2] == pytest.approx(float(path.seen[:, 1].mean()))


def test_the_json_still_holds_the_sigma_of_the_fit(trial, capsys):
    assert main(["show", "T04", "--json"]) == 0
    marker = json.loads(capsys.readouterr().out)["markers"][0]
    assert {"frequency_sigma_hz", "frequency_clock_sigma_hz", "amplitude_largest_mm"} <= set(marker)
