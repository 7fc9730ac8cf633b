"""A marker library as a readable TOML text: drawn codes that a person can edit, and its faults."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np

from olivevib.arrays import Bools
from olivevib.errors import InputError
from olivevib.marker.distances import check_library
from olivevib.marker.layout import MarkerLayout, MarkerLibrary

DARK, WHITE = "#", "."
KEYS = ("name", "distance", "mirrors", "layout", "codes")
LAYOUT_KEYS = ("modules", "code", "bar", "quiet")
LARGEST_ID = 999_999
HEAD = """\
# A library of coded markers for olivevib: '#' is a dark module, '.' a white one.
# To add a code, copy a block below, give it a number that is not taken, and draw.
# `olivevib markers check` then says whether it is far enough from all the others.
"""


def library_text(library: MarkerLibrary, made: str = "") -> str:
    """The library as TOML; ``made`` says in one line how it came about. Same codes, same bytes."""
    lines = [HEAD + (f"# {made}\n" if made else "")]
    lines.append(f"name = {json.dumps(library.name)}")
    lines.append(f"distance = {library.distance}  # modules in which any two codes differ at least")
    yes = "true" if library.mirrors else "false"
    lines.append(f"mirrors = {yes}  # whether that holds for mirror images too")
    layout = library.layout
    lines += ["", "[layout]  # in modules"]
    lines += [f"{key} = {getattr(layout, key)}" for key in LAYOUT_KEYS]
    lines += ["", "[codes]"]
    for number, code in zip(library.ids, library.codes, strict=True):
        rows = ["".join(DARK if dark else WHITE for dark in row) for row in code]
        lines.append(f"{number} = '''\n" + "\n".join(rows) + "'''\n")
    return "\n".join(lines)


def parse_library(text: str, source: str) -> MarkerLibrary:
    """A library from TOML text; ``source`` names the file in errors.

    Raises InputError that lists every fault at once: key, code, row, and codes too close.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _faulty(source, [f"it is not TOML: {error}"]) from None
    faults = list(_unknown_keys(table))
    layout = _layout(table.get("layout", {}), faults)
    promised = _whole(table, "distance", faults)
    mirrors = table.get("mirrors", False)
    if not isinstance(mirrors, bool):
        faults.append(f"mirrors must be true or false, not {mirrors!r}")
    name = table.get("name", source)
    if not isinstance(name, str):
        faults.append(f"name must be a text, not {name!r}")
    ids, codes = _codes(table.get("codes"), layout, faults)
    if not codes:
        raise _faulty(source, faults)
    promise = 1 if promised is None else promised
    library = MarkerLibrary(
        str(name), np.array(ids), np.stack(codes), layout, promise, mirrors=mirrors is True
    )
    faults += [
        f"{pair}; distance = {promised} is promised" for pair in check_library(library).too_close
    ]
    if faults:
        raise _faulty(source, faults)
    return library


def _faulty(source: str, faults: list[str]) -> InputError:
    head = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
    return InputError(
        f"The marker library {source} cannot be used ({head})",
        "\n".join(f"  - {fault}" for fault in faults),
        "Correct the file; `olivevib markers check --library FILE` lists what is left.",
    )


def _unknown_keys(table: dict[str, Any]) -> Iterator[str]:
    layout = table.get("layout")
    inner = layout if isinstance(layout, dict) else {}
    for keys, known, where in ((table, KEYS, ""), (inner, LAYOUT_KEYS, "layout.")):
        for key in keys:
            if key not in known:
                near = difflib.get_close_matches(key, known, 1)
                hint = f"; did you mean {where}{near[0]}?" if near else ""
                yield f"{where}{key} is no key of a marker library{hint}"


def _whole(table: dict[str, Any], key: str, faults: list[str]) -> int | None:
    value = table.get(key)
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    said = f"{key} is missing" if value is None else f"{key} = {value!r} is no whole number >= 1"
    faults.append(said)
    return None


def _layout(table: Any, faults: list[str]) -> MarkerLayout:
    """The layout; the paper's for every key that is left out."""
    if not isinstance(table, dict):
        faults.append("layout must be a table with modules, code, bar, quiet")
        return MarkerLayout()
    values = {key: _whole(table, f"{key}", faults) for key in LAYOUT_KEYS if key in table}
    try:
        return MarkerLayout(**{key: value for key, value in values.items() if value is not None})
    except ValueError as error:
        faults.append(f"layout: {error}")
        return MarkerLayout()


def _codes(table: Any, layout: MarkerLayout, faults: list[str]) -> tuple[list[int], list[Bools]]:
    """Ids and codes that can be read; the rest is told in ``faults``."""
    ids: list[int] = []
    codes: list[Bools] = []
    if not isinstance(table, dict) or not table:
        faults.append("codes is missing: a table with one drawn code per number")
        return ids, codes
    for key, drawing in table.items():
        before = len(faults)
        number = int(key) if key.isascii() and key.isdigit() else -1
        if not 0 <= number <= LARGEST_ID or number in ids:
            faults.append(f"codes.{key}: the id must be a whole number that occurs once")
        faults += [f"codes.{key}: {fault}" for fault in _drawing_faults(drawing, layout.code)]
        if len(faults) == before:
            ids.append(number)
            codes.append(np.array([[c == DARK for c in row] for row in drawing.split()]))
    return ids, codes


def _drawing_faults(drawing: Any, side: int) -> Iterator[str]:
    if not isinstance(drawing, str):
        yield f"must be drawn as text between ''' and ''', not {type(drawing).__name__}"
        return
    rows = drawing.split()
    if len(rows) != side:
        yield f"has {len(rows)} rows, wants {side}"
    for at, row in enumerate(rows, start=1):
        if len(row) != side:
            yield f"row {at} ({row}) has {len(row)} modules, wants {side}"
        odd = sorted(set(row) - {DARK, WHITE})
        if odd:
            yield f"row {at} ({row}) holds {' '.join(odd)}; only {DARK} and {WHITE} are known"
