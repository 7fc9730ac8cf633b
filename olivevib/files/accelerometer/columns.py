"""Which columns of a table are the acceleration axes, which is the time, and why not the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.errors import InputError, UsageError
from olivevib.files.accelerometer.metadata import header_unit
from olivevib.files.accelerometer.names import Meaning, meaning
from olivevib.files.accelerometer.record import (
    AXES,
    Channel,
    ImportOptions,
    NoAccelerationError,
    Table,
)
from olivevib.files.accelerometer.units import ACCELERATION, TIME

LINEAR = "linear acceleration"


@dataclass(frozen=True)
class Choice:
    """The columns in use: axes (column, axis letter), times (columns), refused (name, reason)."""

    axes: tuple[tuple[int, str], ...]
    times: tuple[int, ...]
    meanings: tuple[Meaning, ...]
    refused: tuple[tuple[str, str], ...]
    by_order: bool  # the axes got x, y, z by their order, not by a letter in their names
    linear: bool  # gravity was removed by the device


def choose_columns(table: Table, options: ImportOptions, source: str) -> Choice:
    """Pick times and axes by name and unit; InputError names every column and why not it.

    Several complete sets of axes (two sensors in one file) are never mixed: columns must be named.
    """
    named = [meaning(c.name, c.unit) for c in table.channels]
    meanings = tuple(_in_company(m, named) for m in named)
    times = _times(table, meanings, options, source)
    if options.columns:
        picked = [_find(name, table, source) for name in options.columns]
        letters = [meanings[k].axis for k in picked]
        by_name = len(set(letters)) == len(letters) and all(letters)
        axes = tuple(zip(picked, letters if by_name else AXES, strict=False))
        by_order = not by_name
    else:
        axes, by_order = _axes(table, meanings, times, source)
    used = {k for k, _ in axes} | set(times)
    refused = tuple(
        (m.name, _reason(m)) for k, m in enumerate(meanings) if k not in used and m.name
    )
    linear = any(meanings[k].quantity == LINEAR for k, _ in axes)
    return Choice(axes, times, meanings, refused, by_order, linear)


def _in_company(m: Meaning, others: list[Meaning]) -> Meaning:
    """``gx`` is a gyroscope where ``ax`` stands beside it; alone it stays an unnamed axis."""
    beside = any(o.axis == m.axis and o.quantity == ACCELERATION for o in others)
    if m.axis and beside and m.quantity == "unknown" and m.group.rstrip("0123456789") == "g":
        return Meaning(m.name, "gyroscope", m.axis, m.unit, m.unit_text, m.group, False)
    return m


def _find(name: str, table: Table, source: str) -> int:
    """The column called ``name``, or the ``name``-th from 1."""
    names = [c.name.strip() for c in table.channels]
    if name.strip() in names:
        return names.index(name.strip())
    if name.strip().isdecimal() and 1 <= int(name) <= len(names):
        return int(name) - 1
    raise UsageError(
        f"{source}: there is no column {name}.",
        "The columns are " + ", ".join(f"{k} {n}" for k, n in enumerate(names, 1)) + ".",
        "Name one of these, or give its number.",
    )


def _times(
    table: Table, meanings: tuple[Meaning, ...], options: ImportOptions, source: str
) -> tuple[int, ...]:
    """The column of the times, or date and time of day; none where the format has its own."""
    if options.time_column is not None:
        return (_find(options.time_column, table, source),)
    if table.stamps_s is not None or table.rate_hz is not None:
        return ()
    found = [k for k, m in enumerate(meanings) if m.quantity == TIME]
    with_unit = [k for k in found if meanings[k].unit is not None]
    numeric = [k for k in found if table.channels[k].text is None]
    if with_unit or numeric:
        return ((with_unit or numeric)[0],)
    dated = [k for k in found if _holds_date(table.channels[k])]
    clock = [k for k in found if k not in dated]
    if dated and clock and not _holds_clock(table.channels[dated[0]]):
        return (dated[0], clock[0])
    return tuple((dated or clock)[:1]) or _first_column(table, meanings)


def _holds_date(channel: Channel) -> bool:
    first = str(channel.text[0]) if channel.text is not None and channel.text.size else ""
    return first.count("-") >= 2 or first.count("/") >= 2 or first.count(".") >= 2


def _holds_clock(channel: Channel) -> bool:
    return channel.text is not None and channel.text.size > 0 and ":" in str(channel.text[0])


def _first_column(table: Table, meanings: tuple[Meaning, ...]) -> tuple[int, ...]:
    """A nameless first column that only grows, with one to three others beside it, is a time."""
    if any(m.name for m in meanings) or not 2 <= len(meanings) <= 4:
        return ()
    first = table.channels[0]
    if first.text is not None:
        return (0,)
    steps = np.diff(first.values[np.isfinite(first.values)])
    return (0,) if steps.size > 1 and (steps >= 0).all() and steps.any() else ()


def _axes(
    table: Table, meanings: tuple[Meaning, ...], times: tuple[int, ...], source: str
) -> tuple[tuple[tuple[int, str], ...], bool]:
    """The one set of axes: named acceleration before linear acceleration before bare letters."""
    free = [k for k in range(len(meanings)) if k not in times and table.channels[k].text is None]
    free = [k for k in free if _holds_numbers(table.channels[k])]
    _refuse_unreadable(table, meanings, times, source)
    for wanted in ({ACCELERATION}, {LINEAR}, {"unknown"}):
        fit = [k for k in free if meanings[k].quantity in wanted]
        lettered = [k for k in fit if meanings[k].axis]
        sets = _sets(lettered, meanings)
        if sets:
            return _only_set(sets, meanings, source), False
        if fit and wanted != {"unknown"}:
            return _in_order(fit, meanings, source), True
    nameless = [k for k in free if not meanings[k].name]
    if header_unit(table) is not None:  # the header block says that the channels accelerate
        nameless = [k for k in free if meanings[k].quantity == "unknown" and not meanings[k].unit]
    if 1 <= len(nameless) <= 3 and (len(nameless) == len(free) or header_unit(table)):
        return _in_order(nameless, meanings, source), True
    raise NoAccelerationError(
        f"{source} holds no acceleration.",
        "Its columns: " + "; ".join(f"{m.name or k} – {_reason(m)}" for k, m in _all(meanings)),
        "Choose the accelerometer's file; if a column is an acceleration after all, name the "
        "columns of x, y, z (columns) and their unit (unit).",
    )


def _holds_numbers(channel: Channel) -> bool:
    return bool(np.isfinite(channel.values[:100]).any() or np.isfinite(channel.values).any())


def _refuse_unreadable(
    table: Table, meanings: tuple[Meaning, ...], times: tuple[int, ...], source: str
) -> None:
    """An axis whose cells are words must not silently be left out."""
    for k, m in enumerate(meanings):
        text = table.channels[k].text
        if text is not None and k not in times and m.axis and m.quantity == ACCELERATION:
            shown = next((str(c) for c in text if str(c).strip() not in ("", "nan")), None)
            if shown is not None:
                raise InputError(
                    f"{source}: the column {m.name} cannot be read as numbers.",
                    f"One of its cells is {shown[:40]!r}.",
                    "Check the decimal mark, or name the columns of x, y, z (columns).",
                )


def _all(meanings: tuple[Meaning, ...]) -> list[tuple[str, Meaning]]:
    shown = [(f"column {k}", m) for k, m in enumerate(meanings[:20], start=1)]
    return [(k, m) for k, m in shown]


def _sets(found: list[int], meanings: tuple[Meaning, ...]) -> list[dict[str, int]]:
    """Columns grouped by the name without its axis; the fullest groups alone."""
    groups: dict[str, dict[str, int]] = {}
    for k in found:
        group = meanings[k].group
        while meanings[k].axis in groups.setdefault(group, {}):
            group += " again"
        groups[group][meanings[k].axis] = k
    most = max((len(g) for g in groups.values()), default=0)
    return [g for g in groups.values() if len(g) == most]


def _only_set(
    sets: list[dict[str, int]], meanings: tuple[Meaning, ...], source: str
) -> tuple[tuple[int, str], ...]:
    if len(sets) > 1 and not _separate_axes(sets):
        listed = "; ".join(", ".join(meanings[k].name for k in g.values()) for g in sets)
        raise InputError(
            f"{source} holds several accelerometers.",
            f"Sets of axes: {listed}.",
            "Name the columns of the one that you mean (columns).",
        )
    merged = {axis: k for group in sets for axis, k in group.items()}
    return tuple((merged[axis], axis) for axis in AXES if axis in merged)


def _separate_axes(sets: list[dict[str, int]]) -> bool:
    """True where each set holds one axis and no two the same: one sensor, oddly named."""
    letters = [axis for group in sets for axis in group]
    return len(letters) == len(set(letters)) and len(letters) <= 3


def _in_order(
    found: list[int], meanings: tuple[Meaning, ...], source: str
) -> tuple[tuple[int, str], ...]:
    if len(found) > 3:
        raise InputError(
            f"{source} holds {len(found)} acceleration columns without axis letters.",
            "They are " + ", ".join(meanings[k].name or f"column {k + 1}" for k in found) + ".",
            "Name the columns of x, y, z (columns).",
        )
    return tuple(zip(found, AXES, strict=False))


def _reason(m: Meaning) -> str:
    """Why a column is not an axis of acceleration, in words."""
    unit = f" in {m.unit_text}" if m.unit_text else ""
    if m.quantity == "unknown":
        return f"not known as an acceleration{unit}"
    if m.quantity == "unknown unit":
        return f"the unit {m.unit_text} is not known"
    if m.quantity == ACCELERATION:
        return f"an acceleration{unit}, but not of the chosen set of axes"
    if m.quantity == "magnitude":
        return f"a magnitude{unit}, no axis"
    if m.quantity == LINEAR:
        return "linear acceleration: gravity was removed by the device"
    if m.quantity == "gravity":
        return "the gravity that the device computed"
    return f"{m.quantity}{unit}, no acceleration"
