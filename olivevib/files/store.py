"""What a stage found, as one HDF5 file: written whole, read back only after an audit.

Dimension scales and CF attributes make the file open in xarray, netCDF4 and pandas without our
code. FORMAT.md lists every variable. Behind the HDF5 content stands a seal, the SHA-256 of what
is before it, because the HDF5 library itself can crash on a damaged file: it gets to see only
what is whole.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from olivevib import __version__
from olivevib.errors import InputError
from olivevib.files.atomic import write_bytes_atomic
from olivevib.files.store_audit import NOT_A_VARIABLE, Foreign, audit, text_attribute

FORMAT = 1  # of the container itself; each stage has its own schema number on top
SEAL = b"\nolivevib stage file, SHA-256 of the bytes before this line: "
MAX_FILE_BYTES = 4 << 30
CHUNK_ROWS = 300  # 10 s at 30 frames per second
CHUNK_BYTES = 8_000_000
_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)?", re.ASCII)
_OWN = ("Conventions", "software", "software_version", "olivevib_format")
_HEADER = ("stage", "schema_version", "settings", "inputs")

Attribute = str | int | float


@dataclass(frozen=True)
class Variable:
    """One named array: dims name its axes; values are float64, int64, bool or str.

    units as CF writes them ("mm", "s", "1"); flag_words: the words that whole numbers 0, 1, …
    stand for (blanks within a word become underscores).
    """

    dims: tuple[str, ...]
    values: NDArray[Any]
    units: str = ""
    long_name: str = ""
    flag_words: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        values = _plain(np.asarray(self.values))
        if values.ndim != len(self.dims) or len(set(self.dims)) != len(self.dims):
            raise ValueError(f"dims {self.dims} do not name the axes of shape {values.shape}")
        if bad := [d for d in self.dims if not _NAME.fullmatch(d) or "/" in d]:
            raise ValueError(f"no names of dimensions: {bad}")
        if self.flag_words and values.dtype.kind != "i":
            raise ValueError(f"flag words need whole numbers, got {values.dtype}")
        values.flags.writeable = False
        words = tuple("_".join(word.split()) for word in self.flag_words)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "flag_words", words)


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    """As float64, int64, bool or str, copied unless read-only; ValueError for anything else."""
    wanted: dict[str, Any] = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_}
    kind = values.dtype.kind
    if kind in wanted:
        return values.astype(wanted[kind], copy=values.flags.writeable)
    if kind == "U" or (kind == "O" and all(isinstance(v, str) for v in values.flat)):
        return values.astype(np.str_)
    raise ValueError(f"cannot be stored: values of type {values.dtype}")


@dataclass(frozen=True)
class StageFile:
    """Everything that one stage writes.

    schema: version of this stage's variables; settings: what JSON can hold; inputs: name ->
    SHA-256 of what it was computed from; variables: names may hold one group ("left/centre");
    attributes: text and numbers about the whole (true and false are stored as 1 and 0).
    """

    stage: str
    schema: int
    settings: Mapping[str, Any]
    inputs: Mapping[str, str]
    variables: Mapping[str, Variable] = field(default_factory=dict)
    attributes: Mapping[str, Attribute] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if bad := [name for name in self.variables if not _NAME.fullmatch(name)]:
            raise ValueError(f"no names of variables: {bad}")
        if clash := sorted(set(self.attributes) & {*_OWN, *_HEADER}):
            raise ValueError(f"attributes with names of the header: {clash}")
        if bad := [k for k, v in self.attributes.items() if not isinstance(v, str | int | float)]:
            raise ValueError(f"attributes that are no text and no number: {bad}")
        _dimensions(self.variables)


class StageHeader(NamedTuple):
    """What a stage file says of itself, without its data."""

    stage: str
    schema: int
    settings: dict[str, Any]
    inputs: dict[str, str]
    software_version: str


def write_stage(path: str | Path, file: StageFile) -> None:
    """Write a stage file whole and at once; the same content gives the same bytes.

    The file is built in memory and then replaces the old one, so that a full disk or a kill
    leaves the old one intact. Raises InputError (full disk, forbidden folder).
    """
    write_bytes_atomic(path, _image(file))


def read_stage(path: str | Path, stage: str, newest: int | None = None) -> StageFile:
    """Read the file of a stage, after an audit that lets it hold nothing but plain arrays.

    newest: the highest schema this caller understands. Raises InputError where the file is
    missing, damaged, another program's, another stage's, or written by a newer olivevib.
    """
    with _opened(Path(path)) as h5:
        header = _header(h5)
        _refuse_newer(Path(path), h5, header, newest)
        if header.stage != stage:
            raise InputError(
                f"{path} holds the stage {header.stage!r}, not {stage!r}.",
                "It was renamed or copied from elsewhere.",
                f"Remove it and run the stage {stage} again.",
            )
        audit(h5)
        return StageFile(
            stage=header.stage,
            schema=header.schema,
            settings=header.settings,
            inputs=header.inputs,
            variables=dict(_variables(h5)),
            attributes=_attributes(h5),
        )


def read_header(path: str | Path) -> StageHeader:
    """Stage, schema, settings and inputs of a stage file, without its data; raises InputError."""
    with _opened(Path(path)) as h5:
        header = _header(h5)
        _refuse_newer(Path(path), h5, header, None)
        return header


# --- writing ------------------------------------------------------------------------------


def _image(file: StageFile) -> bytes:
    """The bytes of the HDF5 file, built in memory without any date."""
    with h5py.File("stage", "w", driver="core", backing_store=False, libver="earliest") as h5:
        h5.attrs["Conventions"] = "CF-1.11"
        h5.attrs["software"] = "olivevib"
        h5.attrs["software_version"] = __version__
        h5.attrs["olivevib_format"] = FORMAT
        h5.attrs["stage"] = file.stage
        h5.attrs["schema_version"] = file.schema
        h5.attrs["settings"] = _json(file.settings)
        h5.attrs["inputs"] = _json(file.inputs)
        for name in sorted(file.attributes):
            value = file.attributes[name]
            h5.attrs[name] = int(value) if isinstance(value, bool) else value
        for name in sorted(file.variables):
            _write_variable(h5, name, file.variables[name])
        _attach_scales(h5, file.variables)
        h5.flush()
        image = bytes(h5.id.get_file_image())
    return image + _seal(image)


def _seal(image: bytes) -> bytes:
    return SEAL + hashlib.sha256(image).hexdigest().encode() + b"\n"


def _json(value: Mapping[str, Any]) -> str:
    return json.dumps(value, sort_keys=True, ensure_ascii=False, allow_nan=False)


def _write_variable(h5: Any, name: str, variable: Variable) -> None:
    values: NDArray[Any] = variable.values
    if values.dtype.kind == "U":
        text = h5py.string_dtype("utf-8")
        dataset = h5.create_dataset(name, data=values.astype(object), dtype=text, track_times=False)
    else:
        stored = values.astype(np.int8) if values.dtype.kind == "b" else values
        dataset = h5.create_dataset(name, data=stored, track_times=False, **_layout(stored))
    if values.dtype.kind == "b":
        dataset.attrs["dtype"] = "bool"  # as xarray writes it
    for key, word in (("units", variable.units), ("long_name", variable.long_name)):
        if word:
            dataset.attrs[key] = word
    if variable.flag_words:
        dataset.attrs["flag_values"] = np.arange(len(variable.flag_words))
        dataset.attrs["flag_meanings"] = " ".join(variable.flag_words)


def _layout(values: NDArray[Any]) -> dict[str, Any]:
    """Chunks of about 10 s along the first dimension, compressed and with checksums."""
    if not values.ndim or not values.size:
        return {}
    row = values.nbytes // len(values)
    rows = max(1, min(len(values), CHUNK_ROWS, CHUNK_BYTES // max(row, 1)))
    return {
        "chunks": (rows, *values.shape[1:]),
        "shuffle": True,
        "compression": "gzip",
        "compression_opts": 4,
        "fletcher32": True,
    }


def _group(name: str) -> str:
    return name.rpartition("/")[0]


def _dimensions(variables: Mapping[str, Variable]) -> dict[tuple[str, str], int]:
    """Length of every (group, dimension); raises ValueError where variables disagree."""
    lengths: dict[tuple[str, str], int] = {}
    for name, variable in variables.items():
        for dim, length in zip(variable.dims, variable.values.shape, strict=True):
            known = lengths.setdefault((_group(name), dim), length)
            if known != length:
                raise ValueError(f"{name}: dimension {dim} has {length} values, others {known}")
    for (group, dim), length in lengths.items():
        if lengths.get(("", dim), length) != length:
            raise ValueError(f"dimension {dim} has another length in {group} than in the root")
        same = variables.get(f"{group}/{dim}".lstrip("/"))
        if same is not None and same.dims != (dim,):
            raise ValueError(f"variable {dim} is no scale of the dimension of that name")
    return lengths


def _attach_scales(h5: Any, variables: Mapping[str, Variable]) -> None:
    """Give every axis its dimension scale: the variable of that name, or a bare length.

    A group uses the scale of the root where that has a dimension of the same name.
    """
    lengths = _dimensions(variables)
    scales: dict[tuple[str, str], Any] = {}
    for (group, dim), length in sorted(lengths.items()):  # the root comes first
        path = f"{group}/{dim}".lstrip("/")
        if group and path not in variables and ("", dim) in lengths:
            scales[group, dim] = scales["", dim]
            continue
        if path not in variables:
            bare = h5.create_dataset(path, (length,), ">f4", track_times=False)
            bare.make_scale(f"{NOT_A_VARIABLE}{length:10d}")
        else:
            h5[path].make_scale(dim)
        scales[group, dim] = h5[path]
    for name in sorted(variables):
        for axis, dim in enumerate(variables[name].dims):
            if name.rpartition("/")[2] != dim:
                h5[name].dims[axis].attach_scale(scales[_group(name), dim])


# --- reading ------------------------------------------------------------------------------


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The content of a stage file, read at once; what goes wrong inside becomes an InputError."""
    image = _whole(path)
    try:
        with h5py.File(h5py.h5f.open_file_image(image, flags=0)) as h5:
            yield h5
    except Foreign as error:
        raise _foreign(path, str(error)) from error
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError) as error:
        reason = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
        raise InputError(f"{path} is damaged.", reason, _AGAIN) from error


_AGAIN = "Remove it and run the stage that writes it again."


def _foreign(path: Path, why: str) -> InputError:
    return InputError(f"{path} was not written by olivevib.", why, _AGAIN)


def _whole(path: Path) -> bytes:
    """The bytes before the seal, when the seal fits; raises InputError."""
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise _foreign(path, "It is larger than any stage file.")
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{path} does not exist.", "", "Run the stage that writes it.") from error
    except OSError as error:
        raise InputError(f"{path} cannot be read.", error.strerror or str(error), "") from error
    length = len(SEAL) + 65
    image, seal = data[:-length], data[-length:]
    if not data.startswith(b"\x89HDF\r\n\x1a\n"):
        raise _foreign(path, "It is no HDF5 file.")
    if not seal.startswith(SEAL):
        raise InputError(
            f"{path} is damaged.", "It is cut off, or was changed by another program.", _AGAIN
        )
    if seal != _seal(image):
        raise InputError(f"{path} is damaged.", "Its bytes do not fit its checksum.", _AGAIN)
    return image


def _header(h5: Any) -> StageHeader:
    if text_attribute(h5, "software") != "olivevib":
        raise Foreign("Its header does not name olivevib.")
    settings = json.loads(text_attribute(h5, "settings"))
    inputs = json.loads(text_attribute(h5, "inputs"))
    if not (isinstance(settings, dict) and isinstance(inputs, dict)):
        raise Foreign("Its header has another form.")
    return StageHeader(
        stage=text_attribute(h5, "stage"),
        schema=int(h5.attrs["schema_version"]),
        settings=settings,
        inputs=inputs,
        software_version=text_attribute(h5, "software_version"),
    )


def _refuse_newer(path: Path, h5: Any, header: StageHeader, newest: int | None) -> None:
    newer = newest is not None and header.schema > newest
    if newer or int(h5.attrs["olivevib_format"]) > FORMAT:
        raise InputError(
            f"{path} was written by a newer olivevib ({header.software_version}).",
            f"This one is {__version__} and does not know that form.",
            "Use the newer version, or remove the file and run the stage again.",
        )


def _attributes(h5: Any) -> dict[str, Attribute]:
    out: dict[str, Attribute] = {}
    for name in h5.attrs:
        if name not in (*_OWN, *_HEADER):
            value = h5.attrs[name]
            out[name] = value if isinstance(value, str) else value.item()
    return out


def _variables(h5: Any) -> Iterator[tuple[str, Variable]]:
    datasets: dict[str, Any] = {}
    for name, item in h5.items():
        if isinstance(item, h5py.Group):
            datasets |= {f"{name}/{inner}": dataset for inner, dataset in item.items()}
        else:
            datasets[name] = item
    named = {_address(dataset): _last(name) for name, dataset in datasets.items()}
    for name, dataset in datasets.items():
        if not _is_bare(dataset):
            yield name, _variable(dataset, named)


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _address(dataset: Any) -> int:
    """Where an object lies in its file: HDF5 finds the name of an object by a search each time."""
    return int(h5py.h5o.get_info(dataset.id).addr)


def _is_bare(dataset: Any) -> bool:
    return text_attribute(dataset, "NAME").startswith(NOT_A_VARIABLE)


def _variable(dataset: Any, named: Mapping[int, str]) -> Variable:
    if dataset.is_scale:
        dims: tuple[str, ...] = (named[_address(dataset)],)
    else:
        dims = tuple(named[_address(axis[0])] for axis in dataset.dims)
    text = h5py.check_string_dtype(dataset.dtype) is not None
    values = dataset.asstr()[()] if text else dataset[()]
    if text_attribute(dataset, "dtype") == "bool":
        values = np.asarray(values, np.bool_)
    words = text_attribute(dataset, "flag_meanings").split()
    units, long_name = (text_attribute(dataset, key) for key in ("units", "long_name"))
    return Variable(dims, np.asarray(values), units, long_name, tuple(words))
