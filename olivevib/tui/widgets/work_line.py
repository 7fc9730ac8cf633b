"""The line of long work; hidden while nothing runs. A click on it cancels, as Esc does."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from rich.text import Text
from textual.widget import Widget

from olivevib.tui.views.progress import progress_line

if TYPE_CHECKING:
    from olivevib.tui.app import OlivevibApp


class WorkLine(Widget):
    """Shows the progress of the app's work."""

    @property
    def _olive(self) -> OlivevibApp:
        return cast("OlivevibApp", self.app)

    def on_mount(self) -> None:
        """Follow the app's work."""
        self.watch(self.app, "progress", self._follow)
        self.watch(self.app, "cancelling", self._follow)

    def _follow(self) -> None:
        self.set_class(self._olive.progress is not None, "-busy")
        self.refresh()

    def render(self) -> Text:
        """What runs, how far it is, how to stop it."""
        progress = self._olive.progress
        if progress is None:
            return Text("")
        width = self.content_size.width
        return Text(progress_line(progress, width, self._olive.cancelling), no_wrap=True)

    def on_click(self) -> None:
        """Cancel."""
        self._olive.action_cancel_work()
