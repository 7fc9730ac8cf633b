"""TRC: marker positions a frame, as OpenSim, Mokka and other motion-analysis programs read them."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from olivevib.files.exports.even import even_part
from olivevib.files.exports.facts import ExportFacts, marker_paths
from olivevib.files.exports.text import fixed
from olivevib.reconstruction.trajectory import Trajectory


def write_trc(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write TRC in mm with tabs; a marker that was not seen leaves its three cells empty.

    TRC has one time a row and one rate for all: it gets the even part of the path (``even_part``)
    with its times on the trial clock; the instants at which the rows of a rolling shutter saw each
    marker are in csv and h5 alone. Raises UsageError where the rows have no one rate.
    """
    del facts
    even = even_part(trajectory)
    paths = list(marker_paths(even.trajectory))
    rate = f"{even.rate_hz:.6f}"
    t_s = even.trajectory.t_s
    frames, markers = t_s.size, len(paths)
    names = "".join(f"M{path.id}\t\t\t" for path in paths)
    numbers = "".join(f"X{k}\tY{k}\tZ{k}\t" for k in range(1, markers + 1))
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    head = [
        "PathFileType\t4\t(X/Y/Z)\tolivevib.trc",
        "\t".join([*keys.split(), "OrigNumFrames"]),
        f"{rate}\t{rate}\t{frames}\t{markers}\tmm\t{rate}\t1\t{frames}",
        "Frame#\tTime\t" + names.rstrip("\t"),
        "\t\t" + numbers.rstrip("\t"),
        "",
    ]
    out.write(("\n".join(head) + "\n").encode("ascii"))
    columns = [[str(k) for k in range(1, frames + 1)], fixed(t_s, 9)]
    for path in paths:
        xyz = np.where(path.seen[:, None], path.xyz_mm, np.nan)
        columns += [fixed(xyz[:, k], 6) for k in range(3)]
    lines = ("\t".join(row) + "\n" for row in zip(*columns, strict=True))
    out.write("".join(lines).encode("ascii"))
