"""Report and exports: what can be written, what is there already, and its place."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, NamedTuple

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Static

from olivevib.tui import jobs
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.outputs import Output, extent_words, output_rows, preview_text


class Outputs(NamedTuple):
    """What the page shows."""

    rows: tuple[Output, ...]
    extent: str


class ReportPage(Page):
    """What leaves the trial."""

    NAME = "report and exports"
    HELP_TEXT = Help(
        "The report is one page that needs no network: it says what is known, what is not, and "
        "every warning. Exports hold the 3-D paths for other programs; gaps stay gaps. Files are "
        "written whole or not at all, and the same trial gives the same bytes.",
        "Make the report last: one that is older than the results says so here.",
    )
    JUMPS = (Jump("o", "#outputs"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "make", "Write", priority=False),
        Binding("e", "report", "Make the report"),
    ]
    _found: Outputs | None = None

    def body(self) -> ComposeResult:
        """The outputs and a preview of the marked one."""
        yield DataTable(id="outputs", classes="pane", cursor_type="row")
        yield Static("reading …", id="why", markup=False)

    def on_mount(self) -> None:
        """Start in the table."""
        table = self.query_one("#outputs", DataTable)
        table.border_title = "Report and exports"
        table.add_columns("kind", "state", "what it holds")
        table.focus()

    def read(self) -> Outputs:
        """Which outputs are there, and how much goes into them."""
        from olivevib import pipeline
        from olivevib.files.exports import FORMATS
        from olivevib.trial import Trial

        trial = Trial.open(self.folder)
        path = trial.trajectory
        newest = _newest(self.folder)
        places = {"report": self.folder / "report.html"}
        places |= {to: pipeline.export_place(trial, to) for to in FORMATS}
        rows = tuple(Output(k, _near(p), _state(p, newest)) for k, p in places.items())
        if path is None or not path.t_s.size:
            return Outputs(rows[:1], extent_words(0, 0, 0.0, ""))
        seconds = float(path.t_s[-1] - path.t_s[0])
        return Outputs(rows, extent_words(path.t_s.size, path.ids.size, seconds, path.frame))

    def show(self, value: object) -> None:
        """Fill the table; the cursor stays."""
        if not isinstance(value, Outputs):
            return
        self._found = value
        table = self.query_one("#outputs", DataTable)
        at = table.cursor_row
        table.clear()
        for row in output_rows(value.rows, self.olive.palette):
            table.add_row(*row)
        table.move_cursor(row=min(at, len(value.rows) - 1))
        self._preview()

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(self._found)

    @property
    def marked(self) -> Output | None:
        """The output under the cursor."""
        at = self.query_one("#outputs", DataTable).cursor_row
        rows = self._found.rows if self._found else ()
        return rows[at] if 0 <= at < len(rows) else None

    @on(DataTable.RowHighlighted, "#outputs")
    def _preview(self) -> None:
        if self.marked and self._found:
            text = preview_text(self.marked, self._found.extent, self.olive.palette)
            self.query_one("#why", Static).update(text)

    @on(DataTable.RowSelected, "#outputs")
    def action_make(self) -> None:
        """Write the marked output."""
        if self.marked is None:
            return
        if self.marked.kind == "report":
            self.action_report()
        else:
            self.olive.start(jobs.make_export(self.folder, self.marked.kind))

    def action_report(self) -> None:
        """Make the report."""
        self.olive.start(jobs.make_report(self.folder))


def _near(path: Path) -> str:
    """A path as seen from where the app was started."""
    here, whole = Path.cwd(), path.resolve()
    return str(whole.relative_to(here) if whole.is_relative_to(here) else whole)


def _newest(folder: Path) -> int:
    """When the newest result was written, ns; 0 without results."""
    return max((p.stat().st_mtime_ns for p in folder.glob("*.h5")), default=0)


def _state(path: Path, newest_ns: int) -> str:
    if not path.exists():
        return "not made"
    return "made" if path.stat().st_mtime_ns >= newest_ns else "older than the results"
