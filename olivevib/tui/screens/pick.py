"""Picking a file or folder: a tree to walk through, or a path to type."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from rich.text import Text, TextType
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import DirectoryTree, Footer, Input

from olivevib.tui.harmless import plain


class Tree(DirectoryTree):
    """A folder, with names made harmless."""

    def process_label(self, label: TextType) -> Text:
        """A name as plain text."""
        return plain(label)


class PickScreen(ModalScreen[Path | None]):
    """Gives the path that was chosen, or None."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss", "Leave"),
        Binding("f", "folder", "Take this folder"),
        Binding("backspace", "up", "Folder above"),
    ]

    def __init__(self, title: str, start: Path) -> None:
        super().__init__()
        self._heading, self._start = title, start.resolve()

    def compose(self) -> ComposeResult:
        """Path above, tree below."""
        with Vertical(classes="dialog") as sheet:
            sheet.border_title = self._heading
            sheet.border_subtitle = "Enter takes a file · f takes a folder"
            yield Input(placeholder="or type a path and press Enter", id="typed")
            yield Tree(self._start, id="tree")
        yield Footer()

    def on_mount(self) -> None:
        """Start in the tree."""
        self.query_one("#tree").focus()

    @on(DirectoryTree.FileSelected)
    def _file(self, event: DirectoryTree.FileSelected) -> None:
        self.dismiss(event.path)

    @on(Input.Submitted)
    def _typed(self, event: Input.Submitted) -> None:
        path = Path(event.value).expanduser()
        if path.is_dir():
            self._show(path)
        elif path.exists():
            self.dismiss(path)
        else:
            self.notify(f"{plain(path)} is not there.", severity="warning", markup=False)

    def _show(self, folder: Path) -> None:
        tree = self.query_one("#tree", Tree)
        tree.path = folder.resolve()
        tree.focus()

    def action_folder(self) -> None:
        """Take the marked folder, or the one that the marked file is in."""
        node = self.query_one("#tree", Tree).cursor_node
        path = node.data.path if node is not None and node.data is not None else self._start
        self.dismiss(path if path.is_dir() else path.parent)

    def action_up(self) -> None:
        """Show the folder above."""
        self._show(Path(self.query_one("#tree", Tree).path).parent)
