"""UFF: universal file with header, units, nodes at rest and one function a marker and axis."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from olivevib.arrays import Floats
from olivevib.files.exports.facts import ExportFacts, MarkerPath, marker_paths
from olivevib.files.exports.text import ascii_line
from olivevib.reconstruction.trajectory import Trajectory

_DISPLACEMENT, _TIME, _TIME_RESPONSE = 8, 17, 1
_REAL_DOUBLE, _UNEVEN = 4, 0


def write_uff(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write datasets 151 (header), 164 (SI), 2411 (nodes at their mean) and 58b (displacement).

    Node = marker id, direction 1, 2, 3 = x, y, z; displacement from the mean in m over the true
    times in s, uneven, both as float64, as pyuff and OpenModal read it. What was not seen is left
    out. Header lines are ASCII of at most 80 characters. Dates are left blank.
    """
    paths = [path for path in marker_paths(trajectory) if path.seen.any()]
    rest_m = {path.id: path.xyz_mm[path.seen].mean(axis=0) / 1000 for path in paths}
    out.write(_header(facts, trajectory) + _units() + _nodes(rest_m))
    for path in paths:
        for axis in range(3):
            out.write(_function(path, axis, float(rest_m[path.id][axis]), facts))


def _block(number: str, lines: list[str]) -> bytes:
    text = [f"{-1:6d}", number, *lines, f"{-1:6d}"]
    return ("\n".join(text) + "\n").encode("ascii")


def _header(facts: ExportFacts, trajectory: Trajectory) -> bytes:
    blank = f"{'NONE':<10}{'NONE':<10}"
    lines = [
        f"{ascii_line(facts.trial or 'NONE', 80):<80}",
        f"{ascii_line('Optical displacement, frame: ' + trajectory.frame, 80):<80}",
        f"{'olivevib':<80}",
        f"{blank}{0:>10}{0:>10}{0:>10}",
        blank,
        f"{'olivevib':<80}",
        blank,
    ]
    return _block(f"{151:6d}{'':74}", lines)


def _units() -> bytes:
    one = "1.0000000000000000D+00"
    lines = [
        f"{1:10d}{'SI: Meter (newton)':<20}{2:10d}",
        f"{one:>25}{one:>25}{one:>25}",
        f"{'2.7314999999999998D+02':>25}",
    ]
    return _block(f"{164:6d}{'':74}", lines)


def _nodes(rest_m: dict[int, Floats]) -> bytes:
    lines = []
    for node, xyz in rest_m.items():
        lines.append(f"{node:10d}{1:10d}{1:10d}{11:10d}")
        lines.append("".join(f"{v:25.16E}".replace("E", "D") for v in xyz.tolist()))
    return _block(f"{2411:6d}{'':74}", lines)


def _function(path: MarkerPath, axis: int, rest_m: float, facts: ExportFacts) -> bytes:
    seen = path.seen
    pairs = np.column_stack([path.t_s[seen], path.xyz_mm[seen, axis] / 1000 - rest_m])
    body = np.ascontiguousarray(pairs, dtype="<f8").tobytes()
    first = f"{58:6d}b{1:6d}{2:6d}{11:12d}{len(body):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    none = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}"
    lines = [
        f"{-1:6d}",
        first,
        f"{f'Displacement of marker {path.id} along {chr(120 + axis)}':<80}",
        f"{ascii_line(facts.trial or 'NONE', 80):<80}",
        *[f"{'NONE':<80}"] * 3,
        f"{_TIME_RESPONSE:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10}{path.id:10d}{axis + 1:4d} "
        f"{'NONE':>10}{0:10d}{0:4d}",
        f"{_REAL_DOUBLE:10d}{len(pairs):10d}{_UNEVEN:10d}{0.0:13.5e}{0.0:13.5e}{0.0:13.5e}",
        f"{_TIME:10d}{0:5d}{0:5d}{0:5d} {'Time':<20} {'s':<20}",
        f"{_DISPLACEMENT:10d}{1:5d}{0:5d}{0:5d} {'Displacement':<20} {'m':<20}",
        none,
        none,
    ]
    return ("\n".join(lines) + "\n").encode("ascii") + body + f"{-1:6d}\n".encode("ascii")
