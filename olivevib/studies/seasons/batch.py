"""Batch in figures: what it adds to a trial, what a second worker gains, memory, resuming.

Needs Linux for the memory of the workers (/proc); everything else runs anywhere.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from olivevib.batch.unit import NOTE
from olivevib.progress import Tick
from olivevib.studies.seasons.processes import OLIVEVIB, Batch
from olivevib.studies.seasons.trials import small_trial
from olivevib.studies.study import Effort, Goal, Study, Table
from olivevib.trial.fingerprints import PRIVATE

TRIALS = 1000
KILLS = 3
ROUNDS = 3
GAINED = 16  # trials, so that starting the workers weighs little
LONG_FRAMES = 90
OF_A_TRIAL_S = 60.0  # that the overhead is a share of
CLUSTERED = 6
TINY_FRAMES = 4
_QUIET_CORES = 0.1  # of other programs, up to which scaling can be judged


def run(effort: Effort, tick: Tick) -> Study:
    """All of it: overhead, two workers, kill -9 and resume, one hash wherever it was measured."""
    goals: list[Goal] = []
    with tempfile.TemporaryDirectory(prefix="olivevib_batch_") as name:
        place = Path(name)
        small_trial(place / "tiny", TINY_FRAMES, tick)
        small_trial(place / "long", LONG_FRAMES, tick)
        goals += added(place, effort, tick)
        goals += resumed(place, effort, tick)
        table, more = gained(place, effort, tick)
        goals += more
        goals.append(everywhere(place, tick))
    facts = (("load before", f"{os.getloadavg()[0]:.1f}, {os.cpu_count()} cores"),)
    return Study("batch", "Batch: overhead, memory, resuming, scaling", (table,), (),
                 tuple(goals), facts)  # fmt: skip


def season(folder: Path, trial: Path, count: int) -> list[Path]:
    """Copies of a trial, T0000, T0001, …, in a folder."""
    trials = [folder / f"T{k:04d}" for k in range(count)]
    for copy in trials:
        shutil.copytree(trial, copy)
    return trials


def done(folder: Path, workers: int) -> tuple[Batch, list[dict[str, Any]]]:
    """A batch from start to end."""
    batch = Batch(folder, workers)
    return batch, batch.rows()


def added(place: Path, effort: Effort, tick: Tick) -> list[Goal]:
    """What batch adds to a trial: its states, its result hash, handing it over."""
    tick(0, 4, "what batch adds to a trial")
    count = effort.count(40, 4)
    many = season(place / "many", place / "tiny", count)
    done(place / "many", 2)
    few, _ = done(many[0], 1)
    everything, rows = done(place / "many", 1)
    idle = all(row["ran"] == [] for row in rows)
    each = max(0.0, (everything.wall_s - few.wall_s) / (count - 1))
    share = 100 * each / OF_A_TRIAL_S
    words = f"{1e3 * each:.0f} ms a trial = {share:.2f} %; start-up once {few.wall_s:.1f} s"
    return [Goal("overhead of a 60 s trial", "< 1 %", words, share < 1 and idle)]


def resumed(place: Path, effort: Effort, tick: Tick) -> list[Goal]:
    """Many trials whose batch is killed at set places and started again."""
    count = effort.count(TRIALS, 6)
    trials = season(place / "season", place / "tiny", count)
    again, largest, growth = [], [], []
    for k in range(1, KILLS + 1):
        batch = Batch(place / "season", 2)
        while finished(trials) < count * k / (KILLS + 1) and batch.process.poll() is None:
            batch.look()
            tick(finished(trials), count, "until it is killed")
            time.sleep(0.05)
        batch.kill()
        time.sleep(1.0)  # its workers end themselves
        again.append(begun(trials) - finished(trials))
        largest.append(batch.largest_mb)
        growth.append(batch.growth_mb)
    before = finished(trials)
    batch, rows = done(place / "season", 2)
    idle = sum(row["ran"] == [] for row in rows)
    hashes = {row["hash"] for row in rows}
    failed = sum(row["state"] == "failed" for row in rows)
    repeated = max(again)
    kept = idle == before and not failed and len(rows) == count
    words = f"{repeated} begun and not finished at a kill (2 workers); {before} of {count} kept"
    memory = max(*largest, batch.largest_mb)
    rise = batch.growth_mb
    return [
        Goal(f"{count} trials resumed after {KILLS} x kill -9", "<= 1 repeated a worker", words,
             kept and repeated <= 2),
        Goal("results of all of them", "one hash", f"{len(hashes)} hash, {failed} failed",
             len(hashes) == 1 and not failed),
        Goal("memory of a worker", "< 500 MB", f"{memory:.0f} MB", memory < 500),
        Goal("memory after the first third", "flat", f"{rise:+.0f} MB", rise < 0.05 * memory),
    ]  # fmt: skip


def finished(trials: list[Path]) -> int:
    """How many have their note: results, report and hash."""
    return sum((trial / PRIVATE / NOTE).exists() for trial in trials)


def begun(trials: list[Path]) -> int:
    """How many a worker has touched."""
    return sum((trial / PRIVATE).exists() for trial in trials)


def gained(place: Path, effort: Effort, tick: Tick) -> tuple[Table, list[Goal]]:
    """Two workers against one, alternating, so that both see the same machine."""
    rounds, count = effort.count(ROUNDS), effort.count(GAINED, 2)
    wall: dict[int, list[float]] = {1: [], 2: []}
    cpu: dict[int, list[float]] = {1: [], 2: []}
    others: dict[int, list[float]] = {1: [], 2: []}
    for k in range(rounds):
        for workers in (1, 2):
            tick(2 * k + workers - 1, 2 * rounds, f"{count} trials, {workers} workers")
            season(place / "gained", place / "long", count)
            batch, _ = done(place / "gained", workers)
            wall[workers].append(batch.wall_s)
            cpu[workers].append(batch.cpu_s)
            others[workers].append(batch.others_cores)
            shutil.rmtree(place / "gained")
    rows = tuple((n, *row) for n in (1, 2) for row in zip(wall[n], cpu[n], others[n], strict=True))
    ratio = statistics.median(wall[1]) / statistics.median(wall[2])
    best = min(wall[1]) / min(wall[2])
    idle = 2 * statistics.median(cpu[1]) / statistics.median(cpu[2])
    disturbed = max(map(statistics.median, others.values()))
    words = f"{ratio:.2f} (least disturbed {best:.2f}; by processor time {idle:.2f})"
    words += f"; other programs used {disturbed:.1f} cores"
    reached: bool | None = max(ratio, best) >= 1.8
    if not reached and disturbed > _QUIET_CORES:
        reached = None  # two workers could not have two cores
    goal = Goal("two workers against one", ">= 1.8", words, reached)
    columns = ("workers", "wall, s", "processor, s", "others, cores")
    table = Table(f"{count} trials", columns, rows)
    return table, [goal]


def everywhere(place: Path, tick: Tick) -> Goal:
    """One worker, two workers, a Dask cluster with a worker killed: the same hashes."""
    what, asked = "hashes of 1 worker, 2 workers, Dask with a worker killed", "equal"
    found = {}
    for workers in (1, 2):
        season(place / f"equal{workers}", place / "tiny", CLUSTERED)
        found[workers] = _hashes(done(place / f"equal{workers}", workers)[1])
    try:
        import distributed  # noqa: F401
    except ImportError:
        same = found[1] == found[2]
        return Goal(what, asked, f"workers {'equal' if same else 'DIFFER'}; no distributed", None)
    tick(0, 1, "a Dask cluster of which a worker is killed")
    season(place / "equal3", place / "tiny", CLUSTERED)
    found[3] = _hashes(_on_cluster(place / "equal3"))
    equal = found[1] == found[2] == found[3]
    return Goal(what, asked, "equal" if equal else "they DIFFER", equal)


def _hashes(rows: list[dict[str, Any]]) -> dict[str, str]:
    return {row["trial"]: row["hash"] for row in rows}


def _on_cluster(folder: Path) -> list[dict[str, Any]]:
    """Measure on a scheduler with two workers, one of which is killed under way."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    python = (sys.executable, "-m")
    host, port = address.split(":")
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = [*python, "distributed.cli.dask_scheduler", "--host", host, "--port", port]
    worker = [*python, "distributed.cli.dask_worker", f"tcp://{address}", "--nthreads", "1",
              "--no-dashboard", "--no-nanny"]  # fmt: skip
    running = [subprocess.Popen([*scheduler, "--no-dashboard"], **quiet)]
    try:
        running += [subprocess.Popen(worker, **quiet) for _ in range(2)]
        verb = [*OLIVEVIB, "batch", "-q", "--json", "--scheduler", f"tcp://{address}", str(folder)]
        with tempfile.TemporaryFile("w+") as printed:
            batch = subprocess.Popen(verb, stdout=printed)
            trials = sorted(folder.iterdir())
            while not finished(trials) and batch.poll() is None:
                time.sleep(0.1)
            running[1].kill()
            batch.wait()
            printed.seek(0)
            rows: list[dict[str, Any]] = json.load(printed)["trials"]
            return rows
    finally:
        for process in reversed(running):
            process.kill()
            process.wait()
