"""One value, chosen from a list, typed, or clicked together key by key: a mouse is enough."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Input, OptionList
from textual.widgets.option_list import Option

from olivevib.tui.harmless import harmless, plain
from olivevib.tui.screens.early import EarlyKeys

ROWS = ("1234567890", "qwertyuiop", "asdfghjkl_", "zxcvbnm-.,", ":=/ ")


class ChooseScreen(EarlyKeys, ModalScreen[str | None]):
    """Gives the text that was chosen, or None."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Leave it")]

    def __init__(self, title: str, value: str, choices: Sequence[str]) -> None:
        super().__init__()
        self._heading, self._value = title, value
        self._choices = tuple(choices)

    def compose(self) -> ComposeResult:
        """What was used before, a line, and keys to click."""
        with Vertical(classes="dialog") as sheet:
            sheet.border_title = harmless(self._heading, 60)
            sheet.border_subtitle = "Enter takes it · Esc leaves it"
            options = [Option(plain(c, 90), id=f"choice-{k}") for k, c in enumerate(self._choices)]
            yield OptionList(*options, id="choices")
            yield Input(self._value, id="value")
            with Vertical(id="keys"):
                for row in ROWS:
                    with Horizontal():
                        for key in row:
                            yield Button(key, id=f"key-{ord(key)}", compact=True)
                with Horizontal():
                    yield Button("⌫", id="rub", compact=True)
                    yield Button("take it", id="take", compact=True, variant="primary")

    def on_mount(self) -> None:
        """Start in the list where there is one."""
        has = bool(self._choices)
        self.query_one("#choices").display = has
        self.query_one("#choices" if has else "#value").focus()

    @on(OptionList.OptionSelected)
    def _chosen(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(self._choices[event.option_index])

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        self.dismiss(event.value)

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        """A key of the picture of a keyboard."""
        event.stop()
        name, field = event.button.id or "", self.query_one("#value", Input)
        if name == "take":
            self.dismiss(field.value)
        elif name == "rub":
            field.value = field.value[:-1]
        else:
            field.value += chr(int(name.removeprefix("key-")))
