"""CSV, TXT and HDF5 exports: read back by pandas, numpy and xarray."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from exports_scene import exported, make_fit, make_rig, make_spectrum, make_trajectory

from olivevib.errors import InputError, UsageError
from olivevib.files.exports import FORMATS, ExportFacts, export
from olivevib.files.exports.text import fixed, spreadsheet_cell


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
    trajectory = replace(make_trajectory(n=400), fits=(make_fit(7),))
    facts = ExportFacts("T04", make_rig(), (make_spectrum((7, 2, 31)),))
    path = tmp_path / "a.h5"
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
    with xr.open_dataset(path, engine=engine, group="continuous/marker_7") as fit:
        assert fit["sway"].dims == ("component", "knot")
        assert fit.attrs["f_hz"] == 25.0
        assert fit["covariance"].shape == (25, 25)
    with xr.open_dataset(path, engine=engine, group="rig") as rig:
        assert rig["P_right"].values[0, 3] == pytest.approx(-420 * 900)
    assert [p.name for p in path.parent.iterdir()] == ["a.h5"]


@pytest.mark.parametrize("to", [to for to in FORMATS if to not in ("c3d", "parquet")])
def test_same_bytes_twice_and_in_file_or_stream(tmp_path: Path, to: str) -> None:
    trajectory = make_trajectory()
    facts = ExportFacts("T04", make_rig(), (make_spectrum((7, 2, 31)),))
    path = tmp_path / f"a.{to}"
    export(trajectory, to, path, facts)
    assert path.read_bytes() == exported(trajectory, to, facts=facts)


def test_markers_are_chosen_by_id_and_unknown_ids_are_named() -> None:
    trajectory = make_trajectory()
    frame = pd.read_csv(io.BytesIO(exported(trajectory, "csv", ids=(31, 2))))
    assert frame["marker"].unique().tolist() == [2, 31]
    with pytest.raises(UsageError, match=r"no marker 5.*\n.*2, 7, 31"):
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


def test_parquet_is_read_by_pandas_with_the_numbers_of_csv(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    trajectory = make_trajectory()
    export(trajectory, "parquet", tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == exported(trajectory, "parquet")
    table = pd.read_parquet(tmp_path / "a.parquet")
    text = pd.read_csv(io.BytesIO(exported(trajectory, "csv")))
    assert table.columns.tolist() == text.columns.tolist()
    for name in text.columns.drop("state"):
        np.testing.assert_allclose(table[name], text[name], rtol=0, atol=6e-7)
    assert table["state"].tolist() == text["state"].tolist()
