"""TRC: marker positions a frame, as OpenSim, Mokka and other motion-analysis programs read them."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from olivevib.files.exports.facts import ExportFacts, frame_rate_hz, marker_paths
from olivevib.files.exports.text import fixed
from olivevib.reconstruction.trajectory import Trajectory


def write_trc(trajectory: Trajectory, facts: ExportFacts, out: BinaryIO) -> None:
    """Write TRC in mm with tabs; a marker that was not seen leaves its three cells empty.

    TRC has one time a frame: it is the frame's (t_s); the instants at which the rows of a rolling
    shutter saw each marker are in csv and h5 alone.
    """
    del facts
    paths = list(marker_paths(trajectory))
    rate = f"{frame_rate_hz(trajectory):.6f}"
    frames, markers = trajectory.t_s.size, len(paths)
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
    columns = [[str(k) for k in range(1, frames + 1)], fixed(trajectory.t_s, 9)]
    for path in paths:
        xyz = np.where(path.seen[:, None], path.xyz_mm, np.nan)
        columns += [fixed(xyz[:, k], 6) for k in range(3)]
    lines = ("\t".join(row) + "\n" for row in zip(*columns, strict=True))
    out.write("".join(lines).encode("ascii"))
