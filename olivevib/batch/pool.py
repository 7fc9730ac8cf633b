"""A batch on the cores here: a fresh process a worker, trials handed out one by one.

A worker that dies costs the trial it was at, which is tried once more; another takes its place.
"""

from __future__ import annotations

import os
import queue
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

from olivevib.batch.outlook import Outlook
from olivevib.batch.process import Message, WorkerProcess
from olivevib.batch.result import TrialResult
from olivevib.errors import InputError, UsageError
from olivevib.progress import Tick, silent

ATTEMPTS = 2
FALSE_STARTS = 3  # workers in a row that end before they begin
POLL_S = 0.25


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def measure_here(
    trials: Sequence[Path], workers: int | None = None, tick: Tick = silent
) -> Generator[TrialResult, None, None]:
    """Measure every trial on ``workers`` cores (None: all); yields results as they come.

    A trial that fails is a result like another. When the tick raises, running trials stop at the
    next safe place and keep what is finished. Raises UsageError for fewer than one worker,
    InputError where worker processes cannot be started.
    """
    if workers is not None and workers < 1:
        raise UsageError(f"--workers {workers} is no number of workers.", "", "Give 1 or more.")
    pool = _Pool(trials, min(workers or cores(), len(trials)), tick)
    try:
        yield from pool.results()
    finally:
        pool.close()


class _Pool:
    """Trials that wait, workers at work, and one queue on which all of them report."""

    def __init__(self, trials: Sequence[Path], workers: int, tick: Tick) -> None:
        self._waiting = deque(str(trial) for trial in trials)
        self._died: dict[str, str] = {}  # trial -> how its first worker ended
        self._inbox: queue.Queue[Message] = queue.Queue()
        self._outlook = Outlook(len(trials), workers)
        self._tick = tick
        self._false_starts = 0
        self._workers = [WorkerProcess(self._inbox) for _ in range(workers)]

    def results(self) -> Iterator[TrialResult]:
        """The results as they come."""
        while self._outlook.left:
            self._tick(*self._outlook.progress())
            try:
                message = self._inbox.get(timeout=POLL_S)
            except queue.Empty:
                continue
            if message.worker not in self._workers:
                continue
            result = self._take(message)
            if result:
                self._outlook.finished(result)
                yield result
        self._tick(*self._outlook.progress())

    def close(self) -> None:
        """End every worker: at the next safe place where it is at work."""
        for worker in self._workers:
            worker.stop()
        for worker in self._workers:
            worker.wait()

    def _take(self, message: Message) -> TrialResult | None:
        worker, result = message.worker, None
        if message.kind == "ended":
            return self._bury(worker)
        if message.kind == "tick":
            self._outlook.at(worker.trial, message.value[2])
            return None
        if message.kind == "ready":
            self._false_starts = 0
        elif message.kind == "result":
            result = TrialResult.from_json(message.value)
            worker.trial = ""
        self._hand_out(worker)
        return result

    def _hand_out(self, worker: WorkerProcess) -> None:
        if self._waiting:
            trial = self._waiting.popleft()
            self._outlook.started(trial)
            worker.give(trial)

    def _bury(self, dead: WorkerProcess) -> TrialResult | None:
        """Put another worker in the place of a dead one; its trial waits again, once."""
        self._workers.remove(dead)
        how = dead.epitaph()
        if not dead.ready:
            self._false_starts += 1
            if self._false_starts >= FALSE_STARTS:
                raise _no_workers(how)
        result = self._second_chance(dead.trial, how) if dead.trial else None
        if self._waiting:
            self._workers.append(WorkerProcess(self._inbox))
        return result

    def _second_chance(self, trial: str, how: str) -> TrialResult | None:
        self._outlook.interrupted(trial)
        if trial in self._died:
            return TrialResult.failure(trial, _deadly(trial, how))
        self._died[trial] = how
        self._waiting.append(trial)
        return None


def _deadly(trial: str, how: str) -> InputError:
    return InputError(
        f"{Path(trial).name} ended its worker process {ATTEMPTS} times.",
        f"The last one {how}.",
        "Finished stages are kept. End other programs or use --workers 1 and run the same command "
        f"again; olivevib check {trial} looks into the files.",
    )


def _no_workers(how: str) -> InputError:
    return InputError(
        "the worker processes end before they begin.",
        f"The last one {how}.",
        "Run olivevib doctor to see what is missing; olivevib run TRIAL works without workers.",
    )
