"""The line of long work, then of its outcome. A click on it cancels, as Esc does."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from rich.text import Text
from textual.widget import Widget

from olivevib.tui.harmless import harmless
from olivevib.tui.views.progress import progress_line

if TYPE_CHECKING:
    from olivevib.tui.app import OlivevibApp
    from olivevib.tui.work import Said

SAID_S = 20.0  # how long an outcome stays


class WorkLine(Widget):
    """Shows the progress of the app's work."""

    @property
    def _olive(self) -> OlivevibApp:
        return cast("OlivevibApp", self.app)

    def on_mount(self) -> None:
        """Follow the app's work."""
        self.watch(self.app, "progress", self._follow)
        self.watch(self.app, "cancelling", self._follow)
        self.watch(self.app, "said", self._heard)

    def _heard(self) -> None:
        self._follow()
        said = self._olive.said
        if said is not None:
            self.set_timer(SAID_S, lambda: self._forget(said))

    def _forget(self, said: Said) -> None:
        if self._olive.said is said:
            self._olive.said = None

    def _follow(self) -> None:
        running, said = self._olive.progress is not None, self._olive.said
        self.set_class(running or said is not None, "-busy")
        self.set_class(not running and said is not None and said.warned, "-warned")
        self.refresh(layout=not running)

    def render(self) -> Text:
        """What runs, how far it is, how to stop it."""
        progress = self._olive.progress
        if progress is None:
            said = self._olive.said
            return Text(harmless(said.words, 300) if said else "")
        width = self.content_size.width
        return Text(progress_line(progress, width, self._olive.cancelling), no_wrap=True)

    def on_click(self) -> None:
        """Cancel; or take away what has been read."""
        self._olive.action_cancel_work()
        self._olive.said = None
