"""The worker process of a local batch: takes trials from stdin, tells on stdout, one line each.

It uses one core. When its stdin ends, whoever started it is gone, and it ends at once: every file
is written whole or not at all, so this loses no finished work and leaves no orphan behind.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import threading
import time
from pathlib import Path
from typing import Any

TELLS_S = 0.2  # progress is told at most this often
STOP = "stop"  # the order to cancel, instead of a trial's folder


class _Orders:
    """The lines of stdin, read by a thread of its own so that a stop is heard during work."""

    def __init__(self) -> None:
        self.trials: queue.Queue[str] = queue.Queue()
        self.stopped = threading.Event()
        threading.Thread(target=self._listen, name="orders", daemon=True).start()

    def _listen(self) -> None:
        with open(0, "rb", buffering=0, closefd=False) as lines:
            for line in lines:
                order = json.loads(line)
                if order == STOP:
                    self.stopped.set()
                self.trials.put(order)
        os._exit(0)


class _Report:
    """What goes to whoever started this process; prints of any library go to stderr instead."""

    def __init__(self) -> None:
        self._out = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)
        self._told = float("-inf")

    def tell(self, kind: str, value: Any = None) -> None:
        """Write one message as a line."""
        try:
            self._out.write(json.dumps([kind, value]).encode() + b"\n")
            self._out.flush()
        except OSError:  # nobody listens any more
            os._exit(1)

    def progress(self, done: int, total: int | None, note: str) -> None:
        """Write progress, now and then."""
        if time.monotonic() - self._told > TELLS_S:
            self._told = time.monotonic()
            self.tell("tick", [done, total, note])


def main() -> None:
    """Measure trial after trial until stdin ends or a stop is ordered."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever started this
    report, orders = _Report(), _Orders()
    from olivevib.batch.unit import measure, use_one_core
    from olivevib.progress import Cancelled

    def tick(done: int, total: int | None, note: str) -> None:
        if orders.stopped.is_set():
            raise Cancelled
        report.progress(done, total, note)

    use_one_core()
    report.tell("ready")
    while (order := orders.trials.get()) != STOP:
        try:
            report.tell("result", measure(Path(order), tick).to_json())
        except Cancelled:
            break
    os._exit(0)  # the listening thread still waits on stdin


if __name__ == "__main__":
    main()
