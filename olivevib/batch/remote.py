"""What runs on a worker of a Dask cluster: one trial, which stops when nobody wants it any more."""

from __future__ import annotations

import os
import threading
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from olivevib.batch.pool import measure_here
from olivevib.batch.result import TrialResult
from olivevib.progress import Cancelled, Tick
from olivevib.threads import uses_one_thread

_ONE_TRIAL = threading.Lock()  # a worker with several threads measures one trial at a time
_LOOKS_S = 0.5


def measure_remotely(trial: str) -> str:
    """The task that a worker runs: one trial; the result as JSON.

    In this process where it computes with one thread, as Dask's own set-up has it; else in a
    process of its own, so that the result is the same to the last bit.
    """
    watch = _Withdrawn()
    while not _ONE_TRIAL.acquire(timeout=_LOOKS_S):
        watch(0, None, "")
    try:
        return _measured(Path(trial), watch).to_json()
    finally:
        _ONE_TRIAL.release()


def _measured(trial: Path, watch: Tick) -> TrialResult:
    if uses_one_thread(os.environ):
        from olivevib.batch.unit import measure, use_one_core

        use_one_core()
        return measure(trial, watch)
    (result,) = measure_here([trial], 1, watch)
    return result


class _Withdrawn:
    """The tick on a worker: raises Cancelled once the scheduler has taken the task back."""

    def __init__(self) -> None:
        worker = import_module("distributed.worker")
        self._tasks: Any = worker.get_worker().state.tasks
        self._key: Any = worker.thread_state.key
        self._looked = float("-inf")

    def __call__(self, done: int, total: int | None, note: str) -> None:
        """Look now and then."""
        if time.monotonic() - self._looked < _LOOKS_S:
            return
        self._looked = time.monotonic()
        task = self._tasks.get(self._key)
        if task is None or task.state == "cancelled":
            raise Cancelled
