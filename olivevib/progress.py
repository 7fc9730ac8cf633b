"""The one way in which long work reports progress and is cancelled.

Long work takes ``tick(done, total, note)`` and calls it often. Whoever called may raise
``Cancelled`` from it; the work then stops at the next safe place and keeps what is finished.
"""

from __future__ import annotations

from collections.abc import Callable

Tick = Callable[[int, int | None, str], None]  # done, total (None: unknown), what is going on


class Cancelled(Exception):
    """Raised from a tick by whoever wants the work to stop; finished work is kept."""


def silent(done: int, total: int | None, note: str) -> None:
    """A tick that says nothing and never cancels."""
