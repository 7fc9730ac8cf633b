"""PLY: the samples as points with their markers and times, the paths as edges."""

from __future__ import annotations

from typing import BinaryIO

from olivevib.files.exports.facts import ExportFacts, MarkerPath, marker_paths
from olivevib.files.exports.text import ascii_line, fixed
from olivevib.reconstruction.trajectory import Trajectory


def write_ply(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write ASCII PLY in mm: a vertex a seen sample, an edge between neighbours without a gap."""
    paths = list(marker_paths(trajectory))
    vertices = sum(int(path.seen.sum()) for path in paths)
    edges = sum(beyond - first - 1 for path in paths for first, beyond in path.runs())
    head = [
        "ply",
        "format ascii 1.0",
        f"comment olivevib marker paths, trial {ascii_line(facts.trial, 200)}",
        f"comment unit mm, frame {ascii_line(trajectory.frame, 200)}",
        f"element vertex {vertices}",
        *(f"property double {name}" for name in ("x", "y", "z", "time_s")),
        "property int marker",
        f"element edge {edges}",
        "property int vertex1",
        "property int vertex2",
        "end_header",
    ]
    out.write(("\n".join(head) + "\n").encode("ascii"))
    for path in paths:
        out.write(_vertices(path).encode("ascii"))
    at = 0
    for path in paths:
        for first, beyond in path.runs():
            count = beyond - first
            lines = (f"{k} {k + 1}\n" for k in range(at, at + count - 1))
            out.write("".join(lines).encode("ascii"))
            at += count


def _vertices(path: MarkerPath) -> str:
    seen = path.seen
    columns = [fixed(path.xyz_mm[seen, k], 7) for k in range(3)] + [fixed(path.t_s[seen], 9)]
    marker = f" {path.id}\n"
    return "".join(" ".join(row) + marker for row in zip(*columns, strict=True))
