"""Two cameras in processes of their own, the recorder, and what became of the pictures."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.files.container import open_container
from olivevib.files.packets import Packets
from olivevib.studies.capture.camera import number_of

SIDES = ("left", "right")
CLI = (sys.executable, "-m", "olivevib")
SERVER = (sys.executable, "-m", "olivevib.studies.capture.camera")
PATIENCE_S = 60.0


class Cameras:
    """Two servers; ``addresses``, ``picture_bytes``; close them."""

    def __init__(self, folder: Path, fps: float = 30.0, *, markers: bool = False) -> None:
        self._logs = [folder / f"{side}.log" for side in SIDES]
        options = ["--fps", str(fps)] + (["--markers"] if markers else [])
        self._processes = [
            subprocess.Popen(
                [*SERVER, *options, "--log", str(log)], stdout=subprocess.PIPE, text=True
            )
            for log in self._logs
        ]
        told = [_first_line(process).split() for process in self._processes]
        self.addresses = (told[0][0], told[1][0])
        self.picture_bytes = int(told[0][1])

    def sent(self) -> list[dict[int, int]]:
        """What each camera has sent: number -> checksum."""
        return [_read_log(log) for log in self._logs]

    def signal_left(self, how: int) -> None:
        """Kill or stop the left camera's process."""
        self._processes[0].send_signal(how)

    def close(self) -> None:
        """End both."""
        for process in self._processes:
            process.kill()
            process.communicate()


def _first_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def _read_log(log: Path) -> dict[int, int]:
    out = {}
    for line in log.read_text(encoding="ascii").split("\n")[:-1]:
        number, crc = line.split()
        out[int(number)] = int(crc)
    return out


def start_recorder(cameras: Cameras, trial: Path, *options: str) -> subprocess.Popen[str]:
    """``olivevib capture`` in a process of its own, once both recordings have begun."""
    left, right = cameras.addresses
    command = [*CLI, "capture", str(trial), "--left", left, "--right", right, *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    began = time.monotonic()
    while not (trial / "right.nut").exists() and process.poll() is None:
        if time.monotonic() - began > PATIENCE_S:
            process.kill()
        time.sleep(0.02)
    return process


def processor_s(pid: int) -> float:
    """Processor time of a process so far, s (Linux; NaN elsewhere)."""
    place = Path(f"/proc/{pid}/stat")
    if not place.exists():
        return float("nan")
    words = place.read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Kept:
    """What one recording holds of what its camera sent.

    frames; lost: between its first and last; altered: other bytes than were sent; stamp_us: largest
    deviation of a stored stamp from the camera's own, after their common start.
    """

    frames: int
    lost: int
    altered: int
    stamp_us: float


def recorded(video: Path) -> tuple[list[tuple[int, int]], list[int]]:
    """Number and checksum of every picture in a recording, and its stamps in µs."""
    container, stream = open_container(video)
    with container:
        found = [(bytes(p), p.pts) for p, _ in Packets(video, container, stream)]
    return [(number_of(d), zlib.crc32(d)) for d, _ in found], [int(s) for _, s in found]


def kept_of(video: Path, sent: dict[int, int], fps: float) -> Kept:
    """Compare a recording with what was sent."""
    frames, stamps_us = recorded(video)
    numbers = [n for n, _ in frames]
    lost = sum(b - a - 1 for a, b in itertools.pairwise(numbers))
    altered = sum(sent.get(n) != crc for n, crc in frames)
    told = np.array([round((5000 + n / fps) * 1e6) for n in numbers])
    error = np.array(stamps_us) - stamps_us[0] - (told - told[0])
    return Kept(len(frames), lost, altered, float(np.abs(error).max()))
