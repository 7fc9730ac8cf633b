"""What the checksums find: flipped bytes, a million sound frames; and a disk that fills."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.files.capture import CameraFacts, Controls, Recording, Shot
from olivevib.files.capture.verify import Verified, verify
from olivevib.files.container import open_container
from olivevib.files.packets import Packets
from olivevib.pipeline.capture import CapturePlan, capture
from olivevib.progress import Tick
from olivevib.studies.capture.camera import MjpegServer, Plan, jpeg, numbered
from olivevib.studies.study import Effort

FACTS = CameraFacts("study", "study", "", "http", "mjpeg", "", (128, 96), 30.0, "header")
FLIPPED = 40
TMPFS = "40m"
STEP = 5000


@dataclass(frozen=True)
class Flips:
    """Frames that were altered by flipped bytes, how many of them were named, and false alarms."""

    times: int
    altered: int
    named: int
    false_alarms: int


def flips(effort: Effort, times: int) -> Flips:
    """Flip 40 bytes of a recording, again and again."""
    rng = effort.draws(8, 2)
    named = altered = false = 0
    with tempfile.TemporaryDirectory() as name:
        video = Path(name) / "left.nut"
        record(video, 300, [jpeg((640, 360), seed=k) for k in range(5)])
        data = np.frombuffer(video.read_bytes(), np.uint8)
        places = _payloads(video)
        for _ in range(times):
            at = rng.choice(data.size, FLIPPED, replace=False)
            broken = data.copy()
            broken[at] ^= rng.integers(1, 256, FLIPPED, dtype=np.uint8)
            video.write_bytes(broken.tobytes())
            truly = {k for k, (a, b) in enumerate(places) if ((at >= a) & (at < b)).any()}
            between = any(not any(a <= x < b for a, b in places) for x in at)
            told = _told(video)
            suspects = set(told.suspects) | ({told.in_flight} - {None})
            altered += len(truly)
            named += len(truly & suspects)
            false += 0 if between else len(suspects - truly)
    return Flips(times, altered, named, false)


def sound_frames(count: int, tick: Tick) -> tuple[int, bool]:
    """Record so many sound frames: how many the check counts, and whether it finds them whole."""
    with tempfile.TemporaryDirectory() as name:
        video = Path(name) / "left.nut"
        record(video, count, [jpeg((16, 16), seed=1, quality=30)], tick)
        told = _told(video)
    return told.frames, told.whole


def record(video: Path, frames: int, pictures: Sequence[bytes], tick: Tick | None = None) -> None:
    """A recording of numbered pictures, 100 a second."""
    recording = Recording(video, FACTS, 0)
    for k in range(frames):
        if tick is not None and k % STEP == 0:
            tick(k, frames, "frames without a fault")
        data = numbered(pictures[k % len(pictures)], k)
        recording.append(Shot(data, k * 10_000_000, k * 10_000_000), k * 10_000_000, Controls())
    recording.close()


def _told(video: Path) -> Verified:
    """What the check says of a recording of our own."""
    told = verify(video)
    assert told is not None
    return told


def _payloads(video: Path) -> list[tuple[int, int]]:
    """First and last byte of every picture in a recording."""
    container, stream = open_container(video)
    with container:
        out, data = [], video.read_bytes()
        for packet, _ in Packets(video, container, stream):
            at = data.index(bytes(packet), max(0, packet.pos or 0))
            out.append((at, at + packet.size))
        return out


@dataclass(frozen=True)
class Full:
    """What happened on a small full disk: the message, and whether both recordings are whole."""

    said: str
    usable: bool


def full_disk() -> Full | None:
    """Record until a disk of 40 MB is full; None where this machine lets nobody mount one."""
    with tempfile.TemporaryDirectory() as name:
        module = "olivevib.studies.capture.damage"
        inner = (
            f"mount -t tmpfs -o size={TMPFS} tmpfs {name} && {sys.executable} -m {module} {name}"
        )
        try:
            done = subprocess.run(
                ["unshare", "-rm", "sh", "-c", inner], capture_output=True, text=True, check=True
            )
        except (OSError, subprocess.CalledProcessError):
            return None
    told = json.loads(done.stdout.splitlines()[-1])
    return Full(str(told["said"]), bool(told["usable"]))


def _fill(folder: Path) -> None:
    pictures = [jpeg((1280, 720), seed=k, quality=80) for k in range(4)]
    told = Plan(fps=60, pictures=pictures)
    with MjpegServer(told) as left, MjpegServer(told) as right:
        plan = CapturePlan(
            left.address, right.address, seconds=60, preview=False, reserve_bytes=10_000_000
        )
        captured = capture(folder / "T", plan)
    whole = [_told(folder / "T" / f"{side}.nut").whole for side in ("left", "right")]
    said = captured.error.what if captured.error else ""
    print(json.dumps({"said": said, "usable": all(whole)}))  # noqa: T201 (read by full_disk)


if __name__ == "__main__":
    _fill(Path(sys.argv[1]))
