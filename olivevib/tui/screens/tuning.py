"""The paper's six parameters beside a picture: each change shows its effect at once."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.widgets import DataTable

from olivevib.errors import OlivevibError
from olivevib.tui import jobs
from olivevib.tui.loader import guarded, settings_now
from olivevib.tui.screens.edit import EditScreen
from olivevib.tui.screens.page import Command, Page
from olivevib.tui.views.parameters import (
    COLUMNS,
    PARAMETERS,
    changes_of,
    parameter_rows,
    stepped,
    typed_parameter,
)
from olivevib.tui.widgets.row_table import RowTable

if TYPE_CHECKING:
    from olivevib.detection import DetectionSettings


class TuningPage(Page):
    """What a page with pictures adds to try parameters; it calls ``retake`` after a change."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "parameters", "Parameters"),
        Binding("i", "initialise", "INITIALIZE: find markers now", show=False),
        Binding("t", "run('track')", "TRACK: follow every marker", show=False),
        Binding("u", "run('reconstruct')", "STEREO 3D: positions in space", show=False),
        Binding("plus,equals_sign", "change(1)", "Parameter up", show=False, key_display="+"),
        Binding("minus", "change(-1)", "Parameter down", show=False, key_display="-"),
        Binding("ctrl+s", "keep", "Keep the parameters in trial.toml", show=False),
    ]
    detecting = False
    tried: DetectionSettings | None = None  # parameters that are not in trial.toml (yet)

    def table(self) -> DataTable[object]:
        """The pane of the parameters, hidden at first."""
        table: DataTable[object] = RowTable(id="parameters")
        table.border_title = "Parameters of the paper"
        table.border_subtitle = "+ - change · Enter types · Ctrl+S keeps them in trial.toml"
        table.add_columns(*COLUMNS)
        return table

    def retake(self) -> None:
        """Show the present picture again."""

    def action_initialise(self) -> None:
        """The paper's INITIALIZE on this picture, with the parameters of now; or the tracks."""
        self.detecting = not self.detecting
        self.retake()

    def action_parameters(self) -> None:
        """Show the parameters, or hide them again and show the tracks."""
        self.toggle_class("-tuning")
        self.detecting = self.has_class("-tuning")
        found = guarded(lambda: settings_now(self.folder)) if self.detecting else None
        self.tried = None if isinstance(found, OlivevibError) else found
        self._fill()
        self.query_one("#parameters" if self.detecting else "#whole").focus()
        self.retake()

    def _fill(self) -> None:
        table = self.query_one("#parameters", DataTable)
        at = table.cursor_row
        table.clear()
        if self.tried is not None:
            for row in parameter_rows(self.tried, self.olive.palette):
                table.add_row(*row)
            table.move_cursor(row=max(0, at))

    def action_change(self, step: int) -> None:
        """The marked parameter a step up or down."""
        if self.tried is not None:
            at = self.query_one("#parameters", DataTable).cursor_row
            self._try(stepped(self.tried, at, step))

    @on(DataTable.RowSelected, "#parameters")
    def _type(self, event: DataTable.RowSelected) -> None:
        at = event.cursor_row
        parameter, value = PARAMETERS[at], getattr(self.tried, PARAMETERS[at].name)
        screen = EditScreen(f"{parameter.sign} {parameter.name}", parameter.means, f"{value}")
        self.app.push_screen(screen, partial(self._typed, at))

    def _typed(self, at: int, text: str | None) -> None:
        tried = self.tried
        if text is not None and tried is not None:
            found = guarded(lambda: typed_parameter(tried, at, text))
            if isinstance(found, OlivevibError):
                self.olive.show_error(found)
            else:
                self._try(found)

    def _try(self, settings: DetectionSettings) -> None:
        self.tried = settings
        self._fill()
        self.retake()

    def action_keep(self) -> None:
        """Write the parameters into trial.toml; what depends on them becomes stale."""
        if self.tried is not None:
            self.save_settings(changes_of(self.tried))
            self.olive.say("The parameters are in trial.toml; t tracks with them.")

    def action_run(self, stage: str) -> None:
        """Run a stage: TRACK or STEREO 3D of the paper."""
        self.olive.start(jobs.run_one(self.folder, stage))

    def paper_commands(self) -> list[Command]:
        """The paper's own words for what can be done here."""
        words = {
            "INITIALIZE": "initialise",
            "TRACK": "run('track')",
            "STEREO 3D": "run('reconstruct')",
        }
        return [
            Command(f"{word} (of the paper)", partial(self.run_action, action))
            for word, action in words.items()
        ]
