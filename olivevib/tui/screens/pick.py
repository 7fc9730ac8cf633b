"""Picking a file or folder: one folder at a time, narrowed by typing, or a path that is typed."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Footer, Input, OptionList, Static
from textual.widgets.option_list import Option

from olivevib.tui.harmless import harmless
from olivevib.tui.screens.early import EarlyKeys
from olivevib.tui.views.folder import Entry, entries_of, entry_text, pictures_in


class Typed(Input):
    """The line above the list; rubbing out in an empty one shows the folder above."""

    def action_delete_left(self) -> None:
        """Rub out, or go up."""
        if self.value:
            super().action_delete_left()
        elif isinstance(self.screen, PickScreen):
            self.screen.action_up()


class PickScreen(EarlyKeys, ModalScreen[Path | None]):
    """Gives the path that was chosen, or None."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss", "Leave"),
        Binding("down", "move(1)", "Next", show=False),
        Binding("up", "move(-1)", "Before", show=False),
        Binding("pagedown", "move(10)", "Further", show=False),
        Binding("pageup", "move(-10)", "Back", show=False),
        Binding("ctrl+t", "folder", "Take this folder"),
        Binding("backspace", "up", "Folder above"),
    ]

    def __init__(self, title: str, start: Path) -> None:
        super().__init__()
        self._heading, self._here = title, start.resolve()
        self._entries: tuple[Entry, ...] = ()
        self._words = ""  # what the list is narrowed by

    def compose(self) -> ComposeResult:
        """Where one is, a line to type in, what is there, two buttons for the mouse."""
        with Vertical(classes="dialog") as sheet:
            sheet.border_title = harmless(self._heading, 60)
            sheet.border_subtitle = "type to narrow, or a path · Enter opens or takes · Esc leaves"
            yield Static(id="here", markup=False)
            yield Typed(placeholder="part of a name, or a path", id="typed", compact=True)
            yield OptionList(id="entries")
            with Horizontal(id="picks"):
                yield Button("↑ folder above", id="above", compact=True)
                yield Button("take this folder", id="take", compact=True)
        yield Footer()

    def on_mount(self) -> None:
        """Start in the line: letters narrow the list, arrows move in it."""
        self.query_one("#entries").can_focus = False
        for button in self.query(Button):
            button.can_focus = False
        self._show(self._here)
        self._fill(self.query_one("#typed", Input).value)
        self.query_one("#typed").focus()

    def _enter(self, folder: Path) -> None:
        """Another folder, nothing typed."""
        self.query_one("#typed", Input).value = ""
        self._show(folder)
        self._fill("")

    def _show(self, folder: Path) -> None:
        """Say which folder it is."""
        self._here = folder.resolve()
        self.query_one("#here", Static).update(harmless(self._here, 200))
        take = self.query_one("#take", Button)
        pictures = pictures_in(self._here)
        take.label = f"take this folder ({pictures} pictures)" if pictures else "take this folder"

    def _fill(self, words: str) -> None:
        self._words = words
        try:
            self._entries = entries_of(self._here, "" if _is_path(words) else words)
            fault = Text("nothing here by that name" if words else "an empty folder")
        except OSError as error:
            self._entries, fault = (), Text(f"cannot be read: {error.strerror}")
        listed = self.query_one("#entries", OptionList)
        listed.clear_options()
        listed.add_options([Option(entry_text(entry)) for entry in self._entries])
        if self._entries:
            listed.highlighted = 0
        else:
            listed.add_option(Option(fault, disabled=True))

    @on(Input.Changed, "#typed")
    def _narrow(self, event: Input.Changed) -> None:
        if event.value == self.query_one("#typed", Input).value != self._words:
            self._fill(event.value)

    @on(Input.Submitted, "#typed")
    def _entered(self, event: Input.Submitted) -> None:
        """A path that was typed, else what is marked; a fast hand is ahead of the list."""
        if event.value != self._words:
            self._fill(event.value)
        path = Path(event.value).expanduser()
        if _is_path(event.value) and not path.exists():
            self.query_one("#here", Static).update(f"{harmless(path, 150)} is not there.")
        elif _is_path(event.value):
            self._take(path)
        else:
            at = self.query_one("#entries", OptionList).highlighted
            if at is not None and at < len(self._entries):
                self._take(self._entries[at].path)

    @on(OptionList.OptionSelected)
    def _clicked(self, event: OptionList.OptionSelected) -> None:
        if event.option_index < len(self._entries):
            self._take(self._entries[event.option_index].path)

    def _take(self, path: Path) -> None:
        """Open a folder, give a file."""
        if path.is_dir():
            self._enter(path)
        else:
            self.dismiss(path)

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        event.stop()
        if event.button.id == "above":
            self.action_up()
        else:
            self.action_folder()

    def action_move(self, by: int) -> None:
        """Mark another entry."""
        listed = self.query_one("#entries", OptionList)
        at = (listed.highlighted or 0) + by
        if self._entries:
            listed.highlighted = max(0, min(at, len(self._entries) - 1))

    def action_folder(self) -> None:
        """Take the folder that is marked, or else the one that is shown."""
        at = self.query_one("#entries", OptionList).highlighted
        marked = self._entries[at] if at is not None and at < len(self._entries) else None
        typed = self.query_one("#typed", Input).value
        self.dismiss(marked.path if marked and marked.folder and typed else self._here)

    def action_up(self) -> None:
        """Show the folder above."""
        self._enter(self._here.parent)


def _is_path(words: str) -> bool:
    return "/" in words or "\\" in words or words.startswith("~")
