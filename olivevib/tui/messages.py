"""What the thread of long work tells the app."""

from __future__ import annotations

from textual.message import Message

from olivevib.tui.views.progress import Progress
from olivevib.tui.work import Ended


class WorkTicked(Message):
    """The work has come further."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self.progress = progress


class WorkEnded(Message):
    """The work has ended."""

    def __init__(self, ended: Ended) -> None:
        super().__init__()
        self.ended = ended
