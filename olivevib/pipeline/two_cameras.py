"""Both cameras at once: one thread each reads and measures, one place collects and can cancel."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Generic, TypeVar

from olivevib.progress import Tick

Item = TypeVar("Item")
AHEAD = 16  # items a camera may be ahead of the collector: memory stays flat
POLL_S = 0.2


class _Worker(Generic[Item]):
    """One camera's thread; it stops between two items when asked to."""

    def __init__(self, side: str, make: Callable[[], Iterator[Item]]) -> None:
        self.side = side
        self._make = make
        self.stop = threading.Event()
        self.items: queue.Queue[Item | None] = queue.Queue(AHEAD)
        self.error: BaseException | None = None
        self.thread = threading.Thread(target=self._run, name=f"{side} camera", daemon=True)

    def _run(self) -> None:
        try:
            for item in self._make():
                if not self._put(item):
                    return
        except BaseException as error:  # handed to the collector, which raises it
            self.error = error
        finally:
            self._put(None)

    def _put(self, item: Item | None) -> bool:
        while not self.stop.is_set():
            try:
                self.items.put(item, timeout=POLL_S)
                return True
            except queue.Full:
                continue
        return False


def both(
    makers: Mapping[str, Callable[[], Iterator[Item]]],
    collect: Callable[[str, Item], None],
    tick: Tick,
    total: int | None,
    note: str,
    done: int = 0,
) -> None:
    """Run one iterator a camera in its own thread and ``collect`` every item in this thread.

    makers: side -> a function that makes the iterator (called in the thread). The tick is called
    after each item; when it raises, both threads are stopped and joined before it goes on. An
    error of a camera is raised here, after what both cameras delivered was collected.
    """
    workers = [_Worker(side, make) for side, make in makers.items()]
    for worker in workers:
        worker.thread.start()
    running = list(workers)
    try:
        tick(done, total, note)
        while running:
            for worker in list(running):
                item = _next(worker)
                if item is _NOTHING:
                    continue
                if item is None:
                    running.remove(worker)
                    continue
                collect(worker.side, item)  # type: ignore[arg-type]
                done += 1
                tick(done, total, note)
    finally:
        for worker in workers:
            worker.stop.set()
        for worker in workers:
            worker.thread.join()
    for worker in workers:
        if worker.error is not None:
            raise worker.error


_NOTHING = object()


def _next(worker: _Worker[Item]) -> object:
    try:
        return worker.items.get(timeout=0.02)
    except queue.Empty:
        return _NOTHING
