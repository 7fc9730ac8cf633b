"""Jump mode: a letter on every pane; pressing it goes there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.geometry import Region
from textual.screen import ModalScreen
from textual.widgets import Label


class JumpScreen(ModalScreen[str | None]):
    """Letters over the screen below; gives the letter that was chosen, or None."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Stay here")]

    def __init__(self, places: Mapping[str, Region]) -> None:
        super().__init__()
        self._places = places

    def compose(self) -> ComposeResult:
        """A label a pane."""
        for letter in self._places:
            yield Label(f" {letter} ", id=f"jump-{letter}", classes="jump")
        yield Label("press a letter · Esc stays here", id="jump-help")

    def on_mount(self) -> None:
        """Put each letter on the upper left corner of its pane."""
        for letter, region in self._places.items():
            self.query_one(f"#jump-{letter}").styles.offset = (region.x, region.y)

    def on_key(self, event: events.Key) -> None:
        """Take the letter."""
        if event.key in self._places:
            event.stop()
            self.dismiss(event.key)

    def on_click(self, event: events.Click) -> None:
        """A click on a letter takes it; a click elsewhere stays."""
        name = (event.widget.id or "") if event.widget else ""
        letter = name.removeprefix("jump-")
        self.dismiss(letter if letter in self._places else None)
