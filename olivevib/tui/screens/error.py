"""An error stays on screen until it has been read: what happened, why, what to do next."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from olivevib.errors import OlivevibError
from olivevib.tui.harmless import harmless


class ErrorScreen(ModalScreen[None]):
    """Shown over whatever was on screen."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,enter,q", "dismiss", "Close")]

    def __init__(self, error: OlivevibError) -> None:
        super().__init__()
        self._error = error

    def compose(self) -> ComposeResult:
        """One scrolling sheet."""
        with VerticalScroll(classes="dialog -error") as sheet:
            sheet.border_title = "This did not work"
            sheet.border_subtitle = "Esc closes; nothing that was measured is lost"
            yield Static(error_text(self._error))

    def on_click(self) -> None:
        """A click anywhere closes."""
        self.dismiss()


def error_text(error: OlivevibError | None) -> Text:
    """The three parts of an error as text; lines of a list of faults stay lines."""
    out = Text()
    if error is None:
        return out
    for title, part in (("", error.what), ("", error.why), ("Next: ", error.remedy)):
        if part:
            lines = "\n".join(harmless(line, 400) for line in part.splitlines()[:40])
            out.append(f"{title}{lines}\n\n", "bold" if part is error.what else "")
    out.rstrip()
    return out
