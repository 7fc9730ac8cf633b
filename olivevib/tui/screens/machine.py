"""What works on this computer: versions, codecs, cameras, disk, terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Static

from olivevib.tui.harmless import harmless, plain
from olivevib.tui.loader import machine_checks
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.tables import meaning
from olivevib.tui.widgets.row_table import RowTable

if TYPE_CHECKING:
    from olivevib.pipeline.machine import Check

STYLES = {"ok": "good", "note": "warn", "missing": "bad"}


class MachinePage(Page):
    """The checks of ``olivevib doctor``."""

    NAME = "this machine"
    HELP_TEXT = Help(
        "Versions, codecs, cameras with their true frame rate, disk, cores and terminal. Every "
        "camera runs for a second; its manual settings are tried and put back. note: works, but "
        "read it. missing: something that is needed is not here.",
        "Both cameras at 30 frames/s or more, manual exposure that holds, room for the day: two "
        "720p webcams write about 0.4 GB a minute.",
    )
    JUMPS = (Jump("c", "#checks"),)
    BINDINGS: ClassVar[list[BindingType]] = [Binding("f5", "reload", "Look again")]

    _checks: tuple[Check, ...] = ()

    def body(self) -> ComposeResult:
        """One table."""
        yield RowTable(id="checks")
        yield Static(id="why", markup=False)

    def on_mount(self) -> None:
        """Start in the table."""
        table = self.query_one("#checks", DataTable)
        table.border_title = "This machine"
        table.border_subtitle = "looking: every camera runs for a second …"
        table.add_columns("of", "what", "state", "words")
        table.focus()

    def read(self) -> object:
        """Look at the machine."""
        return machine_checks(self.folder)

    def show(self, value: object) -> None:
        """One line a check; what is missing first said below."""
        if not isinstance(value, tuple):
            return
        self._checks = value
        table = self.query_one("#checks", DataTable)
        table.clear()
        for check in value:
            style = meaning(self.olive.palette, STYLES.get(check.state))
            cells = (
                plain(check.group, 10),
                plain(check.what, 30),
                plain(check.state, 8, str(style)),
            )
            table.add_row(*cells, plain(check.words, 160))
        missing = sum(check.state == "missing" for check in value)
        told = f"{missing} missing" if missing else "everything that is needed is here"
        table.border_subtitle = told

    @on(DataTable.RowHighlighted, "#checks")
    def _explain(self) -> None:
        at, checks = self.query_one("#checks", DataTable).cursor_row, self._checks
        if 0 <= at < len(checks):
            self.query_one("#why", Static).update(harmless(checks[at].words, 400))

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(self._checks)

    def action_reload(self) -> None:
        """Look again."""
        self.reload()
