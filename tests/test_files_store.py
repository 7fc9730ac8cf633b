"""One HDF5 a stage: exact, deterministic, readable by others, and safe to open."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from olivevib.errors import InputError
from olivevib.files.store import (
    SEAL,
    StageFile,
    Variable,
    _seal,
    read_header,
    read_stage,
    write_stage,
)


def tracks(frames: int = 700) -> StageFile:
    rng = np.random.default_rng(7)
    variables = {
        "note": Variable(("line",), np.array(["", "µm × 3", "='x"])),
        "sound": Variable(("line",), np.array([True, False, True])),
        "scale": Variable((), np.array(1.25), "mm"),
    }
    for side, n in (("left", frames), ("right", frames - 50)):
        centre = rng.normal(600, 100, (n, 2, 2))
        centre[5:9] = np.nan
        variables |= {
            f"{side}/frame": Variable(("frame",), np.arange(n), "1", "frame count"),
            f"{side}/marker": Variable(("marker",), np.array([3, 41]), "1", "id"),
            f"{side}/centre": Variable(("frame", "marker", "xy"), centre, "px", "centre"),
            f"{side}/state": Variable(
                ("frame", "marker"), rng.integers(0, 3, (n, 2)), "1", "", ("seen", "flagged", "far")
            ),
        }
    return StageFile(
        stage="track",
        schema=3,
        settings={"detection.fill": 0.7, "ids": [3, 41], "none": None, "text": "µ"},
        inputs={"left video": "ab" * 32, "right video": "cd" * 32},
        variables=variables,
        attributes={"frame": "left camera", "sigma": 0.1 + 0.2, "n": -3, "unknown": float("nan")},
    )


def same(a: StageFile, b: StageFile) -> None:
    assert (a.stage, a.schema, dict(a.settings)) == (b.stage, b.schema, dict(b.settings))
    assert dict(a.inputs) == dict(b.inputs)
    assert set(a.attributes) == set(b.attributes)
    for name, value in a.attributes.items():
        assert type(b.attributes[name]) is type(value)
        assert np.array_equal(b.attributes[name], value, equal_nan=isinstance(value, float))
    assert set(a.variables) == set(b.variables)
    for name, x in a.variables.items():
        y = b.variables[name]
        assert (x.dims, x.units, x.long_name, x.flag_words) == (
            *(y.dims, y.units, y.long_name, y.flag_words),
        )
        assert x.values.dtype.kind == y.values.dtype.kind and x.values.shape == y.values.shape
        assert np.array_equal(x.values, y.values, equal_nan=x.values.dtype.kind == "f")


def test_round_trip_is_exact(tmp_path: Path) -> None:
    path = tmp_path / "tracks.h5"
    write_stage(path, tracks())
    same(tracks(), read_stage(path, "track", newest=3))
    header = read_header(path)
    assert header.settings == dict(tracks().settings) and header.inputs == dict(tracks().inputs)
    assert (header.stage, header.schema) == ("track", 3)
    assert [p.name for p in tmp_path.iterdir()] == ["tracks.h5"]


@settings(deadline=None, max_examples=25)
@given(
    hnp.arrays(
        np.float64,
        hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5),
        elements=st.floats(width=64),
    )
)
def test_any_shape_and_any_float(
    tmp_path_factory: pytest.TempPathFactory, values: np.ndarray
) -> None:
    path = tmp_path_factory.mktemp("h") / "x.h5"
    dims = tuple("abcd"[: values.ndim])
    file = StageFile("analyse", 1, {}, {}, {"value": Variable(dims, values)})
    write_stage(path, file)
    back = read_stage(path, "analyse").variables["value"]
    assert back.dims == dims and back.values.tobytes() == values.tobytes()


def test_the_same_content_gives_the_same_bytes(tmp_path: Path) -> None:
    """In another process, at another time, under another name."""
    write_stage(tmp_path / "a.h5", tracks())
    code = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_files_store import tracks, write_stage
write_stage({str(tmp_path / "other.h5")!r}, tracks())
"""
    subprocess.run([sys.executable, "-c", code], check=True)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "other.h5").read_bytes()


def test_xarray_opens_it_without_our_code(tmp_path: Path) -> None:
    path = tmp_path / "tracks.h5"
    file = tracks()
    write_stage(path, file)
    with xr.open_dataset(path, engine="h5netcdf", group="left") as left:
        assert dict(left.sizes) == {"frame": 700, "marker": 2, "xy": 2}
        assert left["centre"].dims == ("frame", "marker", "xy")
        assert left["centre"].attrs == {"units": "px", "long_name": "centre"}
        assert left["marker"].values.tolist() == [3, 41] and "marker" in left.coords
        wanted = file.variables["left/centre"].values
        assert np.array_equal(left["centre"].values, wanted, equal_nan=True)
        assert left["centre"].sel(marker=41).isel(frame=20, xy=1) == wanted[20, 1, 1]
        assert left["state"].attrs["flag_meanings"] == "seen flagged far"
        assert left["state"].attrs["flag_values"].tolist() == [0, 1, 2]
    with xr.open_dataset(path, engine="h5netcdf") as root:
        assert root.attrs["stage"] == "track" and root.attrs["Conventions"].startswith("CF-")
        assert root["note"].values.tolist() == ["", "µm × 3", "='x"]
        assert root["sound"].dtype == bool and float(root["scale"]) == 1.25
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        assert set(tree.children) == {"left", "right"}


def test_a_group_shares_the_scale_of_the_root_where_it_fits(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    variables = {
        "marker": Variable(("marker",), np.array([1, 2])),
        "left/size": Variable(("marker",), np.array([1.0, 2.0])),
    }
    write_stage(path, StageFile("track", 1, {}, {}, variables))
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        assert tree["left"]["marker"].values.tolist() == [1, 2]
    assert read_stage(path, "track").variables["left/size"].dims == ("marker",)


def test_chunks_compression_and_checksums(tmp_path: Path) -> None:
    write_stage(tmp_path / "x.h5", tracks())
    with h5py.File(tmp_path / "x.h5") as h5:
        data = h5["left/centre"]
        assert data.chunks == (300, 2, 2) and data.shuffle and data.fletcher32
        assert (data.compression, data.compression_opts) == ("gzip", 4)
        assert data.dtype == np.dtype("<f8") and h5["scale"].chunks is None


@pytest.mark.parametrize(
    "make",
    [
        lambda: Variable(("a",), np.zeros((2, 2))),
        lambda: Variable(("a", "a"), np.zeros((2, 2))),
        lambda: Variable(("a/b",), np.zeros(2)),
        lambda: Variable(("a",), np.array([1j, 2])),
        lambda: Variable(("a",), np.array([{}, {}])),
        lambda: Variable(("a",), np.zeros(2), flag_words=("x", "y")),
        lambda: StageFile("t", 1, {}, {}, {"a/b/c": Variable((), np.array(1))}),
        lambda: StageFile("t", 1, {}, {}, {}, {"settings": 1}),
        lambda: StageFile("t", 1, {}, {}, {}, {"list": [1]}),  # type: ignore[dict-item]
        lambda: StageFile(
            *("t", 1, {}, {}),
            {"x": Variable(("a",), np.zeros(2)), "y": Variable(("a",), np.zeros(3))},
        ),
        lambda: StageFile(
            *("t", 1, {}, {}),
            {"x": Variable(("a",), np.zeros(2)), "g/y": Variable(("a",), np.zeros(3))},
        ),
        lambda: StageFile(
            *("t", 1, {}, {}),
            {"a": Variable(("b",), np.zeros(2)), "y": Variable(("a",), np.zeros(3))},
        ),
    ],
)
def test_constructors_refuse_what_cannot_be_stored(make: Callable[[], Any]) -> None:
    with pytest.raises(ValueError, match=r".+"):
        make()


def test_settings_that_json_cannot_hold(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="JSON"):
        write_stage(tmp_path / "x.h5", StageFile("t", 1, {"a": float("nan")}, {}))
    assert not list(tmp_path.iterdir())


# --- what is refused ----------------------------------------------------------------------


def edited(tmp_path: Path, change: Callable[[Any], None]) -> Path:
    """A file with something added, and sealed again, as somebody with ill intent would do."""
    path = tmp_path / "tracks.h5"
    write_stage(path, tracks(100))
    path.write_bytes(path.read_bytes().partition(SEAL)[0])
    with h5py.File(path, "r+") as h5:
        change(h5)
    image = path.read_bytes()
    path.write_bytes(image + _seal(image))
    return path


def external_link(h5: Any) -> None:
    h5["other"] = h5py.ExternalLink("secret.h5", "/data")


def external_link_in_group(h5: Any) -> None:
    h5["left/other"] = h5py.ExternalLink("secret.h5", "/data")


def soft_link(h5: Any) -> None:
    h5["other"] = h5py.SoftLink("/left/centre")


def raw_storage(h5: Any) -> None:
    h5.create_dataset("raw", (10,), "<f8", external=[("secret.bin", 0, 80)])


def virtual(h5: Any) -> None:
    layout = h5py.VirtualLayout((10,), "<f8")
    layout[:] = h5py.VirtualSource("secret.h5", "data", (10,))
    h5.create_virtual_dataset("virtual", layout)


def other_filter(h5: Any) -> None:
    h5.create_dataset("packed", data=np.arange(10.0), compression="lzf", chunks=(10,))


def compound(h5: Any) -> None:
    h5["odd"] = np.zeros(3, [("a", "<f8"), ("b", "<i4")])


def named_type(h5: Any) -> None:
    h5["type"] = np.dtype("<f8")


def circle(h5: Any) -> None:
    h5["left/up"] = h5["/"]


def twice(h5: Any) -> None:
    h5["right/twin"] = h5["left/centre"]


def deep(h5: Any) -> None:
    h5["left/deep/down"] = np.zeros(2)


def never_written(h5: Any) -> None:
    h5.create_dataset("bomb", (200_000_000,), "<f8", chunks=(1_000_000,), compression="gzip")


def too_large(h5: Any) -> None:
    h5.create_dataset("huge", (10**12,), "<f8", chunks=(1_000_000,))


def crowd(h5: Any) -> None:
    for k in range(2100):
        h5.create_dataset(f"n{k}", data=0.0, track_times=False)


@pytest.mark.parametrize(
    "change",
    [
        *(external_link, external_link_in_group, soft_link, raw_storage, virtual, other_filter),
        *(compound, named_type, circle, twice, deep, never_written, too_large, crowd),
    ],
)
def test_what_olivevib_never_writes_is_refused(
    tmp_path: Path, change: Callable[[Any], None]
) -> None:
    (tmp_path / "secret.bin").write_bytes(bytes(80))
    with h5py.File(tmp_path / "secret.h5", "w") as h5:
        h5["data"] = np.arange(10.0)
    path = edited(tmp_path, change)
    with pytest.raises(InputError, match="not written by olivevib"):
        read_stage(path, "track")


def test_the_untouched_file_passes_the_same_audit(tmp_path: Path) -> None:
    same(tracks(100), read_stage(edited(tmp_path, lambda h5: None), "track"))


def test_foreign_files(tmp_path: Path) -> None:
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as h5:
        h5["x"] = np.arange(3.0)
    with pytest.raises(InputError, match="changed by another program"):
        read_stage(other, "track")
    image = other.read_bytes()
    other.write_bytes(image + _seal(image))
    with pytest.raises(InputError, match="not written by olivevib"):
        read_stage(other, "track")
    text = tmp_path / "text.h5"
    text.write_text("hello")
    with pytest.raises(InputError, match="not written by olivevib"):
        read_header(text)
    with pytest.raises(InputError, match="does not exist"):
        read_header(tmp_path / "none.h5")


def test_another_stage_and_newer_files_are_named(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    write_stage(path, tracks(100))
    with pytest.raises(InputError, match="holds the stage 'track', not 'analyse'"):
        read_stage(path, "analyse")
    with pytest.raises(InputError, match="newer olivevib"):
        read_stage(path, "track", newest=2)
    future = edited(tmp_path, lambda h5: h5.attrs.modify("olivevib_format", 99))
    with pytest.raises(InputError, match="newer olivevib"):
        read_header(future)


def test_a_flipped_byte_in_the_data_is_noticed(tmp_path: Path) -> None:
    """By the checksums within HDF5 too, for readers that do not look at the seal."""
    path = tmp_path / "x.h5"
    write_stage(path, tracks())
    with h5py.File(path) as h5:
        chunk = h5["left/centre"].id.get_chunk_info(1)
    data = bytearray(path.read_bytes().partition(SEAL)[0])
    data[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(bytes(data) + _seal(bytes(data)))
    with pytest.raises(InputError, match="damaged") as caught:
        read_stage(path, "track")
    assert "again" in caught.value.remedy


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_damage_anywhere_gives_an_error_for_people(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("h") / "x.h5"
    write_stage(path, tracks(60))
    content = bytearray(path.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        del content[at:]
    else:
        content[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    for read in (read_header, lambda p: read_stage(p, "track")):
        with pytest.raises(InputError, match=r"damaged|not written by olivevib"):
            read(path)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs limits of the operating system")
def test_a_full_disk_keeps_the_old_file_and_the_interpreter_alive(tmp_path: Path) -> None:
    path = tmp_path / "tracks.h5"
    write_stage(path, tracks(60))
    before = path.read_bytes()
    code = f"""
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_files_store import InputError, tracks, write_stage
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
try:
    write_stage({str(path)!r}, tracks(5000))
except InputError as error:
    print(error.why)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0 and "full" in run.stdout, run.stderr
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
