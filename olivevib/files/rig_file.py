"""rig.toml: the calibrated pair, for people to read and for every number to come back bit by bit.

Lengths in mm, pixels with centres at whole numbers, row times in microseconds.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import InputError
from olivevib.files.atomic import write_text_atomic
from olivevib.files.rig_check import LENS_TERMS, ROW_TIME_SOURCES, Faults, check_rig
from olivevib.geometry import (
    LENS,
    CameraModel,
    StereoRig,
    nearest_rotation,
    rotation_from_vector,
    vector_from_rotation,
)

FORMAT = 1
MAX_BYTES = 1_000_000
Fact = str | float | int | None

_HEAD = """\
# A calibrated camera pair, written by olivevib. Lengths in mm, image points in pixels (pixel
# centres at whole numbers, x right, y down); camera frame x right, y down, z forward.
# Only [left], [right] and [stereo] are needed; lines marked "derived" are not read back.
"""


def write_rig(path: str | Path, rig: StereoRig, facts: Mapping[str, Fact]) -> None:
    """Write rig.toml whole and at once; ``read_rig`` gives the same rig back bit by bit.

    facts: quality figures for the reader, by name; None: not known. Raises InputError where the
    file cannot be written, ValueError for a camera matrix that is not of pin-hole form.
    """
    parts = [
        f"{_HEAD}format = {FORMAT}\n",
        _camera("left", rig.left, _sigmas(rig, 0)),
        _camera("right", rig.right, _sigmas(rig, 6)),
        _stereo(rig),
        _projection(rig),
        _covariance(rig),
        _quality(facts),
    ]
    write_text_atomic(path, "\n".join(part for part in parts if part))


def read_rig(path: str | Path) -> StereoRig:
    """Read rig.toml, ours or written by hand with only [left], [right] and [stereo].

    Raises InputError naming the file and all its faults at once, each with its key (for an
    unknown key the one that was probably meant), or the line where it is no TOML.
    """
    file = Path(path)
    table = _parse(file)
    faults = Faults()
    check_rig(table, faults)
    if faults.found:
        raise _faulty(file, faults.found)
    try:
        return _rig(table)
    except ValueError as error:
        raise _faulty(file, [str(error)]) from error


def read_facts(path: str | Path) -> dict[str, Fact]:
    """The quality figures of a rig.toml, by name; empty where it has none; raises InputError."""
    facts = _parse(Path(path)).get("quality", {})
    numbers = {k: float(v) if isinstance(v, Decimal) else v for k, v in facts.items()}
    return {k: v for k, v in numbers.items() if isinstance(v, str | int | float)}


# --- writing ------------------------------------------------------------------------------


def _camera(name: str, camera: CameraModel, sigma: Floats | None) -> str:
    K = camera.K
    form = np.array([[K[0, 0], K[0, 1], K[0, 2]], [0, K[1, 1], K[1, 2]], [0, 0, 1]])
    if not np.array_equal(K, form):
        raise ValueError(f"K of the {name} camera is not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
    lines = [f"[{name}]", f"size_px = [{camera.size_px[0]}, {camera.size_px[1]}]  # width, height"]
    values = dict(zip(("fx", "fy", "cx", "cy"), (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), strict=True))
    values |= dict(zip(LENS_TERMS, camera.distortion, strict=True))
    spread = {} if sigma is None else dict(zip(LENS, sigma, strict=True))
    for key, value in values.items():
        unit = "px" if key in ("fx", "fy", "cx", "cy") else "OpenCV's distortion"
        known = f", sigma {spread[key]:.2g}" if key in spread else ""
        lines.append(f"{key} = {_number(value)}  # {unit}{known}")
    if K[0, 1] or np.signbit(K[0, 1]):
        lines.append(f"skew = {_number(K[0, 1])}  # px")
    return "\n".join([*lines, *_row_time(camera), ""])


def _row_time(camera: CameraModel) -> list[str]:
    if not math.isfinite(camera.row_time_s) or camera.row_time_source not in ROW_TIME_SOURCES:
        raise ValueError(f"row time {camera.row_time_s} s from {camera.row_time_source!r}")
    lines = [
        f"row_time_us = {_micro(camera.row_time_s)}"
        "  # signed, a raw sensor row; 0: global shutter or unknown",
    ]
    if not math.isnan(camera.row_time_sigma_s):
        lines.append(f"row_time_sigma_us = {_micro(camera.row_time_sigma_s)}")
    lines.append(f"row_time_source = {_text(camera.row_time_source)}")
    return lines


def _stereo(rig: StereoRig) -> str:
    vector = np.degrees(vector_from_rotation(rig.R_right_left))
    return "\n".join(
        [
            "[stereo]  # X_right = R_right_left X_left + t_right_left_mm",
            f"R_right_left = {_matrix(rig.R_right_left)}",
            f"t_right_left_mm = {_list(rig.t_right_left_mm)}",
            f"rotation_vector_deg = {_rounded(vector)}  # derived",
            f"baseline_mm = {rig.baseline_mm:.3f}  # derived",
            f"angle_deg = {rig.angle_deg:.3f}  # derived: between the optical axes",
            "",
        ]
    )


def _projection(rig: StereoRig) -> str:
    left, right = rig.projection_matrices()
    return "\n".join(
        [
            "[projection]  # derived: K [R | t], for undistorted pixels, left camera's frame",
            f"left = {_matrix(left)}",
            f"right = {_matrix(right)}",
            "",
        ]
    )


def _covariance(rig: StereoRig) -> str:
    """The covariances as rows from the diagonal on; whole rows where they are not symmetric."""
    known = {"left": rig.left.covariance, "right": rig.right.covariance, "rig": rig.covariance}
    lines = [f"{name} = {_triangle(cov)}" for name, cov in known.items() if cov is not None]
    if not lines:
        return ""
    note = [
        "[covariance]  # rows from the diagonal on; px, mm, rad",
        "# of each camera: fx fy cx cy k1 k2; of the rig: left's, right's, then the rotation",
        "# vector rx ry rz (rad) and tx ty tz (mm) of [stereo]",
    ]
    return "\n".join([*note, *lines, ""])


def _quality(facts: Mapping[str, Fact]) -> str:
    if not facts:
        return ""
    lines = ["[quality]  # how good the calibration is; not read back"]
    for key, value in facts.items():
        name = key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else ""
        name = name or _text(key)
        if value is None:
            lines.append(f"# {name}: not known")
        elif isinstance(value, str):
            lines.append(f"{name} = {_text(value)}")
        elif isinstance(value, bool | int):
            lines.append(f"{name} = {str(value).lower()}")
        else:
            lines.append(f"{name} = {_number(value)}")
    return "\n".join([*lines, ""])


def _sigmas(rig: StereoRig, at: int) -> Floats | None:
    """Standard deviations (6,) of one camera's LENS parameters, from the rig's if it has them."""
    own = rig.left.covariance if at == 0 else rig.right.covariance
    cov = own if rig.covariance is None else rig.covariance[at : at + 6, at : at + 6]
    return None if cov is None else np.sqrt(np.maximum(np.diag(cov), 0))


def _number(value: float) -> str:
    """The shortest decimal that gives the same float again, as TOML writes floats."""
    text = repr(float(value))
    return text if any(c in text for c in ".einf") else text + ".0"


def _micro(seconds: float) -> str:
    """Seconds as microseconds, in decimals that divide back to exactly the same float."""
    return f"{Decimal(repr(float(seconds))).scaleb(6):f}" if seconds else repr(float(seconds))


def _list(values: Floats) -> str:
    return "[" + ", ".join(_number(v) for v in values) + "]"


def _rounded(values: Floats) -> str:
    return "[" + ", ".join(f"{v:.5f}" for v in values) + "]"


def _matrix(values: Floats) -> str:
    return "[\n" + "".join(f"    {_list(row)},\n" for row in values) + "]"


def _triangle(cov: Floats) -> str:
    symmetric = np.array_equal(cov, cov.T)
    rows = [row[k:] if symmetric else row for k, row in enumerate(cov)]
    return "[\n" + "".join(f"    {_list(row)},\n" for row in rows) + "]"


def _text(value: str) -> str:
    """A TOML basic string."""
    escapes = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"}
    safe = value.encode("utf-8", "replace").decode("utf-8")
    out = [escapes.get(c, c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}") for c in safe]
    return '"' + "".join(out) + '"'


# --- reading ------------------------------------------------------------------------------


def _parse(file: Path) -> dict[str, Any]:
    try:
        if file.stat().st_size > MAX_BYTES:
            raise InputError(f"{file} is too large for a rig file.", "", "Give the right file.")
        return tomllib.loads(file.read_text("utf-8"), parse_float=Decimal)
    except FileNotFoundError as error:
        raise InputError(
            f"The rig file {file} does not exist.", "", "Calibrate, or give the right name."
        ) from error
    except OSError as error:
        raise InputError(f"{file} cannot be read.", error.strerror or str(error), "") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(
            f"{file} is no TOML: {error or 'too deeply nested'}.",
            "",
            "Correct that line, or calibrate again.",
        ) from error


def _faulty(file: Path, faults: list[str]) -> InputError:
    count = "a fault" if len(faults) == 1 else f"{len(faults)} faults"
    return InputError(
        f"{file} has {count}:",
        "\n".join(f"  {fault}" for fault in faults),
        "Correct them in the file, or calibrate again.",
    )


def _rig(table: Mapping[str, Any]) -> StereoRig:
    stereo, covariance = table["stereo"], table.get("covariance", {})
    return StereoRig(
        left=_model(table["left"], covariance.get("left")),
        right=_model(table["right"], covariance.get("right")),
        R_right_left=_rotation(stereo),
        t_right_left_mm=_array(stereo["t_right_left_mm"]),
        covariance=_square(covariance.get("rig")),
    )


def _rotation(stereo: Mapping[str, Any]) -> Floats:
    """The rotation as given; one written with few digits is moved to the nearest rotation."""
    if "R_right_left" not in stereo:
        return rotation_from_vector(np.radians(_array(stereo["rotation_vector_deg"])))
    R = _array(stereo["R_right_left"])
    off = max(float(np.abs(R @ R.T - np.eye(3)).max()), abs(float(np.linalg.det(R)) - 1))
    return nearest_rotation(R) if 1e-6 < off < 1e-2 else R


def _model(table: Mapping[str, Any], covariance: Any) -> CameraModel:
    fx, fy, cx, cy = (float(table[key]) for key in ("fx", "fy", "cx", "cy"))
    return CameraModel(
        size_px=(int(table["size_px"][0]), int(table["size_px"][1])),
        K=np.array([[fx, float(table.get("skew", 0)), cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
        distortion=np.array([float(table.get(key, 0)) for key in LENS_TERMS]),
        row_time_s=_seconds(table.get("row_time_us", 0)),
        row_time_sigma_s=_seconds(table.get("row_time_sigma_us", "nan")),
        row_time_source=table.get("row_time_source", "unknown"),
        covariance=_square(covariance),
    )


def _seconds(microseconds: Any) -> float:
    return float(Decimal(microseconds).scaleb(-6))


def _array(values: Any) -> Floats:
    return np.array(values, dtype=object).astype(np.float64)


def _square(rows: Any) -> Floats | None:
    """A covariance from its rows, whole or from the diagonal on."""
    if rows is None:
        return None
    n = len(rows)
    out = np.zeros((n, n))
    for k, row in enumerate(rows):
        out[k, n - len(row) :] = [float(v) for v in row]
        if len(rows[-1]) < n:
            out[k:, k] = out[k, k:]
    return out
