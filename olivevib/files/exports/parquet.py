"""Parquet: the columns of the CSV export with types and units, for pandas, polars, R and DuckDB."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO

import numpy as np

from olivevib.errors import UsageError
from olivevib.files.exports.facts import ExportFacts, marker_paths
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import State


def write_parquet(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write one row a marker and time, markers by id; null where a marker was not seen.

    float64, ids int64, state as words; trial and frame in the file's metadata. Raises UsageError
    where pyarrow is absent.
    """
    words = np.array([s.word for s in State])
    parts: dict[str, list[np.ndarray]] = {}
    for path in marker_paths(trajectory):
        columns = {"time_s": path.t_s, "marker": np.full(path.t_s.size, path.id)}
        columns |= {f"{axis}_mm": path.xyz_mm[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"sigma_{axis}_mm": path.sigma_mm[:, k] for k, axis in enumerate("xyz")}
        columns["state"] = words[path.state]
        for name, values in columns.items():
            parts.setdefault(name, []).append(values)
    whole = {name: np.concatenate(values) for name, values in parts.items()}
    about = {"trial": facts.trial, "frame": trajectory.frame, "software": "olivevib"}
    out.write(parquet_bytes(whole or _empty(), about))


def _empty() -> dict[str, np.ndarray]:
    numbers = ("x_mm", "y_mm", "z_mm", "sigma_x_mm", "sigma_y_mm", "sigma_z_mm")
    first = {"time_s": np.empty(0), "marker": np.empty(0, np.int64)}
    return first | {n: np.empty(0) for n in numbers} | {"state": np.empty(0, "U1")}


def parquet_bytes(
    columns: Mapping[str, Sequence[Any] | np.ndarray], about: Mapping[str, str]
) -> bytes:
    """Columns of equal length as a Parquet file; NaN and None become null, ``about`` metadata.

    The same columns give the same bytes. Raises UsageError where pyarrow is absent.
    """
    pyarrow, parquet = require_pyarrow()
    arrays = {name: pyarrow.array(values, from_pandas=True) for name, values in columns.items()}
    table = pyarrow.table(arrays).replace_schema_metadata(dict(about))
    buffer = io.BytesIO()
    parquet.write_table(table, buffer, compression="zstd")
    return buffer.getvalue()


def require_pyarrow() -> tuple[Any, Any]:
    """Pyarrow and its Parquet part; UsageError with the line that installs them."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise UsageError(
            "Parquet needs the package pyarrow, which is not installed.",
            "Everything else works without it; csv holds the same columns.",
            "Install it: pip install 'olivevib[parquet]'",
        ) from error
    return pyarrow, parquet
