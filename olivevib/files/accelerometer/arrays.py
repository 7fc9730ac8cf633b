"""Files of named arrays: NumPy (npy, npz) and MATLAB (mat), without running any code in them."""

from __future__ import annotations

import io
import zipfile
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from olivevib.errors import InputError
from olivevib.files.accelerometer.foreign import foreign_parser
from olivevib.files.accelerometer.names import meaning, split_unit
from olivevib.files.accelerometer.record import Channel, Table
from olivevib.files.accelerometer.units import TIME

LARGEST_VALUES = 2**28  # 2 GiB of float64
LARGEST_RATIO = 200
_FREE_BYTES = 2**24  # below this no ratio is dangerous

Named = dict[str, NDArray[Any]]


def is_npy(head: bytes) -> bool:
    """True for one NumPy array."""
    return head.startswith(b"\x93NUMPY")


def is_mat(head: bytes) -> bool:
    """True for MATLAB 5 to 7.2 files."""
    return head.startswith(b"MATLAB 5.0 MAT-file")


def read_npy(data: bytes, source: str) -> Table:
    """Read one array (N, 1…4) of numbers; it names nothing, so unit and rate must be given."""
    with foreign_parser(source, "NPY"):
        array = np.load(io.BytesIO(data), allow_pickle=False)
    return arrays_table({"": np.asarray(array)}, "NPY", source)


def read_npz(data: bytes, source: str) -> Table:
    """Read an archive of named arrays; pickles, huge and hugely compressed members are refused."""
    with foreign_parser(source, "NPZ"):
        check_archive(data, source)
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            named = {name: np.asarray(archive[name]) for name in archive.files}
    return arrays_table(named, "NPZ", source)


def check_archive(data: bytes, source: str) -> list[zipfile.ZipInfo]:
    """The members of a zip archive, after their declared sizes and ratios were found harmless."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
    size = sum(m.file_size for m in members)
    packed = max(1, sum(m.compress_size for m in members))
    if len(members) > 1000 or size > 8 * LARGEST_VALUES:
        raise _too_large(source, f"Unpacked it would take {size / 2**20:.0f} MiB.")
    if size > _FREE_BYTES and size / packed > LARGEST_RATIO:
        raise _too_large(source, f"It is packed {size / packed:.0f} times, as no recording is.")
    return members


def read_mat(data: bytes, source: str) -> Table:
    """Read a MATLAB file up to version 7.2: numeric variables, and those in one struct."""
    from scipy.io import loadmat, whosmat

    with foreign_parser(source, "MAT"):
        stream = io.BytesIO(data)
        shapes = [shape for _, shape, _ in whosmat(stream)]
        if sum(int(np.prod(s, dtype=np.float64)) for s in shapes) > LARGEST_VALUES:
            raise _too_large(source, f"Its variables have the shapes {shapes}.")
        stream.seek(0)
        loaded = loadmat(stream, squeeze_me=True, struct_as_record=True)
        named = dict(_flattened({k: v for k, v in loaded.items() if not k.startswith("__")}))
    return arrays_table(named, "MAT", source)


def _flattened(variables: dict[str, Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Variables and the fields of structs one level deep; what is no array is left out."""
    for name, value in variables.items():
        array = np.asarray(value)
        if array.dtype.names and array.size == 1:
            for field in array.dtype.names:
                yield field, np.asarray(array[field].item())
        elif array.dtype.kind in "biufU":
            yield name, array


def arrays_table(named: Named, format: str, source: str) -> Table:
    """A table of the named arrays that share the commonest length; scalars and words are header.

    An (N, 3) array holds x, y, z; (N, 4) has the time in its first column.
    """
    metadata = tuple(
        (name.casefold(), str(array.ravel()[0])) for name, array in named.items() if array.size == 1
    )
    columns = [c for name, array in named.items() for c in _columns(name, array)]
    if not columns:
        raise InputError(
            f"{source} holds no array of samples.",
            "Its arrays: "
            + (", ".join(f"{n} {a.shape}" for n, a in named.items()) or "none")
            + ".",
            "Save time and acceleration as arrays of numbers, one value a sample.",
        )
    length = _length(columns)
    channels = tuple(c for c in columns if c.values.size == length)
    return Table(format, channels, metadata, layout=f"{format}, {len(named)} arrays")


def _columns(name: str, array: NDArray[Any]) -> list[Channel]:
    if array.dtype.kind not in "iuf" or array.size < 2 or array.ndim > 2:
        return []
    array = array.astype(np.float64)
    array = np.where(np.isfinite(array), array, np.nan)
    table = array.reshape(-1, 1) if array.ndim == 1 else array
    if table.shape[0] < table.shape[1]:
        table = table.T
    width = table.shape[1]
    if width == 1:
        return [Channel(name, "", table[:, 0])]
    if width > 12:
        return []
    stem, unit = split_unit(name)
    letters = {2: ("t", "x"), 3: ("x", "y", "z"), 4: ("t", "x", "y", "z")}.get(width)
    if letters is None:
        return [Channel(f"{stem} {k + 1}".strip(), unit, table[:, k]) for k in range(width)]
    if not name:  # nameless: by position, as a text without a header
        return [Channel("", "", column) for column in table.T]
    return [
        Channel("time" if a == "t" else f"{stem} {a}", "" if a == "t" else unit, table[:, k])
        for k, a in enumerate(letters)
    ]


def _length(columns: list[Channel]) -> int:
    """The length of the axes that are named as acceleration, else of most columns."""
    said = [c.values.size for c in columns if meaning(c.name, c.unit).says_acceleration]
    rest = [c.values.size for c in columns if meaning(c.name, c.unit).quantity != TIME]
    return Counter(said or rest or [c.values.size for c in columns]).most_common(1)[0][0]


def _too_large(source: str, why: str) -> InputError:
    return InputError(f"{source} is too large to be read.", why, "Cut the shaking out and save it.")
