"""Narration for a person on stderr: sentences, one progress line, warnings and errors."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterable, Sequence
from typing import TextIO

from olivevib.errors import Caution

REDRAW_S = 0.1
PLAIN_S = 10.0  # without a terminal: one line of progress at most this often
BAR = 24


class Console:
    """What a person reads while a command works; nothing of it goes to stdout."""

    def __init__(self, stream: TextIO, quiet: bool = False) -> None:
        self._stream = stream
        self._quiet = quiet
        self._live = stream.isatty() and not quiet
        self._drawn = time.monotonic()
        self._started = time.monotonic()
        self._note = ""
        self._open = False
        self._painted = 0  # lines of the picture that stands on the terminal

    def say(self, text: str) -> None:
        """A sentence on a line of its own."""
        if not self._quiet:
            self._clear()
            print(text, file=self._stream, flush=True)

    def error(self, what: str, why: str = "", remedy: str = "") -> None:
        """What went wrong, why, and what to do next; shown even when quiet."""
        self._clear()
        lines = [f"olivevib: {what}", *(part for part in (why, remedy) if part)]
        print("\n".join(lines), file=self._stream, flush=True)

    def cautions(self, cautions: Iterable[Caution]) -> int:
        """Show warnings with their remedies; returns how many."""
        shown = 0
        for caution in cautions:
            shown += 1
            self.say(f"warning [{caution.code}]: {caution.text}\n    {caution.remedy}")
        return shown

    def tick(self, done: int, total: int | None, note: str) -> None:
        """The tick of long work: one line that is drawn over itself, at most ten times a second."""
        now = time.monotonic()
        if note != self._note:
            self._note, self._started = note, now
        finished = total is not None and done >= total
        if not self._live:
            if now - self._drawn > PLAIN_S:
                self._drawn = now
                self.say(f"  {note} {done}" + (f"/{total}" if total else ""))
        elif finished or now - self._drawn > REDRAW_S:
            self._drawn = now
            if self._painted:
                self._clear()
            width = shutil.get_terminal_size().columns - 1
            line = f"  {note}  {_bar(done, total)}{_left(done, total, now - self._started)}"
            print(f"\r\x1b[K{line[:width]}", end="", file=self._stream, flush=True)
            self._open = True

    def paint(self, lines: Sequence[str]) -> bool:
        """Draw several lines over those painted before; False where nothing can be drawn over."""
        if not self._live:
            return False
        self._clear()
        size = shutil.get_terminal_size()
        shown = [line[: size.columns - 1] for line in lines[: size.lines - 1]]
        if shown:
            print("\n".join(shown), file=self._stream, flush=True)
        self._painted = len(shown)
        return True

    def ring(self, bell: str = "\a") -> None:
        """Call somebody who looks elsewhere, on a terminal only."""
        if self._live:
            print(bell, end="", file=self._stream, flush=True)

    def _clear(self) -> None:
        if self._painted:
            print(f"\x1b[{self._painted}F\x1b[J", end="", file=self._stream)
            self._painted = 0
        if self._open:
            print("\r\x1b[K", end="", file=self._stream)
            self._open = False


def _bar(done: int, total: int | None) -> str:
    if not total:
        return f"{done}"
    full = min(BAR, BAR * done // total)
    return f"{'█' * full}{'·' * (BAR - full)} {done}/{total}"


def _left(done: int, total: int | None, seconds: float) -> str:
    """Rate and time left, once both can be told."""
    if not done or seconds < 1.0:
        return ""
    rate = done / seconds
    if not total or done >= total:
        return f"  {rate:.0f}/s"
    return f"  {rate:.0f}/s, {(total - done) / rate:.0f} s left · Ctrl-C cancels, work is kept"
