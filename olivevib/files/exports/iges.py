"""IGES 5.3: the paths as linear paths (106, form 12) in mm, one level a marker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

from olivevib.files.exports.facts import ExportFacts, marker_paths
from olivevib.files.exports.text import ascii_line
from olivevib.reconstruction.trajectory import Trajectory

_PATH, _PATH_FORM, _POINT = 106, 12, 116
_DATA_COLUMNS, _PARAMETER_COLUMNS = 72, 64


@dataclass(frozen=True)
class _Entity:
    """One entity: type, form, level, label and the cells of its parameter data."""

    type: int
    form: int
    level: int
    label: str
    cells: list[str]


def write_iges(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write a 106/12 path a gapless stretch (116 for a lone sample), in mm; level = marker id.

    Lines of 80 columns as the format wants. The dates that its header wants are held fixed.
    """
    start = f"olivevib marker paths, trial {facts.trial}, frame {trajectory.frame}, unit mm"
    sections = {"S": _wrapped_text(ascii_line(start)), "G": _global(facts)}
    directory: list[str] = []
    parameters: list[str] = []
    for entity in _entities(trajectory):
        pointer = len(directory) + 1
        lines = [*_wrapped_cells(entity.cells, _PARAMETER_COLUMNS)]
        directory += _directory(entity, len(parameters) + 1, len(lines))
        parameters += [f"{line:<64}{pointer:8d}" for line in lines]
    sections |= {"D": directory, "P": parameters}
    counts = "".join(f"{letter}{len(lines):7d}" for letter, lines in sections.items())
    sections["T"] = [counts]
    for letter, lines in sections.items():
        numbered = (f"{line:<72}{letter}{k:7d}\n" for k, line in enumerate(lines, start=1))
        out.write("".join(numbered).encode("ascii"))


def _entities(trajectory: Trajectory) -> Iterator[_Entity]:
    for path in marker_paths(trajectory):
        level, label = max(0, path.id), f"M{path.id}"[:8]
        for first, beyond in path.runs():
            numbers = [f"{v:.7f}" for v in path.xyz_mm[first:beyond].ravel().tolist()]
            if beyond - first == 1:
                yield _Entity(_POINT, 0, level, label, [str(_POINT), *numbers, "0"])
            else:
                cells = [str(_PATH), "2", str(beyond - first), *numbers]  # 2: triples
                yield _Entity(_PATH, _PATH_FORM, level, label, cells)


def _directory(entity: _Entity, parameter: int, lines: int) -> list[str]:
    """The two lines of a directory entry: eight columns a field."""
    first = (entity.type, parameter, 0, 0, entity.level, 0, 0, 0)
    second = (entity.type, 0, 0, lines, entity.form)
    return [
        "".join(f"{field:8d}" for field in first) + "00000000",
        "".join(f"{field:8d}" for field in second) + f"{'':16}{entity.label:>8}{0:8d}",
    ]


def _global(facts: ExportFacts) -> list[str]:
    name = _hollerith(ascii_line(facts.trial or "olivevib", 60))
    own, date = _hollerith("olivevib"), _hollerith("19700101.000000")
    cells = [_hollerith(","), _hollerith(";"), name, name, own, own]
    cells += ["32", "38", "6", "308", "15", name, "1.0", "2", _hollerith("MM"), "1", "0.01"]
    cells += [date, "1.0E-6", "100000.0", own, own, "11", "0", date]
    return [*_wrapped_cells(cells, _DATA_COLUMNS)]


def _hollerith(text: str) -> str:
    return f"{len(text)}H{text}"


def _wrapped_cells(cells: list[str], width: int) -> Iterator[str]:
    """Cells with commas between and a semicolon after, in lines that no cell straddles."""
    line = ""
    for k, cell in enumerate(cells):
        text = cell + (";" if k + 1 == len(cells) else ",")
        if len(line) + len(text) > width:
            yield line
            line = ""
        line += text
    yield line


def _wrapped_text(text: str) -> list[str]:
    return [text[k : k + _DATA_COLUMNS] for k in range(0, len(text), _DATA_COLUMNS)]
