"""Settings and session record of a trial: everything that trial.toml may say."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Static

from olivevib.errors import OlivevibError
from olivevib.tui.loader import guarded, setting_values
from olivevib.tui.screens.edit import EditScreen
from olivevib.tui.screens.page import Command, Help, Jump, Page
from olivevib.tui.views.setting_rows import (
    MEANS,
    SettingRow,
    change_of,
    setting_cells,
    setting_words,
)
from olivevib.tui.widgets.row_table import RowTable


class SettingsPage(Page):
    """A change is checked before it is written; comments in the file stay."""

    NAME = "settings and record"
    HELP_TEXT = Help(
        "What trial.toml says: who, where and when, the tree, the machine, the markers, the "
        "cameras, and every parameter of the stages (detection.* are those of the paper). Enter "
        "changes a value; an empty one takes it out. Nothing is written that is not valid, and "
        "what depends on a changed value becomes stale, so that run brings it up to date.",
        "Give at least markers.size_mm, the band that the machine can reach (vibration.band_hz) "
        "and the shutter of the cameras: without them a frequency cannot be decided.",
    )
    JUMPS = (Jump("s", "#settings"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "edit", "Change", priority=False),
        Binding("right_square_bracket", "section", "Next section", key_display="]"),
    ]
    _rows: tuple[SettingRow, ...] = ()

    def body(self) -> ComposeResult:
        """One table."""
        yield RowTable(id="settings")
        yield Static(id="why", markup=False)

    def on_mount(self) -> None:
        """Start in the table."""
        table = self.query_one("#settings", DataTable)
        table.border_title = "trial.toml"
        table.add_columns("key", "value")
        table.focus()

    def read(self) -> tuple[SettingRow, ...]:
        """Every setting from trial.toml."""
        return setting_values(self.folder)

    def show(self, value: object) -> None:
        """Fill the table; the cursor stays."""
        if not isinstance(value, tuple):
            return
        self._rows = value
        table = self.query_one("#settings", DataTable)
        at = table.cursor_row
        table.clear()
        for row in self._rows:
            table.add_row(*setting_cells(row, self.olive.palette))
        table.move_cursor(row=at)

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(self._rows)

    @on(DataTable.RowHighlighted, "#settings")
    def _explain(self) -> None:
        at = self.query_one("#settings", DataTable).cursor_row
        if 0 <= at < len(self._rows):
            text = setting_words(self._rows[at], self.olive.palette)
            self.query_one("#why", Static).update(text)

    @on(DataTable.RowSelected, "#settings")
    def action_edit(self) -> None:
        """Type another value for the marked setting."""
        at = self.query_one("#settings", DataTable).cursor_row
        if 0 <= at < len(self._rows):
            row = self._rows[at]
            hint = MEANS.get(row.key, "as in trial.toml; empty takes it out")
            self.app.push_screen(EditScreen(row.key, hint, row.value), partial(self._typed, row))

    def _typed(self, row: SettingRow, text: str | None) -> None:
        if text is not None and text != row.value:
            change = guarded(lambda: change_of(row, text))
            if isinstance(change, OlivevibError):
                self.olive.show_error(change)
            else:
                self.save_settings(change)

    def action_section(self) -> None:
        """Move to the first setting of the next section."""
        table = self.query_one("#settings", DataTable)
        heads = [r.key.split(".")[0] for r in self._rows]
        if heads:
            here = heads[table.cursor_row]
            later = [k for k, h in enumerate(heads) if k > table.cursor_row and h != here]
            table.move_cursor(row=later[0] if later else 0, scroll=True)

    def commands(self) -> list[Command]:
        """Every setting by its key."""
        return [Command(f"Set {r.key}", partial(self._edit, k)) for k, r in enumerate(self._rows)]

    def _edit(self, at: int) -> None:
        self.query_one("#settings", DataTable).move_cursor(row=at)
        self.action_edit()
