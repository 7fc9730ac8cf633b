"""Both cameras at once: one thread each reads and measures, one place collects and can cancel.

A process that was told to use one core (``cv2.setNumThreads(1)``, as batch does with its workers)
takes a frame of each camera in turn instead: several of them then share the cores without loss.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Generic, TypeVar

import cv2

from olivevib.progress import Cancelled, Tick

Item = TypeVar("Item")
AHEAD = 16  # items a camera may be ahead of the collector: memory stays flat
POLL_S = 0.005  # a wish to stop is noticed that soon, also while no frame is finished


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
        """Hand an item over, also the last one when told to stop; False: no other is wanted."""
        while True:
            stopping = self.stop.is_set()
            try:
                self.items.put(item, timeout=POLL_S)
                return not stopping
            except queue.Full:
                if stopping:
                    return False

    def finished(self) -> Iterator[Item]:
        """What is still in the queue once the thread has ended."""
        while not self.items.empty():
            item = self.items.get_nowait()
            if item is not None:
                yield item


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
    after each item and every few milliseconds between them; when it raises, both threads are
    stopped and joined: each ends the frame that it is at, and begins no other. Where it is
    cancelled, these are collected before it goes on. An error of a camera is raised here, after
    what both cameras delivered was collected.
    """

    def take(side: str, item: Item) -> None:
        nonlocal done
        collect(side, item)
        done += 1
        tick(done, total, note)

    tick(done, total, note)
    if cv2.getNumThreads() > 1:
        _in_threads(makers, take, lambda: tick(done, total, note), collect)
    else:
        _in_turn(makers, take)


def _in_threads(
    makers: Mapping[str, Callable[[], Iterator[Item]]],
    take: Callable[[str, Item], None],
    wait: Callable[[], None],
    keep: Callable[[str, Item], None],
) -> None:
    workers = [_Worker(side, make) for side, make in makers.items()]
    for worker in workers:
        worker.thread.start()
    running = list(workers)
    try:
        while running:
            for worker in list(running):
                item = _next(worker)
                if item is None:
                    running.remove(worker)
                elif item is _NOTHING:
                    wait()
                else:
                    take(worker.side, item)  # type: ignore[arg-type]
    except Cancelled:
        _stop(workers)
        for worker in workers:
            for item in worker.finished():
                keep(worker.side, item)
        raise
    finally:
        _stop(workers)
    for worker in workers:
        if worker.error is not None:
            raise worker.error


def _stop(workers: list[_Worker[Item]]) -> None:
    for worker in workers:
        worker.stop.set()
    for worker in workers:
        worker.thread.join()


def _in_turn(
    makers: Mapping[str, Callable[[], Iterator[Item]]], take: Callable[[str, Item], None]
) -> None:
    walks = {side: make() for side, make in makers.items()}
    errors: list[Exception] = []
    try:
        while walks:
            for side in list(walks):
                try:
                    item = next(walks[side])
                except StopIteration:
                    del walks[side]
                except Exception as error:  # raised below, once the other camera is through
                    errors.append(error)
                    del walks[side]
                else:
                    take(side, item)
    finally:
        walks.clear()  # closes the recordings also where the tick has raised
    if errors:
        raise errors[0]


_NOTHING = object()


def _next(worker: _Worker[Item]) -> object:
    try:
        return worker.items.get(timeout=POLL_S)
    except queue.Empty:
        return _NOTHING
