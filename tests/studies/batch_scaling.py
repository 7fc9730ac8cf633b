"""Batch in figures: what it adds to a trial, what a second worker gains, memory, resuming.

    PYTHONPATH=tests python tests/studies/batch_scaling.py [added gained resumed] [--trials 1000]

Makes small trials in a temporary folder (two markers, 400 x 300 px). Needs Linux (/proc).
"""

import argparse
import json
import os
import random
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import batch_trials

from olivevib.batch.unit import NOTE
from olivevib.trial.fingerprints import PRIVATE

BATCH = (sys.executable, "-m", "olivevib", "batch", "-q", "--json")
LONG_FRAMES = 90
ROUNDS = 3
GAINED = 16  # trials, so that starting the workers weighs little


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("parts", nargs="*", default=["added", "gained", "resumed"])
    parser.add_argument("--trials", type=int, default=1000, help="tiny trials to resume")
    parser.add_argument("--kills", type=int, default=3, help="how often the batch is killed")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="olivevib_batch_") as folder:
        place = Path(folder)
        print(f"load of the machine before: {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
        if "added" in arguments.parts:
            added(place)
        if "gained" in arguments.parts:
            gained(place)
        if "resumed" in arguments.parts:
            resumed(place, arguments.trials, arguments.kills)


def added(place: Path) -> None:
    """What batch adds to a trial: its states, its result hash, handing it over."""
    trial = batch_trials.one(place / "one", LONG_FRAMES)
    run(trial, 1)
    many = batch_trials.season(place / "many", trial, 40)
    run(place / "many", 2)  # their reports, which tell their names
    few, _ = run(many[0], 1)
    all_, rows = run(place / "many", 1)
    assert all(row["ran"] == [] for row in rows)
    each = (all_.seconds - few.seconds) / (len(many) - 1)
    print(f"start-up, once: {few.seconds:.2f} s; a trial that is up to date: {each * 1e3:.0f} ms")


def gained(place: Path) -> None:
    """Two workers against one, alternating, so that both see the same machine."""
    trial = batch_trials.one(place / "long", LONG_FRAMES)
    seconds: dict[int, list[float]] = {1: [], 2: []}
    work: dict[int, list[float]] = {1: [], 2: []}
    found = set()
    for _ in range(ROUNDS):
        for workers, times in seconds.items():
            batch_trials.season(place / "gained", trial, GAINED)
            before = cpu_s()
            batch, rows = run(place / "gained", workers)
            work[workers].append(round(cpu_s() - before, 1))
            times.append(round(batch.seconds, 1))
            found |= {row["hash"] for row in rows}
            shutil.rmtree(place / "gained")
    ratios = [round(one / two, 2) for one, two in zip(seconds[1], seconds[2], strict=True)]
    print(f"two workers against one, {GAINED} trials: {statistics.median(ratios):.2f} of {ratios}")
    best = min(seconds[1]) / min(seconds[2])
    print(f"  least disturbed run of each: {best:.2f}")
    print(f"  seconds with one {seconds[1]}, with two {seconds[2]}; {len(found)} result hash")
    idle = 2 * statistics.median(work[1]) / statistics.median(work[2])
    print(f"  processor seconds {work[1]} and {work[2]}: {idle:.2f} where nobody else needs a core")


def resumed(place: Path, count: int, kills: int) -> None:
    """Many trials whose batch is killed at random moments and started again."""
    tiny = batch_trials.one(place / "tiny")
    trials = batch_trials.season(place / "season", tiny, count)
    chance = random.Random(1)
    for k in range(kills):
        batch = Watched(place / "season", 2)
        target = count * (k + chance.random()) / (kills + 1)
        while finished(trials) < target:
            batch.look()
            time.sleep(0.2)
        time.sleep(chance.random())
        batch.process.kill()
        batch.process.wait()
        print(
            f"killed with {finished(trials)} finished and {begun(trials)} begun; {batch.memory()}"
        )
    before = finished(trials)
    batch, rows = run(place / "season", 2)
    idle = sum(row["ran"] == [] for row in rows)
    found = {row["hash"] for row in rows}
    print(f"resumed: {before} were finished, {idle} of them not touched again")
    print(f"  {len(rows)} trials, {len(found)} result hash; {batch.memory()}")


def finished(trials: list[Path]) -> int:
    return sum((trial / PRIVATE / NOTE).exists() for trial in trials)


def begun(trials: list[Path]) -> int:
    return sum((t / PRIVATE).exists() for t in trials) - finished(trials)


class Watched:
    """A batch and the memory of its workers; what it prints goes into a file."""

    def __init__(self, folder: Path, workers: int) -> None:
        self.started = time.monotonic()
        self.printed = tempfile.TemporaryFile("w+")  # noqa: SIM115 (as long as this object)
        self.process = subprocess.Popen(
            [*BATCH, "--workers", str(workers), str(folder)],
            stdout=self.printed,
        )
        self.peaks: dict[int, list[float]] = {}
        self.seconds = 0.0

    def look(self) -> None:
        for worker in children(self.process.pid):
            self.peaks.setdefault(worker, []).append(peak_mb(worker))

    def rows(self) -> list[dict]:
        """Wait for the end; the rows of its JSON."""
        while self.process.poll() is None:
            self.look()
            time.sleep(0.1)
        self.seconds = time.monotonic() - self.started
        self.printed.seek(0)
        return json.load(self.printed)["trials"]

    def memory(self) -> str:
        words = [
            f"{max(p):.0f} MB (after a tenth of its time {p[len(p) // 10]:.0f})"
            for p in self.peaks.values()
            if max(p)
        ]
        return "peak of each worker: " + ", ".join(words)


def run(folder: Path, workers: int) -> tuple[Watched, list[dict]]:
    """A batch from start to end."""
    batch = Watched(folder, workers)
    return batch, batch.rows()


def cpu_s() -> float:
    """Processor time of all processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def children(parent: int) -> list[int]:
    path = Path(f"/proc/{parent}/task/{parent}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


def peak_mb(process: int) -> float:
    try:
        text = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = [line for line in text.splitlines() if line.startswith("VmHWM")]
    return int(found[0].split()[1]) / 1024 if found else 0.0


if __name__ == "__main__":
    main()
