"""TXT: plain ASCII columns that any CAD program imports as points, one block a marker."""

from __future__ import annotations

from typing import BinaryIO

from olivevib.files.exports.facts import ExportFacts, MarkerPath, marker_paths
from olivevib.files.exports.text import ascii_line, fixed
from olivevib.reconstruction.trajectory import Trajectory


def write_txt(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write blocks of ``x y z t`` columns, blank line between blocks, # before every comment.

    A gap ends a block and starts the next one of the same marker, so that a polyline drawn through
    a block never bridges what was not seen. Source: the paper's ASCII export, section 4.
    """
    head = [
        "# olivevib marker paths",
        f"# trial: {ascii_line(facts.trial)}",
        f"# frame: {ascii_line(trajectory.frame)}; x right, y down, z forward in a camera's frame",
        "# columns: x_mm y_mm z_mm time_s; unit mm and s; decimal point; blanks between columns",
        "# one block a marker and gapless stretch; a blank line ends a block",
    ]
    out.write(("\n".join(head) + "\n").encode("ascii"))
    for path in marker_paths(trajectory):
        for number, (first, beyond) in enumerate(path.runs(), start=1):
            out.write(_block(path, number, first, beyond).encode("ascii"))


def _block(path: MarkerPath, number: int, first: int, beyond: int) -> str:
    columns = [fixed(path.xyz_mm[first:beyond, k], 6) for k in range(3)]
    columns.append(fixed(path.t_s[first:beyond], 9))
    rows = (" ".join(f"{cell:>14}" for cell in row) for row in zip(*columns, strict=True))
    title = f"\n# marker {path.id} stretch {number} samples {beyond - first}\n"
    return title + "\n".join(rows) + "\n"
