"""Many cheap trials: one small trial copied; and a look at the worker processes of a batch."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import small_trial

from olivevib.files.lock import FILE as LOCK
from olivevib.trial.fingerprints import PRIVATE

ROOT = Path(__file__).resolve().parents[1]

HEARS_CTRL_C = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from olivevib.cli import main
sys.exit(main(sys.argv[1:]))
"""


def one(folder: Path, frames: int = 12) -> Path:
    """A small trial that holds all it needs, its rig too."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    videos = folder.parent / f".{folder.name}_videos"
    videos.mkdir()
    small_trial.make(folder, small_trial.record(videos, frames))
    shutil.rmtree(videos)
    outside = folder.parent / f"{folder.name}_rig.toml"
    shutil.move(outside, folder / "shared_rig.toml")
    return folder


def season(folder: Path, trial: Path, count: int) -> list[Path]:
    """Copies of a trial, T00, T01, …, in a folder."""
    trials = [folder / f"T{k:02d}" for k in range(count)]
    for copy in trials:
        shutil.copytree(trial, copy)
    return trials


def start(*arguments: object, verb: str = "batch", **environment: str) -> subprocess.Popen:
    """A verb of olivevib as a process of its own, which Ctrl-C reaches wherever the tests run."""
    return subprocess.Popen(
        [sys.executable, "-c", HEARS_CTRL_C, verb, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=os.environ | environment,
    )


def holder(trial: Path) -> int | None:
    """The process that is at work on a trial, by what its lock says."""
    try:
        words = (trial / PRIVATE / LOCK).read_text().split()
    except OSError:
        return None
    return int(words[1]) if words and alive(int(words[1])) else None


def alive(process: int) -> bool:
    """Whether a process still runs (a zombie does not)."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def wait_for(what, seconds: float = 60.0):
    """What ``what()`` gives once it gives something."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if found := what():
            return found
        time.sleep(0.02)
    raise TimeoutError(f"waited {seconds} s in vain")


def kill(process: int) -> None:
    """End a process without warning."""
    os.kill(process, signal.SIGKILL)


def hashes(text: str) -> dict[str, str]:
    """Trial -> hash of what batch printed."""
    return dict(line.split() for line in text.splitlines())
