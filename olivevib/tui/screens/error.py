"""An error stays on screen until it has been read: what happened, why, what to do next."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from olivevib.errors import OlivevibError
from olivevib.tui.views.faults import error_text


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
