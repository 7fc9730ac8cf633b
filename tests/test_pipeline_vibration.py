"""Analysis and comparison from trial.toml: phases by hand, fixed markers, motions, sensors."""

import json
from pathlib import Path

import numpy as np
import pytest
import small_trial

from olivevib import pipeline
from olivevib.cli import main
from olivevib.errors import InputError, UsageError
from olivevib.files.accelerometer import read_preset
from olivevib.trial import Trial
from olivevib.trial.summary import summary


def write_sensor(
    path: Path, header: str = "Time (s),X (m/s2),Y (m/s2),Z (m/s2)", times: bool = True
) -> Path:
    """What a logger on marker 3 writes: its orbit, from 1 s before to 1 s after the film."""
    t = np.arange(-1.0, 3.0, 1e-3)
    turn = 2 * np.pi * small_trial.F_HZ * t + 3
    a = -1e-3 * (2 * np.pi * small_trial.F_HZ) ** 2
    xyz = a * np.stack([4 * np.cos(turn), 2 * np.sin(turn), 1.5 * np.cos(turn)], axis=1)
    rows = [
        f"{s + 1:.4f}," * times + f"{x:.5f},{y:.5f},{z + 9.81:.5f}"
        for s, (x, y, z) in zip(t, xyz, strict=True)
    ]
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def videos(tmp_path_factory) -> dict[str, Path]:
    return small_trial.record(tmp_path_factory.mktemp("videos"), frames=64)


@pytest.fixture(scope="module")
def done(videos, tmp_path_factory) -> Trial:
    folder = tmp_path_factory.mktemp("ws")
    sensor = write_sensor(folder / "a.csv")
    trial = small_trial.make(
        folder / "done", videos, accelerometer=str(sensor), accelerometer_marker=3
    )
    list(pipeline.run(trial))
    return trial.reopen()


def analysed(trial: Trial, changes: dict[str, object]) -> Trial:
    pipeline.analyse(trial.changed(changes))
    return trial.reopen()


def test_the_survey_is_told_and_survives_the_disk(done):
    told = json.loads(json.dumps(summary(done), allow_nan=False))
    found = told["vibration"]["survey"]
    assert [m["id"] for m in found["markers"]] == list(small_trial.IDS)
    orbit = found["markers"][0]["orbit"]
    assert orbit["major_mm"] == pytest.approx(np.hypot(4, 1.5), rel=0.02)
    assert orbit["minor_mm"] == pytest.approx(2.0, rel=0.05)
    assert found["markers"][0]["rotation"]["rms_mrad"]["z"] < 5
    pair = found["transmissibility"][0]
    assert (pair["marker"], pair["reference"]) == (11, 3)
    assert pair["ratio"] == pytest.approx(1.0, rel=0.02)
    assert pair["phase_deg"]["x"] == pytest.approx(np.degrees(11 - 3 - 2 * np.pi), abs=2)
    assert len(found["deflection"]["markers"]) == 2
    row = told["vibration"]["figures"][0]
    assert row["acceleration_m_s2"]["dose_m_s175"] > 0
    assert told["markers"][0]["displacement_pp_sigma_mm"] > 0
    assert told["markers"][0]["frequency_clock_sigma_hz"] == pytest.approx(
        50e-6 * small_trial.F_HZ, rel=0.01
    )


def test_phases_by_hand_stand_in_place_of_those_found(done):
    phases = [["rest", 0.0, 0.4], ["steady", 0.5, 1.9]]
    again = analysed(done, {"vibration.phases": phases})
    assert [(p.name, p.start_s, p.end_s) for p in again.vibration.phases] == [
        tuple(p) for p in phases
    ]
    assert again.vibration.spectra["displacement"].start_s == 0.5
    for wrong in (
        [["trembling", 0.0, 1.0]],
        [["steady", 1.0, 0.5]],
        [["rest", 0, 1], ["steady", 0.9, 2]],
    ):
        with pytest.raises(UsageError, match="phases"):
            done.changed({"vibration.phases": wrong})
    analysed(done, {"vibration.phases": None})


def test_motions_that_were_asked_for(done):
    asked = [
        {"name": "against", "marker": 11, "relative_to": 3},
        {"marker": 3, "at_mm": [0.0, 50.0, 0.0]},
    ]
    again = analysed(done, {"vibration.motion": asked})
    first, second = again.vibration.survey.motions
    x = abs(4 * np.exp(11j) - 4 * np.exp(3j))
    assert first.row.line.amplitude[0] == pytest.approx(x, rel=0.03)
    assert second.name == "marker 3 at 0, 50, 0 mm"
    assert second.row.line.amplitude[0] == pytest.approx(4.0, rel=0.05)
    with pytest.raises(UsageError, match="marker 40 was not tracked"):
        analysed(done, {"vibration.motion": [{"marker": 40}]})
    analysed(done, {"vibration.motion": None})


def test_a_fixed_marker_gives_the_cameras_own_motion(done):
    """Marker 3 is called fixed though it moves: all of its motion leaves marker 11."""
    again = analysed(done, {"markers.marker": [{"id": 3, "place": "fixed"}]})
    assert "cameras-moved" in {c.code for c in again.vibration.cautions}
    assert again.vibration.row(3).displacement.resultant_rms < 1e-6
    x = abs(4 * np.exp(11j) - 4 * np.exp(3j))
    assert again.vibration.row(11).line.amplitude[0] == pytest.approx(x, rel=0.03)
    unseen = analysed(done, {"markers.marker": [{"id": 40, "place": "fixed"}]})
    assert "fixed-markers-unseen" in {c.code for c in unseen.vibration.cautions}
    analysed(done, {"markers.marker": None})


def test_two_sensors_each_with_axes_lever_and_preset(done, tmp_path):
    """The second is turned, has no unit, sits beside the centre and is read by a preset."""
    plain = write_sensor(tmp_path / "b.csv", "t,x,y,z")
    kept = tmp_path / "kept.toml"
    kept.write_text('unit = "m/s2"\ntime_unit = "s"\n', encoding="utf-8")
    sensors = [
        {"file": str(done.path(done.settings.accelerometers[0].file)), "marker": 3},
        {
            "file": str(plain), "marker": 3, "axes": ["y", "-x", "z"],
            "lever_mm": [10.0, 0.0, 0.0], "preset": str(kept),
        },
    ]  # fmt: skip
    pipeline.compare(done.changed({"accelerometers": sensors}))
    first, second = done.reopen().comparison
    assert [c.verdict for c in (first, second)] == ["undecided", "undecided"]
    assert first.reason.startswith("Amplitudes only: camera and accelerometer agree")
    assert first.ambiguous  # a steady motion: the lag repeats, half a period is half a turn
    assert np.isfinite([first.rival_offset_s, first.rival_turn_deg]).all()
    assert abs(first.gain - 1) < 0.01
    turned = first.R_camera_sensor.T @ second.R_camera_sensor
    assert not np.allclose(turned, np.eye(3), atol=0.5)
    told = summary(done.reopen())["comparisons"]
    assert len(told) == 2
    assert 0 < told[0]["limits_mm"]["x"] < 0.5
    assert told[0]["limits_sigma_mm"]["x"] < told[0]["limits_mm"]["x"]
    done.changed({"accelerometers": sensors[:1]})


def test_new_takes_several_sensors_and_show_tells_them_all(videos, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    one, two = (write_sensor(tmp_path / f"{k}.csv", "time (s),x (m/s2),y (m/s2),z (m/s2)")
                for k in "ab")  # fmt: skip
    small_trial.make(tmp_path / "like", videos)
    recordings = ("--left", videos["left"], "--right", videos["right"],
                  "--rig", tmp_path / "like_rig.toml")  # fmt: skip
    markers = ("--markers", "aruco:DICT_4X4_50", "--size", "70", "--ids", "3,11")
    sensors = ("--accelerometer", one, "--accelerometer", two, "--accelerometer-marker", "11",
               "--accelerometer-marker", "3", "--accelerometer-axes", "-",
               "--accelerometer-axes=x,-z,y", "--accelerometer-lever", "-",
               "--accelerometer-lever=0,25,-8")  # fmt: skip
    verb = [str(word) for word in ("new", "several", *recordings, *markers, *sensors)]
    assert main(verb) == 0
    first, second = Trial.open(tmp_path / "several").settings.accelerometers
    assert (first.file, first.marker, first.axes) == ("accelerometer.csv", 11, ())
    assert (second.file, second.marker) == ("accelerometer_2.csv", 3)
    assert second.axes == ("x", "-z", "y")
    assert second.lever_mm == (0.0, 25.0, -8.0)
    assert main(["run", "-q", "several"]) in (0, 3)
    capsys.readouterr()
    assert main(["show", "several"]) in (0, 3)
    told = capsys.readouterr().out
    assert "accelerometer accelerometer.csv at marker 11" in told
    assert "accelerometer accelerometer_2.csv at marker 3" in told
    assert main([*verb[:1], "more", *verb[2:], "--accelerometer-marker", "3"]) == 2
    assert "3 times for 2 sensors" in capsys.readouterr().err


def test_an_error_of_a_sensor_says_where_its_option_goes(videos, tmp_path):
    bare = write_sensor(tmp_path / "bare.csv", "ax (m/s2),ay (m/s2),az (m/s2)", times=False)
    trial = small_trial.make(
        tmp_path / "bare", videos, accelerometer=str(bare), accelerometer_marker=3
    )
    from olivevib.pipeline.compare import sensor_record

    with pytest.raises(InputError, match="rate_hz = 1000") as told:
        sensor_record(trial, trial.settings.accelerometers[0])
    assert "[[accelerometers]]" in told.value.remedy
    assert str(trial.folder / "trial.toml") in told.value.remedy


def test_a_preset_is_kept_and_used_by_new(done, videos, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    first = {"file": str(write_sensor(tmp_path / "c.csv", "t,x,y,z")), "marker": 3, "unit": "m/s2"}
    trial = small_trial.make(tmp_path / "one", videos).changed({"accelerometers": [first]})
    assert main(["preset", "one", "mylogger"]) == 0
    assert Path(capsys.readouterr().out.strip()) == Path("presets/mylogger.toml")
    again = small_trial.make(
        tmp_path / "two", videos, accelerometer=first["file"], accelerometer_marker=3,
        preset="presets/mylogger.toml",
    )  # fmt: skip
    assert again.settings.accelerometers[0].preset == "accelerometer.preset.toml"
    from olivevib.pipeline.compare import sensor_options

    assert sensor_options(again, again.settings.accelerometers[0]).unit == "m/s2"
    with pytest.raises(UsageError, match="no accelerometer number 2"):
        pipeline.keep_preset(trial, "x", 2, tmp_path)
    (tmp_path / "presets" / "mylogger.toml").write_text("unit = 3\n")
    with pytest.raises(InputError, match="unit = 3 is not possible"):
        read_preset(tmp_path / "presets" / "mylogger.toml")


def test_new_refuses_a_gyroscope_by_the_name_of_its_columns(videos, tmp_path):
    path = tmp_path / "gyro.csv"
    path.write_text("Time (s),Gyroscope x (rad/s)\n0.00,0.1\n0.01,0.2\n0.02,0.1\n")
    with pytest.raises(InputError, match="Gyroscope x") as refused:
        small_trial.make(tmp_path / "gyro", videos, accelerometer=str(path))
    assert "no acceleration" in refused.value.what
    assert not (tmp_path / "gyro").exists()
    small_trial.make(
        tmp_path / "later", videos, accelerometer=str(write_sensor(tmp_path / "d.csv", "t,x,y,z"))
    )  # what an option can mend waits for compare
