"""One value, typed: Enter keeps it, Esc leaves everything as it was."""

from __future__ import annotations

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from olivevib.tui.harmless import harmless
from olivevib.tui.screens.early import EarlyKeys


class EditScreen(EarlyKeys, ModalScreen[str | None]):
    """Gives the text that was typed, or None."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Leave it", show=False)]

    def __init__(self, title: str, hint: str, value: str) -> None:
        super().__init__()
        self._heading, self._hint, self._value = title, hint, value

    def compose(self) -> ComposeResult:
        """A line to type in."""
        with Vertical(classes="dialog") as sheet:
            sheet.border_title = harmless(self._heading, 60)
            sheet.border_subtitle = "Enter keeps it · Esc leaves it"
            yield Static(harmless(self._hint, 300), markup=False)
            yield Input(self._value, id="value")

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        self.dismiss(event.value)
