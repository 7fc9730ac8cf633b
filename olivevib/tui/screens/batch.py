"""All trials at once: measured and reported by worker processes, a core each; a season's page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.widgets import DataTable, Static

from olivevib.tui import tool_jobs
from olivevib.tui.harmless import plain
from olivevib.tui.loader import TrialRow, trial_folders, trial_row
from olivevib.tui.screens.edit import EditScreen
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.batch import BatchLine, batch_cells, failure_words
from olivevib.tui.widgets.row_table import RowTable

if TYPE_CHECKING:
    from olivevib.batch import TrialResult


class BatchPage(Page):
    """The verb ``olivevib batch`` on the trials of this workspace."""

    NAME = "all trials"
    HELP_TEXT = Help(
        "Every marked trial is measured and reported, one worker process a core. What is up to "
        "date is passed over; what was cancelled goes on where it was. The hash is that of the "
        "results: equal wherever they were measured. A trial that fails does not stop the others. "
        "e writes a page a trial and the page of the season into reports/.",
        "No failures; warnings are read on each trial's own screen.",
    )
    JUMPS = (Jump("t", "#batch"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("r", "run", "Run all"),
        Binding("space", "mark", "Mark or not"),
        Binding("w", "workers", "Workers"),
        Binding("e", "season", "Season report"),
    ]

    class Measured(Message):
        """One trial of the batch has ended."""

        def __init__(self, result: TrialResult) -> None:
            super().__init__()
            self.result = result

    def __init__(self, workspace: Path) -> None:
        super().__init__(workspace)
        self._lines: dict[Path, BatchLine] = {}
        self._workers: int | None = None

    def body(self) -> ComposeResult:
        """The trials, and why the marked one failed."""
        yield RowTable(id="batch")
        yield Static(id="why", markup=False)

    def on_mount(self) -> None:
        """Start in the table."""
        table = self.query_one("#batch", DataTable)
        table.border_title = "All trials"
        table.add_columns("", "trial", "now", "result", "hash of the results")
        table.focus()
        self._subtitle()
        self._lines = {f: BatchLine(f.name, "…", True) for f in self.olive.trials}
        self._fill()

    def read(self) -> tuple[TrialRow, ...]:
        """Each trial with its quality word; archived ones are left out."""
        rows = (trial_row(folder) for folder in trial_folders(self.folder))
        return tuple(row for row in rows if not row.archived)

    def show(self, value: object) -> None:
        """Keep what the batch has told of each trial."""
        if isinstance(value, tuple):
            old = self._lines
            self._lines = {}
            for row in value:
                before = old.get(row.folder)
                marked = before.marked if before else True
                result = before.result if before else None
                self._lines[row.folder] = BatchLine(row.name, row.word, marked, result)
            self._fill()

    @on(Measured)
    def _measured(self, message: Measured) -> None:
        for folder, line in self._lines.items():
            if str(folder.resolve()) == message.result.folder:
                self._lines[folder] = BatchLine(line.name, line.word, line.marked, message.result)
        self._fill()

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self._fill()

    def _fill(self) -> None:
        table = self.query_one("#batch", DataTable)
        at = table.cursor_row
        table.clear()
        for line in self._lines.values():
            table.add_row(*batch_cells(line, self.olive.palette))
        table.move_cursor(row=max(0, min(at, len(self._lines) - 1)))
        self._explain()

    def _subtitle(self) -> None:
        from olivevib.batch import cores

        workers = self._workers or cores()
        self.query_one("#batch", DataTable).border_subtitle = f"workers: {workers}"

    @on(DataTable.RowHighlighted, "#batch")
    def _explain(self) -> None:
        line = self._at()
        words = failure_words(line) if line else "no trial here yet; n on the list makes one"
        self.query_one("#why", Static).update(plain(words, 400))

    def _at(self) -> BatchLine | None:
        at, lines = self.query_one("#batch", DataTable).cursor_row, list(self._lines.values())
        return lines[at] if 0 <= at < len(lines) else None

    @property
    def chosen(self) -> list[Path]:
        """The folders that are marked."""
        return [folder for folder, line in self._lines.items() if line.marked]

    def action_mark(self) -> None:
        """Take the trial under the cursor into the batch, or leave it out."""
        at = self.query_one("#batch", DataTable).cursor_row
        folders = list(self._lines)
        if 0 <= at < len(folders):
            line = self._lines[folders[at]]
            other = BatchLine(line.name, line.word, not line.marked, line.result)
            self._lines[folders[at]] = other
            self._fill()

    def action_run(self) -> None:
        """Measure and report every marked trial."""
        if self.chosen:
            show = lambda result: self.post_message(self.Measured(result))  # noqa: E731
            self.olive.start(tool_jobs.run_batch(self.chosen, self._workers, show))

    def action_season(self) -> None:
        """Write the pages of the marked trials and of their season."""
        if self.chosen:
            self.olive.start(tool_jobs.season_report(self.chosen, self.folder / "reports"))

    def action_workers(self) -> None:
        """Say how many processes may work at once."""
        hint = "processes at once; empty: one a core"
        value = "" if self._workers is None else str(self._workers)
        self.app.push_screen(EditScreen("workers", hint, value), self._set_workers)

    def _set_workers(self, text: str | None) -> None:
        if text is not None:
            self._workers = int(text) if text.strip().isdigit() and int(text) > 0 else None
            self._subtitle()
