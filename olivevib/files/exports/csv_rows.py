"""CSV: one row a marker and time, markers by id, for pandas, R and spreadsheets."""

from __future__ import annotations

from typing import BinaryIO

from olivevib.files.exports.facts import ExportFacts, marker_paths
from olivevib.files.exports.text import fixed, spreadsheet_cell
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.signals import State

HEADER = "time_s,marker,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_mm,sigma_z_mm,state"


def write_csv(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write the columns of ``HEADER``; UTF-8, comma, decimal point, LF; an empty cell is NaN.

    Times have 9 decimals, positions 6 (1 nm), sigmas 6.
    """
    del facts  # a bare table: nothing but its header line stands above it
    words = [spreadsheet_cell(state.word) for state in State]
    out.write((HEADER + "\n").encode("ascii"))
    for path in marker_paths(trajectory):
        columns = [fixed(path.t_s, 9), [str(path.id)] * path.t_s.size]
        columns += [fixed(path.xyz_mm[:, k], 6) for k in range(3)]
        columns += [fixed(path.sigma_mm[:, k], 6) for k in range(3)]
        columns.append([words[s] for s in path.state.tolist()])
        lines = (",".join(row) + "\n" for row in zip(*columns, strict=True))
        out.write("".join(lines).encode("utf-8"))
