"""All trials of the workspace: the state of their stages, a quality word, search."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.message import Message
from textual.widgets import DataTable, Input, Static
from textual.worker import get_current_worker

from olivevib.tui import jobs
from olivevib.tui.loader import STAGE_NAMES, TrialRow, trial_folders, trial_row
from olivevib.tui.screens import load_pages, make_tool
from olivevib.tui.screens.edit import EditScreen
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.trial_list import columns_of, empty_text, matching, trial_cells, why_text
from olivevib.tui.widgets.row_table import OpenTable

MOST_ROWS = 200  # of one page: a table of thousands would be slow


def whole_path(path: Path) -> str:
    """The path from the root, as a person would look for it."""
    return str(path.resolve())


class TrialsPage(Page):
    """The first screen."""

    NAME = "trials"
    BACK = False
    HELP_TEXT = Help(
        "Every trial under trials/ of this folder, with the state of its five stages: calibrate, "
        "track, reconstruct, analyse, compare. ● done · ◐ stale (an input changed since) · "
        "○ missing · ✗ failed · □ blocked by an earlier stage · – skipped, its input is not there. "
        "n makes a new trial: marker size, ids, board and more are those of the trial that was "
        "written last, and each line says so. N takes them from the marked trial, and its "
        "calibration too: for cameras that have not been moved since.",
        "Quality says the worst that is known: clean (all done, no warning), warnings, stale, "
        "unfinished, differs (from the accelerometer), failed, unreadable.",
    )
    JUMPS = (Jump("t", "#trials"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "open", "Open", priority=False),
        Binding("n", "new", "New trial"),
        Binding("slash", "search", "Search", key_display="/"),
        Binding("c", "capture", "Capture"),
        Binding("r", "run", "Run"),
        Binding("v", "results", "Results", show=False),
        Binding("N", "copy", "New trial like the marked one, with its calibration", show=False),
        Binding("g", "demo", "Make a simulated trial", show=False),
        Binding("o", "notes", "Notes", show=False),
        Binding("d", "archive", "Archive, or take back", show=False),
        Binding("h", "archived", "Show archived trials too", show=False),
        Binding("f5", "reload", "Read again", show=False),
        Binding("P", "tool('planning')", "Plan a recording", show=False),
        Binding("B", "tool('batch')", "Run many trials, season report", show=False),
        Binding("W", "tool('row_time')", "Row time of a camera", show=False),
        Binding("M", "tool('prints')", "Print markers and boards", show=False),
        Binding("L", "tool('libraries')", "Marker libraries", show=False),
        Binding("D", "tool('machine')", "What works on this machine", show=False),
    ]

    class RowRead(Message):
        """One trial has been read."""

        def __init__(self, row: TrialRow) -> None:
            super().__init__()
            self.row = row

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._rows: dict[Path, TrialRow] = {}
        self._shown: list[Path] = []
        self._all = False

    def body(self) -> ComposeResult:
        """Search, table, why the marked trial is as it is; or what to do first."""
        yield Input(placeholder="part of a name, place or quality word", id="search")
        yield OpenTable(id="trials", zebra_stripes=True)
        yield Static(id="why", markup=False)
        yield Static(id="empty", markup=False)

    def on_mount(self) -> None:
        """Start with the table; the search takes no keys while it is hidden."""
        self.query_one("#search").can_focus = False
        self.query_one("#trials").border_title = "Trials"
        self.query_one("#trials").focus()

    # -- reading --------------------------------------------------------------------------------

    def reload(self) -> None:
        """Read the names, then each trial, in a thread."""
        self._read_trials()

    @work(thread=True, exclusive=True, group="read")
    def _read_trials(self) -> None:
        worker = get_current_worker()
        folders = trial_folders(self.folder)
        self.post_message(self.Read(folders))
        for folder in folders:
            row = trial_row(folder)
            if worker.is_cancelled:
                return
            self.post_message(self.RowRead(row))
        load_pages()  # so that the next key need not wait for what its page needs

    def show(self, value: object) -> None:
        """The names are known; the states follow."""
        folders = tuple(value) if isinstance(value, tuple) else ()
        self.olive.trials = folders
        self._rows = {f: self._rows.get(f) or TrialRow(f, f.name) for f in folders}
        self.set_class(not folders, "-empty")
        here = (self.folder / "trials").is_dir()
        words = empty_text(whole_path(self.folder), here, self.olive.palette)
        self.query_one("#empty", Static).update(words)
        self._fill()

    @on(RowRead)
    def _row_read(self, message: RowRead) -> None:
        row = message.row
        was = self._rows.get(row.folder)
        self._rows[row.folder] = row
        if row.archived and not self._all and (was is None or not was.archived):
            self._fill()
        if row.folder in self._shown:
            table = self.query_one("#trials", DataTable)
            at = self._shown.index(row.folder)
            for column, cell in enumerate(self._cells(row)):
                table.update_cell_at(Coordinate(at, column), cell, update_width=True)
            self._explain()

    # -- the table ------------------------------------------------------------------------------

    def _cells(self, row: TrialRow) -> tuple[Text, ...]:
        return trial_cells(row, self.size.width, self.olive.palette)

    def _fill(self) -> None:
        table = self.query_one("#trials", DataTable)
        marked = self.marked or self.folder / "trials" / self.olive.kept.trial
        rows = [row for row in self._rows.values() if self._all or not row.archived]
        hidden = len(self._rows) - len(rows)
        found = matching(rows, self.query_one("#search", Input).value)
        self._shown = [row.folder for row in found[:MOST_ROWS]]
        table.clear(columns=True)
        table.add_columns(*columns_of(self.size.width, STAGE_NAMES))
        for row in found[:MOST_ROWS]:
            table.add_row(*self._cells(row))
        more = len(found) - len(self._shown)
        parts = [f"{more} more: search with /"] if more else []
        parts += [f"{hidden} archived: h shows them"] if hidden else []
        table.border_subtitle = " · ".join(parts)
        if marked in self._shown:
            table.move_cursor(row=self._shown.index(marked))
        if self.focused is None and self._shown:
            table.focus()
        self._explain()

    @property
    def marked(self) -> Path | None:
        """The trial under the cursor."""
        at = self.query_one("#trials", DataTable).cursor_row
        return self._shown[at] if 0 <= at < len(self._shown) else None

    def _explain(self) -> None:
        row = self._rows.get(self.marked) if self.marked else None
        text = why_text(row, self.olive.palette) if row else Text("nothing matches; Esc clears")
        self.query_one("#why", Static).update(text)

    def recolour(self) -> None:
        """Draw the rows in the new theme."""
        self._fill()

    def on_resize(self) -> None:
        """The columns depend on the width."""
        if self._rows:
            self._fill()

    @on(DataTable.RowHighlighted, "#trials")
    def _moved(self) -> None:
        self._explain()

    @on(DataTable.RowSelected, "#trials")
    def _selected(self) -> None:
        self.action_open()

    # -- keys -----------------------------------------------------------------------------------

    def action_open(self) -> None:
        """Open the marked trial."""
        if self.marked:
            self.olive.open(self.marked)

    def action_results(self) -> None:
        """Open the results of the marked trial."""
        if self.marked:
            self.olive.open(self.marked, "results")

    def action_run(self) -> None:
        """Run every missing or stale stage of the marked trial."""
        if self.marked:
            self.olive.start(jobs.run_all(self.marked))

    def action_reload(self) -> None:
        """Read the folder again."""
        self.reload()

    def action_archived(self) -> None:
        """Show archived trials too, or not."""
        self._all = not self._all
        self._fill()

    def action_archive(self) -> None:
        """Take the marked trial out of the list, or back into it; nothing on the disk moves."""
        row = self._rows.get(self.marked) if self.marked else None
        if row is not None:
            self.save_settings({"session.archived": None if row.archived else True}, row.folder)

    def action_notes(self) -> None:
        """Write down what should be known later of the marked trial."""
        row = self._rows.get(self.marked) if self.marked else None
        if row is not None:
            hint = "anything worth knowing later; stands in the report"
            screen = EditScreen(f"notes on {row.name}", hint, row.notes)
            self.app.push_screen(screen, partial(self._noted, row.folder))

    def _noted(self, folder: Path, text: str | None) -> None:
        if text is not None:
            self.save_settings({"session.notes": text}, folder)

    def action_demo(self) -> None:
        """Make a simulated trial with known truth."""
        self.olive.start(jobs.make_demo(self.folder))

    def action_tool(self, name: str) -> None:
        """Show a page about the workspace."""
        self.app.push_screen(make_tool(name, self.folder))

    def action_new(self) -> None:
        """Make a new trial from recordings."""
        from olivevib.tui.screens.new_trial import NewTrialPage

        self.app.push_screen(NewTrialPage(self.folder))

    def action_capture(self) -> None:
        """Record a trial with cameras at this computer."""
        from olivevib.tui.screens.capture import CapturePage

        self.app.push_screen(CapturePage(self.folder))

    def action_copy(self) -> None:
        """Make a new trial with the settings of the marked one."""
        from olivevib.tui.screens.new_trial import NewTrialPage

        self.app.push_screen(NewTrialPage(self.folder, self.marked))

    def action_search(self) -> None:
        """Type part of a name."""
        search = self.query_one("#search", Input)
        search.add_class("-shown")
        search.can_focus = True
        search.focus()

    @on(Input.Changed, "#search")
    def _searched(self) -> None:
        self._fill()

    @on(Input.Submitted, "#search")
    def _found(self) -> None:
        self.query_one("#trials").focus()

    def action_back(self) -> None:
        """Stop what runs; else leave the search."""
        search = self.query_one("#search", Input)
        if self.olive.progress is not None:
            self.olive.action_cancel_work()
        elif search.has_class("-shown"):
            search.value = ""
            search.remove_class("-shown")
            search.can_focus = False
            self.query_one("#trials").focus()
