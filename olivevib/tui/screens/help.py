"""Help on any screen: what it measures, its keys, what good values are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from olivevib.tui.keys import Key, keys_of
from olivevib.tui.screens.page import Help, Page


class HelpScreen(ModalScreen[None]):
    """Shown over the screen it explains."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,question_mark,enter,q", "dismiss", "Close"),
    ]

    def __init__(self, title: str, about: Help, keys: Sequence[Key]) -> None:
        super().__init__()
        self._title, self._about, self._keys = title, about, keys

    def compose(self) -> ComposeResult:
        """One scrolling sheet."""
        with VerticalScroll(classes="dialog") as sheet:
            sheet.border_title = f"Help: {self._title}"
            sheet.border_subtitle = "Esc closes"
            yield Static(help_text(self._about, self._keys))

    def on_click(self) -> None:
        """A click anywhere closes."""
        self.dismiss()


def help_on(page: Page) -> HelpScreen:
    """The help of a page, with its keys."""
    return HelpScreen(page.NAME, page.HELP_TEXT, keys_of(page))


def help_text(about: Help, keys: Sequence[Key]) -> Text:
    """The sheet as text."""
    out = Text()
    out.append(f"{about.about}\n\n")
    if about.good:
        out.append("Good values\n", "bold")
        out.append(f"{about.good}\n\n")
    out.append("Keys\n", "bold")
    width = max((len(key.shown) for key in keys), default=0)
    for key in keys:
        out.append(f"  {key.shown.ljust(width)}  ", "bold")
        out.append(f"{key.words}\n")
    out.rstrip()
    return out
