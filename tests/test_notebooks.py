"""The notebooks run from top to bottom, as scripts, on a small trial; they hold no outputs."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import batch_trials
import numpy as np
import pytest

from olivevib import pipeline
from olivevib.trial import Trial

DOCS = Path(__file__).resolve().parents[1] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def workspace(tmp_path_factory) -> Path:
    """A workspace whose sample trial is a small one, with its notebooks."""
    folder = tmp_path_factory.mktemp("ws")
    sample = batch_trials.one(folder / "trials" / "sample")
    list(pipeline.run(Trial.open(sample)))
    shutil.copytree(DOCS / "notebooks", folder / "docs" / "notebooks")
    return folder


def cells(path: Path) -> list[dict]:
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def test_there_is_a_notebook():
    assert [path.name for path in NOTEBOOKS] == ["results.ipynb"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_it_is_sound_and_holds_no_outputs(path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    ids = [cell["id"] for cell in notebook["cells"]]
    assert len(set(ids)) == len(ids)
    for cell in notebook["cells"]:
        keys = {"cell_type", "id", "metadata", "source"}
        if cell["cell_type"] == "code":
            keys |= {"execution_count", "outputs"}
            assert cell["outputs"] == []
            assert cell["execution_count"] is None
        assert cell.keys() == keys
        assert cell["metadata"] == {}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_it_runs_as_a_script(path, workspace):
    pytest.importorskip("xarray")
    code = "\n\n".join("".join(c["source"]) for c in cells(path) if c["cell_type"] == "code")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=workspace / "docs" / "notebooks",
        env=os.environ | {"MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "('time', 'marker', 'axis') mm" in done.stdout
    assert "[offset-unknown]" in done.stdout


def test_three_lines_give_a_table(workspace, monkeypatch):
    monkeypatch.chdir(workspace)
    head = (DOCS / "python.md").read_text(encoding="utf-8").split("\n\n")[1]
    assert len(head.splitlines()) == 3
    names: dict = {}
    exec("\n".join(line.strip() for line in head.splitlines()), names)
    assert names["table"].columns.tolist()[:5] == ["time_s", "marker", "x_mm", "y_mm", "z_mm"]


def test_named_axes_hold_the_same_numbers_as_arrays_and_files(workspace):
    xr = pytest.importorskip("xarray")
    trial = Trial.open(workspace / "trials" / "sample")
    path, named = trial.trajectory, trial.trajectory.to_xarray()
    np.testing.assert_array_equal(
        named.xyz.sel(marker=11, axis="y"), path.xyz_mm[:, path.ids.tolist().index(11), 1]
    )
    with xr.open_dataset(trial.folder / "trajectory.h5", engine="h5netcdf") as file:
        for name in ("xyz", "sigma_xyz", "covariance", "rotation", "sample_time", "epipolar"):
            np.testing.assert_array_equal(file[name], named[name])
            assert file[name].dims == named[name].dims
            assert file[name].attrs["units"] == named[name].attrs["units"]
    assert set(named.state.values.ravel()) <= {"seen", "flagged", "outside", "hidden"}


def test_spectra_as_tables_and_with_named_axes(workspace):
    pytest.importorskip("xarray")
    spectrum = Trial.open(workspace / "trials" / "sample").spectra["displacement"]
    table, named = spectrum.to_dataframe(), spectrum.to_xarray()
    assert len(table) == spectrum.f_hz.size * spectrum.ids.size
    picked = table[(table.marker == 11) & (table.f_hz == spectrum.f_hz[2])].iloc[0]
    m = spectrum.ids.tolist().index(11)
    assert [picked.x, picked.psd_z] == [spectrum.amplitude[2, m, 0], spectrum.psd[2, m, 2]]
    np.testing.assert_array_equal(named.psd.sel(marker=11), spectrum.psd[:, m])
    assert named.amplitude.attrs["units"] == "mm"
    assert named.line_status.sel(marker=11).item() == spectrum.lines[m].status
