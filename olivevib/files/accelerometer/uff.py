"""Universal files: datasets 58 (ASCII) and 58b (binary) that hold time histories."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution, InputError
from olivevib.files.accelerometer.names import meaning
from olivevib.files.accelerometer.record import Channel, NoAccelerationError, Table
from olivevib.files.accelerometer.units import ACCELERATION

_FUNCTIONS = {
    2: "auto spectrum",
    3: "cross spectrum",
    4: "frequency response function",
    5: "transmissibility",
    6: "coherence",
    7: "auto correlation",
    8: "cross correlation",
    9: "power spectral density",
    10: "energy spectral density",
    12: "spectrum",
    24: "shock response spectrum",
    27: "order function",
}
_ORDINATES = {3: "strain", 5: "temperature", 8: "displacement", 9: "force", 11: "velocity"}
_ORDINATES |= {12: ACCELERATION, 13: "force", 15: "pressure"}
_LENGTHS = {1: "m", 2: "ft", 3: "m", 4: "ft", 5: "mm", 6: "cm", 7: "in", 8: "mm"}
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_REAL, _TIME_FUNCTIONS, _TIME_ABSCISSA, _SI_SET = (2, 4), (0, 1), (0, 1, 17), 164
_FLOAT = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?|[Nn][Aa][Nn]")


@dataclass(frozen=True)
class _Set:
    """One dataset 58: what it is, and its abscissa (even: start and step) and ordinate.

    refusal: why it is no acceleration over time, or ""; its values are then not read.
    """

    name: str
    unit: str
    start: datetime | None
    x0_s: float
    step_s: float
    refusal: str
    x: Floats | None = None
    y: Floats = field(default_factory=lambda: np.empty(0))


def is_uff(head: bytes) -> bool:
    """True where the first line that is not blank is the universal file's -1."""
    lines = [line.strip() for line in head[:2000].splitlines() if line.strip()]
    return len(lines) > 1 and lines[0] == b"-1" and lines[1][:4].strip(b"b ").isdigit()


def read_uff(data: bytes, source: str) -> Table:
    """Read the time histories of a universal file; spectra and FRF are refused by their name."""
    sets: list[_Set] = []
    refused: list[str] = []
    length_unit = ""
    for kind, block, body_at in _blocks(data):
        if kind == str(_SI_SET):
            length_unit = _length_unit(block)
        elif kind in ("58", "58b"):
            found = _read_set(block, body_at, length_unit, source, binary=kind == "58b")
            if found.refusal:
                refused.append(found.refusal)
            else:
                sets.append(found)
    if not sets:
        what = ", ".join(dict.fromkeys(refused)) or "no dataset 58"
        raise NoAccelerationError(
            f"{source} holds no acceleration over time.",
            f"The universal file holds: {what}.",
            "Export the time signal of the accelerometer (dataset 58, time response).",
        )
    return _table(sets, source)


def _blocks(data: bytes) -> Iterator[tuple[str, bytes, int]]:
    """(type, bytes from the type line on, offset of the data within them) of each dataset."""
    at = 0
    while (mark := re.compile(rb"(?m)^ *-1[ \t]*\r?$\n?").search(data, at)) is not None:
        begin = mark.end()
        kind_line, _, _ = data[begin : begin + 200].partition(b"\n")
        kind = kind_line[:7].decode("latin-1").strip().casefold()
        ends = _line_ends(data, begin, 12)
        if kind == "58b" and len(ends) == 12:
            stop = ends[-1] + _binary_size(data, begin, ends)
        else:
            close = re.compile(rb"(?m)^ *-1[ \t]*\r?$").search(data, begin)
            stop = close.start() if close else len(data)
        yield kind, data[begin:stop], (ends[-1] - begin if len(ends) == 12 else stop - begin)
        close = re.compile(rb" *-1[^\n]*\n?").search(data, stop)
        at = close.end() if close and close.start() - stop < 10 else max(stop, begin + 1)


def _line_ends(data: bytes, begin: int, count: int) -> list[int]:
    ends: list[int] = []
    at = begin
    while len(ends) < count and (end := data.find(b"\n", at)) >= 0:
        ends.append(end + 1)
        at = end + 1
    return ends


def _binary_size(data: bytes, begin: int, ends: list[int]) -> int:
    """The bytes of a 58b's values: the size after which the closing -1 stands."""
    form = data[ends[6] : ends[7]].decode("latin-1")
    kind, count, even = (_int(form[k : k + 10]) for k in (0, 10, 20))
    size = 8 if kind in (4, 6) else 4
    width = 2 if kind in (5, 6) else 1
    declared = _int(data[begin:].split(b"\n", 1)[0].decode("latin-1")[31:43])
    sizes = [count * size * width] if even else []
    sizes += [count * (4 + size * width), count * size * (1 + width), declared]
    for guess in sizes:
        if 0 < guess <= len(data) and data[ends[-1] + guess :][:8].lstrip(b"\r\n")[:6] == b"    -1":
            return guess
    return min(max(sizes[0], 0), len(data))


def _read_set(block: bytes, body_at: int, length_unit: str, source: str, *, binary: bool) -> _Set:
    head = _decoded(block[:body_at]).splitlines()
    if len(head) < 12:
        raise _damaged(source, "The header of a dataset 58 is cut off.")
    kind, count, even = (_int(head[7][k : k + 10]) for k in (0, 10, 20))
    direction = _int(head[6][51:55])
    title = _label(head[1])
    name, unit = _described(head[9], title, direction, length_unit)
    if (node := _int(head[6][41:51])) > 0:
        name = f"node {node} {name}"
    found = _Set(
        name=name,
        unit=unit,
        start=_date(head[3]),
        x0_s=_float(head[7][30:43]),
        step_s=_float(head[7][43:56]),
        refusal=_refusal(head, kind, name, unit),
    )
    if found.refusal:
        return found
    if count < 1:
        raise _damaged(source, f"A dataset 58 declares {count} values.")
    body = block[body_at:]
    values = _binary(block, body, kind, count, even) if binary else _ascii(body, kind, even)
    x, y = _abscissa(values, count, even, source)
    return replace(found, x=x, y=-y if direction < 0 else y)


def _described(ordinate: str, title: str, direction: int, length_unit: str) -> tuple[str, str]:
    """Name (with quantity and axis) and unit of a set; a minus direction turns its sign apart."""
    quantity = _ORDINATES.get(_int(ordinate[:10]), "")
    name, unit = _label(ordinate[26:46]) or title, _label(ordinate[47:67])
    said = meaning(name, unit)
    if quantity and said.quantity in ("unknown", "unknown unit", "index"):
        name = f"{quantity} {name}".strip()
    if 1 <= abs(direction) <= 3 and not said.axis:
        name = f"{name} {'xyz'[abs(direction) - 1]}".strip()
    if not unit and quantity == ACCELERATION and length_unit:
        unit = f"{length_unit}/s2"
    return name, unit


def _refusal(head: list[str], kind: int, name: str, unit: str) -> str:
    """Why a set is no acceleration over time, in words; "" where it may be one."""
    function, abscissa = _int(head[6][:5]), _int(head[8][:10])
    if function not in _TIME_FUNCTIONS or abscissa not in _TIME_ABSCISSA:
        return _FUNCTIONS.get(function, f"function type {function} over abscissa type {abscissa}")
    if kind not in _REAL:
        return f"values of type {kind}, not real numbers"
    said = meaning(name, unit).quantity
    if said in ("unknown", "unknown unit", "index", ACCELERATION, "time"):
        return ""
    return f"{name}: {said}" + (f" in {unit}" if unit else "")


def _ascii(body: bytes, kind: int, even: int) -> Floats:
    """The numbers of the body; by fixed columns where they are glued together."""
    text = body.decode("latin-1").replace("D", "E").replace("d", "e")
    lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    widths = [13] * 6 if kind == 2 else ([20] * 4 if even else [13, 20, 13, 20])
    try:
        return np.array(" ".join(lines).split(), dtype=np.float64)
    except ValueError:
        cells: list[float] = []
        for line in lines:
            cells.extend(_fixed(line, widths))
        return np.array(cells)


def _fixed(line: str, widths: list[int]) -> list[float]:
    if len(_FLOAT.findall(line)) == len(line.split()):
        return [_float(c) for c in line.split()]
    found, at = [], 0
    for width in widths:
        if line[at : at + width].strip():
            found.append(_float(line[at : at + width]))
        at += width
    return found


def _binary(block: bytes, body: bytes, kind: int, count: int, even: int) -> Floats:
    """Values of a 58b; an uneven abscissa is float32 by the standard, float64 by some writers."""
    first = block.split(b"\n", 1)[0].decode("latin-1")
    order = ">" if _int(first[7:13]) == 2 else "<"
    real = np.dtype(f"{order}f{8 if kind == 4 else 4}")
    if not even and kind == 4 and len(body) < 16 * count:
        pair = np.dtype([("x", f"{order}f4"), ("y", real)])
        pairs = np.frombuffer(body[: len(body) // 12 * 12], dtype=pair)
        return np.column_stack([pairs["x"], pairs["y"]]).astype(np.float64).ravel()
    whole = len(body) // real.itemsize * real.itemsize
    return np.frombuffer(body[:whole], dtype=real).astype(np.float64)


def _abscissa(values: Floats, count: int, even: int, source: str) -> tuple[Floats | None, Floats]:
    wanted = count if even else 2 * count
    if values.size < wanted:
        why = f"{values.size} of {wanted} numbers are there."
        raise _damaged(source, f"A dataset 58 is cut off: {why}")
    values = values[:wanted]
    return (None, values) if even else (values[0::2].copy(), values[1::2].copy())


def _table(sets: list[_Set], source: str) -> Table:
    """The sets that share the times of the first acceleration."""
    named = [s for s in sets if meaning(s.name, s.unit).quantity == ACCELERATION]
    leader = (named or sets)[0]
    mates = [s for s in sets if _same_times(s, leader)]
    cautions: tuple[Caution, ...] = ()
    if len(mates) < len(sets):
        text = f"{len(sets) - len(mates)} datasets of {source} have other times and were left out."
        cautions = (Caution("sensor-sets-left-out", text, "Export them as a file of their own."),)
    even = leader.x is None
    if even and not (leader.step_s > 0 and abs(leader.x0_s) < 1e10):
        why = f"Its abscissa begins at {leader.x0_s:g} with steps of {leader.step_s:g}."
        raise _damaged(source, why)
    return Table(
        "UFF58",
        tuple(Channel(s.name, s.unit, s.y) for s in mates),
        stamps_s=leader.x,
        rate_hz=1 / leader.step_s if even else None,
        t0_s=leader.x0_s if even else 0.0,
        start=leader.start,
        layout=f"universal file, {len(sets)} datasets 58",
        cautions=cautions,
    )


def _same_times(a: _Set, b: _Set) -> bool:
    if a.y.size != b.y.size or (a.x is None) != (b.x is None):
        return False
    if a.x is not None and b.x is not None:
        return bool(np.array_equal(a.x, b.x))
    return (a.x0_s, a.step_s) == (b.x0_s, b.step_s)


def _length_unit(block: bytes) -> str:
    lines = block.decode("latin-1").splitlines()
    return _LENGTHS.get(_int(lines[1][:10]), "") if len(lines) > 1 else ""


def _label(text: str) -> str:
    text = text.strip()
    return "" if text.upper() == "NONE" else text


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _int(text: str) -> int:
    text = text.strip()
    return int(text) if re.fullmatch(r"[+-]?\d{1,15}", text) else 0


def _float(text: str) -> float:
    text = text.strip().replace("D", "E").replace("d", "e")
    return float(text) if _FLOAT.fullmatch(text) else float("nan")


def _date(text: str) -> datetime | None:
    """``30-Apr-20 19:12:52`` of ID line 3."""
    m = re.match(r"\s*(\d{1,2})-([A-Za-z]{3})-(\d{2}|\d{4})\s+(\d{1,2}):(\d{2}):(\d{2})", text)
    if not m or m[2].casefold() not in _MONTHS:
        return None
    year = int(m[3]) if len(m[3]) == 4 else 1900 + int(m[3]) + (100 if int(m[3]) < 70 else 0)
    month = _MONTHS.index(m[2].casefold()) + 1
    try:
        return datetime(year, month, int(m[1]), int(m[4]), int(m[5]), int(m[6]))
    except ValueError:
        return None


def _damaged(source: str, why: str) -> InputError:
    return InputError(
        f"{source} cannot be read as a universal file.", why, "Export it again, or as CSV."
    )
