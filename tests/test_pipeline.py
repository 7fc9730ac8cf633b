"""The main job end to end on a small trial; resumption bit for bit; bad input with its remedy."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import small_trial
from small_videos import cut

from olivevib import pipeline
from olivevib.cli import main
from olivevib.errors import InputError, UsageError
from olivevib.files.store import read_stage
from olivevib.progress import Cancelled
from olivevib.trial import Trial
from olivevib.trial.summary import summary


@pytest.fixture(scope="module")
def videos(tmp_path_factory) -> dict[str, Path]:
    return small_trial.record(tmp_path_factory.mktemp("videos"))


@pytest.fixture(scope="module")
def done(videos, tmp_path_factory) -> Trial:
    trial = small_trial.make(tmp_path_factory.mktemp("ws") / "done", videos)
    outcomes = list(pipeline.run(trial))
    assert [o.stage for o in outcomes] == [
        "calibrate",
        "track",
        "reconstruct",
        "analyse",
        "compare",
    ]
    return trial.reopen()


def test_positions_and_lines_are_the_truth(done):
    trajectory = done.trajectory
    assert trajectory.ids.tolist() == list(small_trial.IDS)
    assert trajectory.seen.mean() > 0.97
    for m, marker in enumerate(trajectory.ids.tolist()):
        times = trajectory.sample_t_s[:, m]
        truth = np.array([small_trial.position_mm(marker, t) for t in times])
        error = (trajectory.xyz_mm[:, m] - truth)[trajectory.seen[:, m]]
        assert np.sqrt(np.mean(error[:, :2] ** 2)) < 0.06
        assert np.sqrt(np.mean(error[:, 2] ** 2)) < 0.3
        line = done.vibration.row(marker).line
        assert line.status == "direct"
        assert line.f_hz == pytest.approx(small_trial.F_HZ, abs=5 * line.f_sigma_hz + 1e-3)
        assert line.amplitude[0] == pytest.approx(4.0, rel=0.02)


def test_a_second_run_has_nothing_to_do(done):
    assert {o.words.split(":")[0] for o in pipeline.run(done)} == {"done", "skipped"}


def test_the_summary_has_the_house_keys_and_is_json(done):
    facts = summary(done)
    text = json.dumps(facts, allow_nan=False)
    assert json.loads(text) == facts
    marker = facts["markers"][0]
    assert {
        *("id", "seen_fraction", "frequency_hz", "frequency_sigma_hz", "frequency_status"),
        *("frequency_candidates_hz", "amplitude_mm", "amplitude_sigma_mm"),
        *("acceleration_rms_m_s2", "displacement_pp_mm"),
    } <= set(marker)
    assert facts["timing"]["right_offset_s"] is None
    assert facts["calibration"]["holdout_rms_mm"] is None
    assert facts["stages"]["compare"]["state"] == "skipped"


def test_stage_files_open_without_our_code(done):
    xarray = pytest.importorskip("xarray")
    data = xarray.open_dataset(done.folder / "trajectory.h5", engine="h5netcdf")
    assert data["xyz"].dims == ("time", "marker", "axis")
    assert data["xyz"].attrs["units"] == "mm"
    assert float(data["xyz"].sel(marker=3)[0, 2]) == pytest.approx(1000, abs=3)
    left = xarray.open_dataset(done.folder / "tracks.h5", engine="h5netcdf", group="left")
    assert left["centre"].dims == ("frame", "marker", "xy")


def stored(trial: Trial) -> bytes:
    return (trial.folder / "tracks.h5").read_bytes()


def test_a_cancelled_track_resumes_bit_for_bit(done, videos, tmp_path):
    trial = small_trial.make(tmp_path / "again", videos)
    pipeline.calibrate(trial)
    calls = 0

    def impatient(finished, total, note):
        nonlocal calls
        calls += 1
        if calls % 23 == 0:
            raise Cancelled

    for _ in range(20):
        try:
            pipeline.track(trial, impatient)
            break
        except Cancelled:
            assert not (trial.folder / "tracks.h5").exists()
    assert calls > 46
    assert same_tracks(trial, done)


def same_tracks(one: Trial, two: Trial) -> bool:
    """Equal in every bit of every variable (the headers name other video files' hashes alike)."""
    a, b = (read_stage(t.folder / "tracks.h5", "track") for t in (one, two))
    assert a.variables.keys() == b.variables.keys()
    return all(
        a.variables[k].values.tobytes() == b.variables[k].values.tobytes() for k in a.variables
    )


KILLED = """
import sys
from olivevib import pipeline
from olivevib.trial import Trial
print("ready", flush=True)
def tick(done, total, note):
    print(done, flush=True)
pipeline.track(Trial.open(sys.argv[1]), tick)
"""


@pytest.mark.parametrize("after", [10, 40])
def test_kill_9_loses_nothing_acknowledged(done, videos, tmp_path, after):
    trial = small_trial.make(tmp_path / "killed", videos)
    child = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(trial.folder)], stdout=subprocess.PIPE, text=True
    )
    for line in child.stdout:
        if line.strip() == str(after):
            os.kill(child.pid, signal.SIGKILL)
            break
    child.wait()
    child.stdout.close()
    assert child.returncode == -signal.SIGKILL
    resumed = []
    pipeline.track(trial, lambda finished, total, note: resumed.append(finished))
    assert resumed[0] >= after - 2 * 16  # at most one batch a camera is repeated
    assert same_tracks(trial, done)
    assert not (trial.private / "track.journal").exists()


def test_a_missing_video_names_it_and_blocks(done, videos, tmp_path):
    trial = small_trial.make(tmp_path / "lost", videos)
    (trial.folder / "left.nut").unlink()
    assert trial.states()["track"].state == "blocked"
    with pytest.raises(InputError, match=r"left\.nut is missing"):
        pipeline.run_stage(trial, "track")


def test_new_refuses_what_cannot_work_before_it_writes(videos, tmp_path):
    cases = [
        ({"left": str(tmp_path / "no.nut")}, InputError, "missing"),
        ({"markers": "olive50"}, UsageError, "olive49"),
        ({"ids": (3, 77)}, UsageError, "no marker 77"),
        ({"size_mm": -1.0}, UsageError, "millimetres"),
        ({"board": "charuco:4x5"}, UsageError, "square"),
        ({"calibration_left": str(videos["left"])}, UsageError, "only one side"),
    ]
    for change, kind, words in cases:
        with pytest.raises(kind, match=words):
            small_trial.make(tmp_path / "never", videos, **change)
        assert not (tmp_path / "never").exists()
        assert not list(tmp_path.glob(".never*"))


def test_an_empty_and_a_truncated_video(videos, tmp_path):
    empty = tmp_path / "empty.nut"
    empty.write_bytes(b"")
    with pytest.raises(InputError, match="empty"):
        small_trial.make(tmp_path / "e", videos, left=str(empty))
    short = cut(videos["right"], 0.5)
    trial = small_trial.make(tmp_path / "t", videos, right=str(short))
    list(pipeline.run(trial))
    codes = {c.code for c in trial.reopen().cautions}
    assert {"video-truncated", "frame-counts-differ"} <= codes
    seen = trial.reopen().trajectory.seen[:, 0]
    assert 5 < seen.sum() < 30  # what both cameras saw is measured, the rest is NaN


def test_sizes_that_differ_are_told(videos, tmp_path):
    from small_videos import make_video

    other = make_video(tmp_path / "other.mkv", frames=5, size=(300, 400))
    with pytest.raises(InputError, match=r"400 x 300 px, the right one 300 x 400") as caught:
        small_trial.make(tmp_path / "s", videos, right=str(other))
    assert "turned by 90 degrees" in str(caught.value)


def test_a_rig_of_another_size_is_refused(done, videos, tmp_path):
    trial = small_trial.make(tmp_path / "r", videos)
    pipeline.calibrate(trial)
    pipeline.track(trial)
    rig = trial.folder / "rig.toml"
    rig.write_text(rig.read_text().replace("[400, 300]", "[800, 600]"))
    with pytest.raises(InputError, match="calibrated at 800 x 600"):
        pipeline.run_stage(trial.reopen(), "reconstruct")
    assert trial.reopen().states()["reconstruct"].state == "failed"


def test_changed_settings_make_only_what_rests_on_them_stale(done, videos, tmp_path):
    trial = small_trial.make(tmp_path / "c", videos)
    list(pipeline.run(trial))
    trial = trial.changed({"vibration.band_hz": [2.0, 40.0]})
    states = {name: s.state.value for name, s in trial.states().items()}
    assert states["track"] == states["reconstruct"] == "done"
    assert states["analyse"] == "stale"
    list(pipeline.run(trial))
    line = trial.reopen().vibration.row(3).line
    assert line.status in ("ambiguous", "aliased")
    assert len(line.candidates_hz) >= 2
    assert summary(trial.reopen())["markers"][0]["frequency_hz"] is None


def test_exports_and_check(done, tmp_path):
    table = tmp_path / "out.csv"
    pipeline.export(done, "csv", table)
    head = table.read_text().splitlines()[0]
    assert head == "time_s,marker,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_mm,sigma_z_mm,state"
    pipeline.export(done, "h5", tmp_path / "out.h5", (3,))
    with h5py.File(tmp_path / "out.h5") as h5:
        assert h5.attrs
    states = {f.what: f.state for f in pipeline.check(done.folder)}
    assert states["left.nut"] == states["tracks.h5"] == "whole"


def test_an_export_of_what_is_stale_warns_and_of_what_is_damaged_fails(videos, tmp_path, capsys):
    trial = small_trial.make(tmp_path / "stale", videos)
    list(pipeline.run(trial))
    verb = ["export", str(trial.folder), "--to", "csv", "-o", str(tmp_path / "out.csv")]
    assert main(verb) == 0
    trial.changed({"detection.fill": 0.75})
    assert main(verb) == 3
    assert "export-stale" in capsys.readouterr().err
    assert (tmp_path / "out.csv").exists()
    tracks = trial.folder / "tracks.h5"
    tracks.write_bytes(tracks.read_bytes()[:-2000])
    assert main(verb) == 1
    assert "tracks.h5" in capsys.readouterr().err


def test_check_tells_damage_and_what_can_be_remade(videos, tmp_path):
    trial = small_trial.make(tmp_path / "d", videos)
    list(pipeline.run(trial))
    data = bytearray((trial.folder / "tracks.h5").read_bytes())
    data[len(data) // 2] ^= 0xFF
    (trial.folder / "tracks.h5").write_bytes(data)
    (trial.folder / "right.nut").unlink()
    states = {f.what: f.state for f in pipeline.check(trial.folder)}
    assert states["tracks.h5"] == "remake"
    assert states["right.nut"] == "lost"


def test_a_trial_toml_that_was_cut_off_is_told(videos, tmp_path):
    trial = small_trial.make(tmp_path / "cut", videos)
    text = (trial.folder / "trial.toml").read_text()
    (trial.folder / "trial.toml").write_text(text[: text.index("[cameras")])
    (finding,) = (f for f in pipeline.check(trial.folder) if f.what == "trial.toml")
    assert finding.state == "damaged" and "no left and no right video" in finding.words
    state = Trial.open(trial.folder).states()["track"]
    assert state.state == "blocked" and "names no left video" in state.reason


def test_a_mirrored_video_is_told(tmp_path):
    from olivevib.simulation.recording import MjpegWriter, jpeg

    videos = {side: tmp_path / f"{side}.nut" for side in ("left", "right")}
    for side, path in videos.items():
        with MjpegWriter(path, small_trial.SIZE, small_trial.FPS) as writer:
            for n in range(4):
                grey = small_trial.picture(side, n / small_trial.FPS, n)
                grey = np.ascontiguousarray(grey[:, ::-1]) if side == "right" else grey
                writer.write(jpeg(grey, 95), round(n / small_trial.FPS * 1e6))
    trial = small_trial.make(tmp_path / "m", videos, ids=small_trial.IDS)
    told = {c.code: c.text for c in pipeline.track(trial)}
    assert "right video is mirrored" in told["mirrored-video"]
