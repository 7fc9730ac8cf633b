"""How far a batch is and how long it will take, in words for the one tick."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from olivevib.batch.result import TrialResult


class Outlook:
    """Counts trials and times those that were really measured; ``now`` is a clock in seconds."""

    def __init__(self, total: int, workers: int, now: Callable[[], float] = time.monotonic) -> None:
        self._total, self._now = total, now
        self.workers = workers
        self._done = 0
        self._running: dict[str, float] = {}  # trial -> when it started
        self._measured: list[float] = [0.0, 0.0]  # how many, and how long all of them together
        self._note = "starting"

    @property
    def left(self) -> int:
        """How many trials are not through."""
        return self._total - self._done

    def started(self, trial: str) -> None:
        """A worker begins with a trial."""
        self._running[trial] = self._now()
        self.at(trial, "")

    def at(self, trial: str, note: str) -> None:
        """A worker tells what it is at."""
        self.note(f"{Path(trial).name} {note}".strip())

    def note(self, words: str) -> None:
        """What is going on, for the next progress."""
        self._note = words

    def interrupted(self, trial: str) -> None:
        """The worker of a trial died."""
        self._running.pop(trial, None)

    def finished(self, result: TrialResult) -> None:
        """A trial is through; only one that had something to do tells how long one takes."""
        self._done += 1
        self._running.pop(result.folder, None)
        if result.ran:
            self._measured[0] += 1
            self._measured[1] += result.seconds

    def progress(self) -> tuple[int, int, str]:
        """Arguments of a tick: trials through, all trials, time left and what is going on."""
        seconds = self.seconds_left()
        words = f"{_words(seconds)} left; " if seconds is not None else ""
        return self._done, self._total, f"trials: {words}{self._note}"

    def seconds_left(self) -> float | None:
        """How long it will still take if all trials are alike; None before one was measured."""
        count, together = self._measured
        if not count:
            return None
        each, now = together / count, self._now()
        begun = sum(max(each - (now - start), 0.0) for start in self._running.values())
        waiting = self.left - len(self._running)
        return (begun + each * waiting) / max(1, min(self.workers, self.left))


def _words(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"
