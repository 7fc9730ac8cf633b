"""The command line run as a person runs it: wall time, processor time, memory of its workers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

OLIVEVIB = (sys.executable, "-m", "olivevib")


@dataclass(frozen=True)
class Timing:
    """How long a command took: wall and processor seconds, all its processes together."""

    wall_s: float
    cpu_s: float


def timed(*arguments: object) -> Timing:
    """Run a verb to its end, its modules compiled as an install keeps them.

    RuntimeError with what it said where it failed.
    """
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    before, started = _spent(), time.monotonic()
    command = [*OLIVEVIB, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=kept)
    wall = time.monotonic() - started
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{' '.join(command[2:])} failed: {done.stderr[-800:]}")
    return Timing(wall, _spent() - before)


def _spent() -> float:
    """Processor seconds of all processes that were started here and have ended."""
    try:
        import resource
    except ImportError:  # not on Windows
        return float("nan")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@dataclass
class Batch:
    """A batch as a process of its own, with the memory of its workers (Linux) as it goes on.

    others_cores: how many cores the other programs of the machine used meanwhile.
    """

    folder: Path
    workers: int
    peaks_mb: dict[int, list[float]] = field(default_factory=dict)
    wall_s: float = 0.0
    others_cores: float = 0.0

    def __post_init__(self) -> None:
        self.busy = busy_core_s()
        self.printed = tempfile.TemporaryFile("w+")  # noqa: SIM115 (as long as this object)
        self.started, self.before = time.monotonic(), _spent()
        verb = ("batch", "-q", "--json", "--workers", str(self.workers), str(self.folder))
        self.process = subprocess.Popen([*OLIVEVIB, *verb], stdout=self.printed)

    def look(self) -> None:
        """Note the largest memory of each worker so far."""
        for worker in _children(self.process.pid):
            self.peaks_mb.setdefault(worker, []).append(_peak_mb(worker))

    def rows(self) -> list[dict[str, Any]]:
        """Wait for the end; the rows of its JSON."""
        while self.process.poll() is None:
            self.look()
            time.sleep(0.1)
        self.wall_s = time.monotonic() - self.started
        self.others_cores = (busy_core_s() - self.busy - self.cpu_s) / self.wall_s
        self.printed.seek(0)
        rows: list[dict[str, Any]] = json.load(self.printed)["trials"]
        return rows

    @property
    def cpu_s(self) -> float:
        """Processor seconds since it was started; only where nothing else was started since."""
        return _spent() - self.before

    def kill(self) -> None:
        """End it without warning (kill -9)."""
        self.process.kill()
        self.process.wait()

    @property
    def largest_mb(self) -> float:
        """The largest memory of any worker; NaN where the system does not tell."""
        return max((max(p) for p in self.peaks_mb.values() if p), default=float("nan"))

    @property
    def growth_mb(self) -> float:
        """By how much a worker's peak rose after the first third of its looks."""
        grown = [max(p) - p[len(p) // 3] for p in self.peaks_mb.values() if len(p) > 9]
        return max(grown, default=float("nan"))


def busy_core_s() -> float:
    """Core seconds that all programs together have used since the start; NaN where not told."""
    path = Path("/proc/stat")
    if not path.exists():
        return float("nan")
    told = [int(word) for word in path.read_text().split("\n", 1)[0].split()[1:9]]
    return (sum(told) - told[3] - told[4]) / os.sysconf("SC_CLK_TCK")  # but idle and waiting


def _children(parent: int) -> Sequence[int]:
    path = Path(f"/proc/{parent}/task/{parent}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


def _peak_mb(process: int) -> float:
    try:
        text = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = [line for line in text.splitlines() if line.startswith("VmHWM")]
    return int(found[0].split()[1]) / 1024 if found else 0.0
