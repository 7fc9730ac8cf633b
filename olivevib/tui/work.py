"""Long work in a thread: its tick for the screen, and what becomes of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from olivevib.errors import Caution, OlivevibError
from olivevib.progress import Cancelled, Tick
from olivevib.tui.views.progress import Progress

POSTS_HZ = 20.0
KNOWN_AFTER_S = 1.0  # before that a rate is a guess


@dataclass(frozen=True)
class Result:
    """What work left behind: a sentence with the next key, warnings, a trial to open.

    warns: it needs a look, also without warnings of its own.
    """

    words: str
    cautions: tuple[Caution, ...] = ()
    opens: Path | None = None
    warns: bool = False


@dataclass(frozen=True)
class Said:
    """An outcome in words; warned: it has warnings to read."""

    words: str
    warned: bool = False


@dataclass(frozen=True)
class Work:
    """Something long to do: its title, and the function that does it with a tick."""

    title: str
    do: Callable[[Tick], Result]


@dataclass(frozen=True)
class Ended:
    """How work ended: with a result, cancelled, or with an error that says what to do next."""

    work: Work
    result: Result | None = None
    cancelled: bool = False
    error: OlivevibError | None = None


class PostedTick:
    """The tick of work in a thread: posts at most 20 times a second, raises Cancelled when asked.

    Rate and time left count from the first call of a series (the same total, rising counts), so
    that resumed work shows the speed of now.
    """

    def __init__(
        self,
        title: str,
        post: Callable[[Progress], object],
        cancel: threading.Event,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._title, self._post, self._cancel, self._now = title, post, cancel, now
        self._posted = float("-inf")
        self._series: tuple[int | None, int] = (None, -1)
        self._since: tuple[float, int] = (0.0, 0)

    def __call__(self, done: int, total: int | None, note: str) -> None:
        """Report that ``done`` of ``total`` steps are made."""
        if self._cancel.is_set():
            raise Cancelled
        now = self._now()
        if total != self._series[0] or done < self._series[1] or self._series[1] < 0:
            self._since = (now, done)
        self._series = (total, done)
        if now - self._posted >= 1 / POSTS_HZ:
            self._posted = now
            self._post(self._progress(now, done, total, note))

    def _progress(self, now: float, done: int, total: int | None, note: str) -> Progress:
        seconds, steps = now - self._since[0], done - self._since[1]
        if seconds < KNOWN_AFTER_S or steps < 1:
            return Progress(self._title, note, done, total)
        rate = steps / seconds
        left = (total - done) / rate if total else None
        return Progress(self._title, note, done, total, rate, left)


def perform(work: Work, tick: Tick) -> Ended:
    """Do the work in the calling thread; how it ended, whatever happened."""
    try:
        return Ended(work, result=work.do(tick))
    except Cancelled:
        return Ended(work, cancelled=True)
    except OlivevibError as error:
        return Ended(work, error=error)
    except Exception as error:  # shown to a person: the app and what was measured live on
        return Ended(work, error=_unforeseen(error))


def _unforeseen(error: Exception) -> OlivevibError:
    return OlivevibError(
        f"olivevib met an unforeseen error: {type(error).__name__}: {error}",
        "This is a fault of the program, not yours; nothing that was measured is lost.",
        "Run the same step on the command line with --debug and send what it prints.",
    )
