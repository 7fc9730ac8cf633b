"""What a recording loses: in a long run, when its recorder is killed, when a camera goes away."""

from __future__ import annotations

import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from olivevib.files.capture import read_sidecar, sidecar_of
from olivevib.files.packets import scan_video
from olivevib.files.video import Video
from olivevib.pipeline.capture import CapturePlan, CaptureState, capture
from olivevib.studies.capture.recorder import (
    CLI,
    SIDES,
    Cameras,
    Kept,
    kept_of,
    processor_s,
    recorded,
    start_recorder,
)
from olivevib.studies.study import Effort


@dataclass(frozen=True)
class Run:
    """One recording of two cameras: rate, seconds, with preview or not, share of a core."""

    fps: float
    seconds: float
    preview: bool
    core_share: float
    kept: tuple[Kept, ...]


def long_run(fps: float, seconds: float, *, preview: bool) -> Run:
    """Record for so long and compare every picture with what was sent."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cameras = Cameras(folder, fps, markers=preview)
        try:
            options = ["--seconds", str(seconds)] + ([] if preview else ["--no-preview"])
            process = start_recorder(cameras, folder / "T", *options)
            began, busy = time.monotonic(), processor_s(process.pid)
            time.sleep(max(1.0, seconds - 2))
            share = (processor_s(process.pid) - busy) / (time.monotonic() - began)
            process.communicate()
            kept = tuple(
                kept_of(folder / "T" / f"{side}.nut", was, fps)
                for side, was in zip(SIDES, cameras.sent(), strict=True)
            )
        finally:
            cameras.close()
    return Run(fps, seconds, preview, share, kept)


@dataclass(frozen=True)
class Kills:
    """Frames lost a camera by kill -9 of the recorder, torn ones at the end, files not usable."""

    times: int
    worst_lost: int
    torn: int
    unusable: int


def kills(effort: Effort, times: int) -> Kills:
    """Kill the recorder at random moments; each recording must open in the next ``new``."""
    rng = effort.draws(8, 1)
    worst = torn = unusable = 0
    for _ in range(times):
        with tempfile.TemporaryDirectory() as name:
            lost, broken, failed = _one_kill(Path(name), float(rng.uniform(0.3, 2.0)))
            worst, torn, unusable = max(worst, lost), torn + broken, unusable + failed
    return Kills(times, worst, torn, unusable)


def _one_kill(folder: Path, wait_s: float) -> tuple[int, int, int]:
    cameras = Cameras(folder)
    try:
        process = start_recorder(cameras, folder / "T", "--no-preview")
        time.sleep(wait_s)
        before = [max(was) for was in cameras.sent()]
        process.send_signal(signal.SIGKILL)
        process.communicate()
    finally:
        cameras.close()
    worst = torn = failed = 0
    for side, last in zip(SIDES, before, strict=True):
        video = folder / "T" / f"{side}.nut"
        with Video.open(video) as opened:
            sound = [f.index for f in opened.frames() if f.grey is not None]
        whole = [n for n, _ in recorded(video)[0]][: len(sound)]
        worst = max(worst, last - whole[-1])
        torn += scan_video(video).frames - len(sound)
        stamps = read_sidecar(sidecar_of(video))
        failed += stamps is None or len(stamps.lines) < len(sound)
    new = [*CLI, "new", str(folder / "N")]
    for side in SIDES:
        new += [f"--{side}", str(folder / "T" / f"{side}.nut")]
        new += [f"--{side}-stamps", str(folder / "T" / f"{side}.stamps.csv")]
    failed += subprocess.run(new, capture_output=True, check=False).returncode != 0
    return worst, torn, failed


@dataclass(frozen=True)
class Vanished:
    """How soon the file of a camera that went away was closed, s, and what the other one lost."""

    closed_s: float
    other_lost: int


def vanish(how: int) -> Vanished:
    """Kill or stop the left camera's process while both are recorded."""
    seen: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cameras = Cameras(folder)

        def watch(state: CaptureState) -> None:
            if state.elapsed_s > 1 and "end" not in seen:
                seen["end"] = time.monotonic()
                cameras.signal_left(how)
            if state.cameras["left"].gone and "closed" not in seen:
                seen["closed"] = time.monotonic()

        try:
            plan = CapturePlan(*cameras.addresses, seconds=4, preview=False)
            capture(folder / "T", plan, watch)
        finally:
            cameras.close()
        numbers = [n for n, _ in recorded(folder / "T" / "right.nut")[0]]
    lost = numbers[-1] - numbers[0] + 1 - len(numbers)
    return Vanished(seen.get("closed", float("inf")) - seen["end"], lost)
