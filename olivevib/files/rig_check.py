"""What may stand in rig.toml, and every fault of a file at once."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

LENS_TERMS = ("k1", "k2", "p1", "p2", "k3")  # OpenCV's order
ROW_TIME_SOURCES = ("global", "unknown", "declared", "led", "board", "trial")
_SIZES = {"left": 6, "right": 6, "rig": 18}  # of the covariances
_TABLES = {
    "left": ("size_px", "fx", "fy", "cx", "cy"),  # what each must hold
    "right": ("size_px", "fx", "fy", "cx", "cy"),
    "stereo": ("t_right_left_mm",),
}
_CAMERA = (
    *("size_px", "fx", "fy", "cx", "cy", "skew", *LENS_TERMS),
    *("row_time_us", "row_time_sigma_us", "row_time_source"),
)
_STEREO = (*("R_right_left", "t_right_left_mm", "rotation_vector_deg", "baseline_mm", "angle_deg"),)
_ALLOWED: dict[str, tuple[str, ...]] = {
    "left": _CAMERA,
    "right": _CAMERA,
    "stereo": _STEREO,
    "projection": ("left", "right"),
    "covariance": tuple(_SIZES),
}
_TOP = ("format", *_ALLOWED, "quality")


@dataclass
class Faults:
    """Collects what is wrong, each with its key."""

    found: list[str] = field(default_factory=list)

    def add(self, key: str, text: str) -> None:
        """Note one fault."""
        self.found.append(f"{key}: {text}")

    def unknown(self, key: str, name: str, allowed: tuple[str, ...]) -> None:
        """Note an unknown key, with the one that was probably meant."""
        near = difflib.get_close_matches(name, allowed, n=1)
        meant = f"did you mean {near[0]}?" if near else f"known are: {', '.join(allowed)}."
        self.add(key, f"unknown; {meant}")


def check_rig(table: Mapping[str, Any], faults: Faults) -> None:
    """Check a parsed rig.toml; every fault goes to ``faults``."""
    for name in table:
        if name not in _TOP:
            faults.unknown(name, name, _TOP)
    version = table.get("format", 1)
    if version != 1:
        faults.add("format", f"{version} is not known here; a newer olivevib wrote this file.")
    for name in _TOP[1:]:
        if name in table and not isinstance(table[name], Mapping):
            faults.add(name, f"must be a table, [{name}].")
        elif name in _ALLOWED and (name in table or name in _TABLES):
            _check_keys(name, table.get(name), _ALLOWED[name], faults)
    tables = {name: value for name, value in table.items() if isinstance(value, Mapping)}
    for side in ("left", "right"):
        _check_camera(side, tables.get(side, {}), faults)
    if "stereo" in tables:
        _check_stereo(tables["stereo"], faults)
    for name, rows in tables.get("covariance", {}).items():
        if name in _SIZES:
            _check_covariance(f"covariance.{name}", rows, _SIZES[name], faults)


def _check_keys(
    name: str, table: Mapping[str, Any] | None, allowed: tuple[str, ...], faults: Faults
) -> None:
    if table is None:
        faults.add(name, f"the table [{name}] is missing.")
        return
    for key in table:
        if key not in allowed:
            faults.unknown(f"{name}.{key}", key, allowed)
    for key in _TABLES.get(name, ()):
        if key not in table:
            faults.add(f"{name}.{key}", "is missing.")


def _check_camera(side: str, table: Mapping[str, Any], faults: Faults) -> None:
    size = table.get("size_px", [1, 1])
    whole = isinstance(size, list) and len(size) == 2 and all(type(n) is int for n in size)
    if not whole or min(size) < 1:
        faults.add(f"{side}.size_px", "must be [width, height], whole numbers of pixels.")
    numbers = ("cx", "cy", "skew", *LENS_TERMS, "row_time_us")
    for key in (*numbers, "fx", "fy", "row_time_sigma_us"):
        if key not in table:
            continue
        if not _is_number(table[key]):
            faults.add(f"{side}.{key}", f"must be a number, is {_shown(table[key])}.")
        elif key in ("fx", "fy") and table[key] <= 0:
            faults.add(f"{side}.{key}", f"must be positive, is {table[key]}.")
        elif key == "row_time_sigma_us" and table[key] < 0:
            faults.add(f"{side}.{key}", f"must not be negative, is {table[key]}.")
    source = table.get("row_time_source", "unknown")
    if source not in ROW_TIME_SOURCES:
        faults.add(f"{side}.row_time_source", f"must be one of {', '.join(ROW_TIME_SOURCES)}.")


def _check_stereo(table: Mapping[str, Any], faults: Faults) -> None:
    for key, shape in (("t_right_left_mm", (3,)), ("rotation_vector_deg", (3,))):
        if key in table:
            _check_array(f"stereo.{key}", table[key], shape, faults)
    if "R_right_left" in table:
        _check_array("stereo.R_right_left", table["R_right_left"], (3, 3), faults)
    elif "rotation_vector_deg" not in table:
        faults.add("stereo.R_right_left", "is missing (or give rotation_vector_deg).")


def _check_array(key: str, value: Any, shape: tuple[int, ...], faults: Faults) -> None:
    rows = value if len(shape) == 2 else [value]
    width = shape[-1]
    fits = isinstance(rows, list) and (len(shape) == 1 or len(rows) == shape[0])
    fits = fits and all(isinstance(row, list) and len(row) == width for row in rows)
    if not fits or not all(_is_number(v) for row in rows for v in row):
        wanted = f"{shape[0]} rows of {width} numbers" if len(shape) == 2 else f"{width} numbers"
        faults.add(key, f"must be {wanted}.")


def _check_covariance(key: str, value: Any, size: int, faults: Faults) -> None:
    rows = value if isinstance(value, list) else []
    fits = len(rows) == size and all(isinstance(row, list) for row in rows)
    lengths = [len(row) for row in rows] if fits else []
    shape = lengths in ([size] * size, list(range(size, 0, -1)))
    if not shape or not all(_is_number(v) for row in rows for v in row):
        faults.add(key, f"must be {size} rows of numbers, whole or from the diagonal on.")
    elif any(row[0 if len(row) < size else k] < 0 for k, row in enumerate(rows)):
        faults.add(key, "has a negative variance on its diagonal.")


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        return False
    number = Decimal(value)
    return number.is_finite() and abs(number) < Decimal("1e300")


def _shown(value: Any) -> str:
    return repr(value)[:40]
