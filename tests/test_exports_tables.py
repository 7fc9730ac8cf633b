"""CSV, TXT and HDF5 exports: read back by pandas, numpy and xarray."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from olivevib.errors import InputError, UsageError
from olivevib.files.exports import FORMATS, ExportFacts, export
from olivevib.files.exports.text import fixed, spreadsheet_cell
from olivevib.geometry import CameraModel, StereoRig
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import State
from olivevib.vibration.types import Line, LineStatus, Spectrum


def make_trajectory(n: int = 50, ids: tuple[int, ...] = (7, 2, 31), seed: int = 1) -> Trajectory:
    rng = np.random.default_rng(seed)
    m = len(ids)
    t_s = np.arange(n) * 1001 / 30000
    xyz = rng.normal(0, 200, (n, m, 3)) + np.array([0, 0, 1500])
    sample_t = np.repeat(t_s[:, None], m, axis=1) + rng.uniform(0, 0.02, m)
    state = np.zeros((n, m), dtype=np.int64)
    xyz[10:14, 0] = np.nan
    sample_t[10:14, 0] = np.nan
    state[10:14, 0] = State.HIDDEN
    state[20, 1] = State.FLAGGED
    sigma = np.where(np.isnan(xyz), np.nan, rng.uniform(0.05, 0.4, xyz.shape))
    covariance = sigma[..., None] * sigma[..., None, :] * np.eye(3)
    return Trajectory(
        t_s=t_s,
        ids=np.array(ids),
        sample_t_s=sample_t,
        xyz_mm=xyz,
        sigma_xyz_mm=sigma,
        covariance_mm2=covariance,
        rotation_rad=xyz / 1e4,
        sigma_rotation_rad=sigma / 1e3,
        state=state,
        epipolar_px=xyz[..., 0] / 1e3,
        frame="left camera",
        method="optimal",
    )


def make_rig() -> StereoRig:
    camera = CameraModel((1280, 720), [[900, 0, 640], [0, 900, 360], [0, 0, 1]], np.zeros(5))
    return StereoRig(camera, camera, np.eye(3), [-420.0, 0, 0], np.eye(18))


def make_spectrum(ids: tuple[int, ...]) -> Spectrum:
    f_hz = np.linspace(0, 15, 31)
    shape = (f_hz.size, len(ids), 3)
    line = Line(
        f_hz=5.0,
        f_sigma_hz=0.01,
        status=LineStatus.AMBIGUOUS,
        candidates_hz=(5.0, 25.0, 35.0),
        amplitude=np.ones(3),
        amplitude_sigma=np.full(3, 0.1),
        phase_rad=np.zeros(3),
        t_ref_s=1.0,
        unit="mm",
        harmonics=np.empty((0, 3)),
    )
    ones = np.ones(shape)
    lines = (line,) * len(ids)
    return Spectrum(
        f_hz, np.array(ids), ones, ones / 2, "displacement", "mm", "hann", 0.5, 1.5, lines
    )


def exported(trajectory: Trajectory, to: str, **kwargs: object) -> bytes:
    stream = io.BytesIO()
    export(trajectory, to, stream, **kwargs)  # type: ignore[arg-type]
    return stream.getvalue()


def test_csv_gives_back_every_number_and_blank() -> None:
    trajectory = make_trajectory()
    frame = pd.read_csv(io.BytesIO(exported(trajectory, "csv")))
    header = "time_s,marker,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_mm,sigma_z_mm,state"
    assert ",".join(frame.columns) == header
    assert frame["marker"].tolist() == [2] * 50 + [7] * 50 + [31] * 50
    seven = frame[frame["marker"] == 7]
    np.testing.assert_allclose(
        seven[["x_mm", "y_mm", "z_mm"]], trajectory.xyz_mm[:, 0], rtol=0, atol=6e-7
    )
    assert seven["x_mm"].isna().sum() == 4
    assert seven["state"].tolist()[10:14] == ["hidden"] * 4
    own = np.where(
        np.isnan(trajectory.sample_t_s[:, 0]), trajectory.t_s, trajectory.sample_t_s[:, 0]
    )
    np.testing.assert_allclose(seven["time_s"], own, rtol=0, atol=6e-10)


def test_txt_blocks_end_at_gaps() -> None:
    trajectory = make_trajectory()
    text = exported(trajectory, "txt", facts=ExportFacts(trial="2026 Täler")).decode("ascii")
    assert "# trial: 2026 T?ler" in text
    titles = [line for line in text.splitlines() if line.startswith("# marker")]
    assert titles == [
        "# marker 2 stretch 1 samples 50",
        "# marker 7 stretch 1 samples 10",
        "# marker 7 stretch 2 samples 36",
        "# marker 31 stretch 1 samples 50",
    ]
    table = np.loadtxt(io.StringIO(text))
    np.testing.assert_allclose(table[:50, :3], trajectory.xyz_mm[:, 1], rtol=0, atol=6e-7)
    np.testing.assert_allclose(table[:50, 3], trajectory.sample_t_s[:, 1], rtol=0, atol=6e-10)


@pytest.mark.parametrize("engine", ["h5netcdf"])
def test_h5_opens_in_xarray_without_our_code(tmp_path: Path, engine: str) -> None:
    trajectory = make_trajectory(n=400)
    facts = ExportFacts("T04", make_rig(), (make_spectrum((7, 2, 31)),))
    path = tmp_path / "new folder" / "a.h5"
    export(trajectory, "h5", path, facts)
    with xr.open_dataset(path, engine=engine) as data:
        assert data["xyz_mm"].dims == ("time", "marker", "axis")
        assert data["xyz_mm"].attrs["units"] == "mm"
        assert [str(a) for a in data["axis"].values] == ["x", "y", "z"]
        picked = data["xyz_mm"].sel(marker=7, axis="z").values
        np.testing.assert_array_equal(picked, trajectory.xyz_mm[:, 0, 2])
        np.testing.assert_array_equal(data["time"].values, trajectory.t_s)
        assert data["state"].attrs["flag_meanings"].split()[2] == "hidden"
        assert data["covariance_mm2"].shape == (400, 3, 3, 3)
    with xr.open_dataset(path, engine=engine, group="spectra/displacement") as spectra:
        assert spectra["amplitude"].dims == ("f_hz", "marker", "axis")
        assert spectra["line_candidates_hz"].sel(marker=7).values.tolist() == [5.0, 25.0, 35.0]
        assert str(spectra["line_status"].values[0]) == "ambiguous"
    with xr.open_dataset(path, engine=engine, group="rig") as rig:
        assert rig["P_right"].values[0, 3] == pytest.approx(-420 * 900)
    assert [p.name for p in path.parent.iterdir()] == ["a.h5"]


@pytest.mark.parametrize("to", FORMATS)
def test_same_bytes_twice_and_in_file_or_stream(tmp_path: Path, to: str) -> None:
    trajectory = make_trajectory()
    facts = ExportFacts("T04", make_rig(), (make_spectrum((7, 2, 31)),))
    path = tmp_path / f"a.{to}"
    export(trajectory, to, path, facts)
    assert path.read_bytes() == exported(trajectory, to, facts=facts)


@pytest.mark.parametrize("to", FORMATS)
def test_no_markers_and_no_frames_still_write_a_file(to: str) -> None:
    empty = make_trajectory(n=50)
    blank = Trajectory(**{**empty.__dict__, "xyz_mm": np.full((50, 3, 3), np.nan)})
    assert exported(blank, to)


def test_markers_are_chosen_by_id_and_unknown_ids_are_named() -> None:
    trajectory = make_trajectory()
    frame = pd.read_csv(io.BytesIO(exported(trajectory, "csv", ids=(31, 2))))
    assert frame["marker"].unique().tolist() == [2, 31]
    with pytest.raises(UsageError, match=r"--markers: 5 .*\n.*2, 7, 31"):
        exported(trajectory, "csv", ids=(2, 5))


def test_unknown_format_names_the_nearest() -> None:
    with pytest.raises(UsageError, match="Did you mean csv"):
        exported(make_trajectory(), "cvs")


def test_a_refused_disk_is_an_error_for_people(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="could not be written"):
        export(make_trajectory(), "csv", tmp_path / "file" / "a.csv")


def test_formulas_are_quoted_and_numbers_are_not() -> None:
    assert spreadsheet_cell("=1+2") == "'=1+2"
    assert spreadsheet_cell("@x") == "'@x"
    assert spreadsheet_cell("-1.5e3") == "-1.5e3"
    assert spreadsheet_cell("-a,b") == '"\'-a,b"'
    assert fixed(np.array([-1e-12, np.nan, 1.0]), 3) == ["0.000", "", "1.000"]
