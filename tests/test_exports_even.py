"""Formats that state one rate for all rows hold what has that rate: no reader gets a false one."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from exports_scene import make_trajectory

from olivevib.errors import InputError, UsageError
from olivevib.files.exports import EVEN, even_part, export
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import State

F_HZ, FRAMES_HZ, FINER = 12.07, 30.0, 8


def shaken(t_s: np.ndarray, method: str) -> Trajectory:
    """Two markers that move along x with F_HZ; rows at t_s."""
    n = t_s.size
    xyz = np.tile([[-100.0, 0, 1400], [90.0, 20, 1500]], (n, 1, 1))
    xyz[:, :, 0] += 3 * np.sin(2 * np.pi * F_HZ * t_s)[:, None]
    blank = np.zeros((n, 2))
    return Trajectory(
        t_s=t_s,
        ids=np.array([4, 2]),
        sample_t_s=np.repeat(t_s[:, None], 2, axis=1),
        xyz_mm=xyz,
        sigma_xyz_mm=np.full((n, 2, 3), 0.01),
        covariance_mm2=np.zeros((n, 2, 3, 3)),
        rotation_rad=np.zeros((n, 2, 3)),
        sigma_rotation_rad=np.zeros((n, 2, 3)),
        state=blank.astype(np.int64),
        epipolar_px=blank,
        frame="left camera",
        method=method,
        sigma_rig_mm=np.zeros((n, 2, 3)),
    )


def fitted() -> Trajectory:
    """Frames, then the grid of a fit that begins and ends between two frames, then frames."""
    frames = np.arange(300) / FRAMES_HZ
    grid = 2.2513 + np.arange(1300) / (FRAMES_HZ * FINER)
    outside = frames[(frames < grid[0]) | (frames > grid[-1])]
    assert outside.size > 100
    return shaken(np.sort(np.concatenate([outside, grid])), "continuous")


def peak_hz(x: np.ndarray, rate_hz: float) -> float:
    """Where a reader that trusts the stated rate sees the line."""
    size = 1 << 16
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size), size))
    return float(np.fft.rfftfreq(size, 1 / rate_hz)[power.argmax()])


def read_c3d(path: Path) -> tuple[float, dict[str, np.ndarray], Any]:
    ezc3d = pytest.importorskip("ezc3d")
    document = ezc3d.c3d(str(path))
    point = document["parameters"]["POINT"]
    data = document["data"]["points"]
    columns = {label: data[:3, k].T for k, label in enumerate(point["LABELS"]["value"])}
    return float(point["RATE"]["value"][0]), columns, document


def read_trc(path: Path) -> tuple[float, dict[str, np.ndarray], Any]:
    lines = path.read_text().splitlines()
    values = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    table = pd.read_csv(io.StringIO("\n".join(lines)), sep="\t", skiprows=5, header=None)
    assert int(values["NumFrames"]) == len(table)
    labels = lines[3].split("\t")[2::3]
    columns = {m: table[[2 + 3 * k + i for i in range(3)]] for k, m in enumerate(labels)}
    return float(values["DataRate"]), {m: c.to_numpy() for m, c in columns.items()}, table


READERS = {"c3d": read_c3d, "trc": read_trc}


@pytest.mark.filterwarnings("ignore:No analog data found")
@pytest.mark.parametrize("to", EVEN)
def test_the_stated_rate_of_a_fitted_path_gives_the_true_frequency(tmp_path: Path, to: str) -> None:
    pytest.importorskip("ezc3d")
    path = tmp_path / f"a.{to}"
    export(fitted(), to, path)
    rate, columns, more = READERS[to](path)
    assert rate == pytest.approx(FRAMES_HZ * FINER, rel=1e-6)
    for x in columns.values():
        assert x.shape == (1300, 3)
        assert np.isfinite(x).all()
        assert peak_hz(x[:, 0], rate) == pytest.approx(F_HZ, abs=0.01)
    grid = 2.2513 + np.arange(1300) / (FRAMES_HZ * FINER)
    truth = -100 + 3 * np.sin(2 * np.pi * F_HZ * grid)
    np.testing.assert_allclose(columns["M4"][:, 0], truth, rtol=0, atol=2e-5)
    start = more["parameters"]["OLIVEVIB"]["START_S"]["value"][0] if to == "c3d" else more[1][0]
    assert start == pytest.approx(2.2513, abs=1e-6)


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_uff_states_the_true_time_of_every_row_of_a_fitted_path(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    path, trajectory = tmp_path / "a.uff", fitted()
    export(trajectory, "uff", path)
    first = pyuff.UFF(str(path)).read_sets()[3]
    assert first["abscissa_spacing"] == 0  # uneven: abscissa values stand beside the data
    np.testing.assert_array_equal(first["x"], trajectory.t_s)
    x, t = 1000 * first["data"], first["x"]
    around = np.linspace(F_HZ - 4, F_HZ + 4, 1601)
    power = [abs(np.exp(-2j * np.pi * f * t) @ ((x - x.mean()) * np.gradient(t))) for f in around]
    assert around[int(np.argmax(power))] == pytest.approx(F_HZ, abs=0.02)


def test_the_words_tell_rate_start_and_what_is_not_in_the_file() -> None:
    words = even_part(fitted()).words
    assert "240.0000 Hz" in words
    assert "2.251300 s" in words
    assert "rest has one row a frame" in words
    whole = even_part(shaken(np.arange(90) / FRAMES_HZ, "optimal")).words
    assert "30.0000 Hz" in whole
    assert "rest" not in whole
    assert "beside" not in whole


def test_rows_are_read_at_other_instants_and_the_words_say_how_far() -> None:
    even = even_part(make_trajectory())
    late = np.nanmax(make_trajectory().sample_t_s - make_trajectory().t_s[:, None])
    assert even.worst_off_s == pytest.approx(late, abs=1e-9)
    assert f"up to {1e3 * late:.1f} ms" in even.words


def test_a_frame_that_never_came_is_a_row_without_a_sample(tmp_path: Path) -> None:
    t_s = np.delete(np.arange(120) / FRAMES_HZ, [40, 41, 80])
    even = even_part(shaken(t_s, "optimal"))
    assert even.rate_hz == pytest.approx(FRAMES_HZ, rel=1e-9)
    missing = ~even.trajectory.seen[:, 0]
    assert np.flatnonzero(missing).tolist() == [40, 41, 80]
    assert (even.trajectory.state[missing] == State.DROPPED).all()
    path = tmp_path / "a.trc"
    export(shaken(t_s, "optimal"), "trc", path)
    rate, columns, table = read_trc(path)
    np.testing.assert_allclose(table[1], np.arange(120) / rate, rtol=0, atol=1e-6)
    assert np.isnan(columns["M2"]).any(axis=1).sum() == 3


@pytest.mark.parametrize("to", EVEN)
def test_a_camera_whose_rate_varies_is_refused_with_what_holds_it(tmp_path: Path, to: str) -> None:
    pytest.importorskip("ezc3d")
    steps = (1 + 0.15 * np.sin(np.arange(200) / 20)) / FRAMES_HZ
    varying = shaken(np.cumsum(steps), "optimal")
    with pytest.raises(UsageError) as caught:
        export(varying, to, tmp_path / f"a.{to}")
    assert "one rate" in caught.value.what
    assert "csv" in caught.value.remedy
    assert not list(tmp_path.iterdir())


def test_stamps_that_jitter_a_little_keep_the_mean_rate() -> None:
    rng = np.random.default_rng(3)
    t_s = np.arange(300) / FRAMES_HZ + rng.uniform(-1e-3, 1e-3, 300)
    even = even_part(shaken(t_s, "optimal"))
    assert even.rate_hz == pytest.approx(FRAMES_HZ, rel=1e-4)
    assert 5e-4 < even.worst_off_s < 1.1e-3


def test_no_folder_is_made_for_a_mistyped_place(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        export(fitted(), "csv", tmp_path / "no" / "where.csv")
    assert "does not exist" in caught.value.why
    assert not list(tmp_path.iterdir())
