"""Report and exports: what can be written, what is there already, its place and its contents."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.message import Message
from textual.widgets import DataTable, Static
from textual.worker import get_current_worker

from olivevib.errors import OlivevibError
from olivevib.tui import jobs
from olivevib.tui.harmless import plain
from olivevib.tui.loader import export_contents, guarded
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.outputs import REPORTS, Output, output_rows, preview_text

if TYPE_CHECKING:
    from olivevib.pipeline.export_preview import ExportPreview

Outputs = tuple[Output, ...]


class ReportPage(Page):
    """What leaves the trial."""

    NAME = "report and exports"
    HELP_TEXT = Help(
        "The report is one page that needs no network: it says what is known, what is not, and "
        "every warning; it can be set as PDF and its figures kept as SVG files. Exports hold the "
        "3-D paths for other programs; gaps stay gaps. Below the list stands what the marked one "
        "will hold: its size, columns, units, gaps. Files are written whole or not at all, and "
        "the same trial gives the same bytes.",
        "Make the report last: one that is older than the results says so here.",
    )
    JUMPS = (Jump("o", "#outputs"), Jump("c", "#contents"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "make", "Write", priority=False),
        Binding("e", "report", "Make the report"),
        Binding("p", "pdf", "PDF"),
    ]

    class Previewed(Message):
        """What an export will hold, or why it cannot be made."""

        def __init__(self, kind: str, found: ExportPreview | OlivevibError) -> None:
            super().__init__()
            self.kind, self.found = kind, found

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._found: Outputs = ()
        self._contents: dict[str, ExportPreview | OlivevibError] = {}

    def body(self) -> ComposeResult:
        """The outputs and a preview of the marked one."""
        yield DataTable(id="outputs", classes="pane", cursor_type="row")
        with VerticalScroll(id="contents", classes="pane"):
            yield Static("reading …", id="preview", markup=False)

    def on_mount(self) -> None:
        """Start in the table."""
        table = self.query_one("#outputs", DataTable)
        table.border_title = "Report and exports"
        self.query_one("#contents").border_title = "What will be written"
        table.add_columns("kind", "state", "what it holds")
        table.focus()

    def read(self) -> Outputs:
        """Which outputs are there."""
        from olivevib import pipeline
        from olivevib.files.exports import FORMATS
        from olivevib.trial import Trial

        trial = Trial.open(self.folder)
        newest = _newest(self.folder)
        page = self.folder / "report.html"
        places = {"report": page, "pdf": page.with_suffix(".pdf")}
        places["figures"] = page.with_name("report-figures")
        if trial.trajectory is not None and trial.trajectory.t_s.size:
            places |= {to: pipeline.export_place(trial, to) for to in FORMATS}
        return tuple(Output(k, _near(p), _state(p, newest)) for k, p in places.items())

    def show(self, value: object) -> None:
        """Fill the table; the cursor stays."""
        if not isinstance(value, tuple):
            return
        self._found, self._contents = value, {}
        table = self.query_one("#outputs", DataTable)
        at = table.cursor_row
        table.clear()
        for row in output_rows(value, self.olive.palette):
            table.add_row(*row)
        table.move_cursor(row=min(at, len(value) - 1))
        without = "no 3-D paths yet: only the report can be made"
        table.border_subtitle = "" if len(value) > len(REPORTS) else without
        self._preview()

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(self._found)

    @property
    def marked(self) -> Output | None:
        """The output under the cursor."""
        at = self.query_one("#outputs", DataTable).cursor_row
        return self._found[at] if 0 <= at < len(self._found) else None

    @on(DataTable.RowHighlighted, "#outputs")
    def _preview(self) -> None:
        if self.marked is None:
            return
        found = self._contents.get(self.marked.kind)
        if isinstance(found, OlivevibError):
            text = plain(str(found), 400)
            text.no_wrap = False
        else:
            text = preview_text(self.marked, found, self.olive.palette)
        self.query_one("#preview", Static).update(text)
        if found is None and self.marked.kind not in REPORTS:
            self._looking(self.marked.kind)

    @work(thread=True, exclusive=True, group="look")
    def _looking(self, kind: str) -> None:
        found = guarded(partial(export_contents, self.folder, kind))
        if not get_current_worker().is_cancelled:
            self.post_message(self.Previewed(kind, found))

    @on(Previewed)
    def _previewed(self, message: Previewed) -> None:
        self._contents[message.kind] = message.found
        if self.marked is not None and self.marked.kind == message.kind:
            self._preview()

    @on(DataTable.RowSelected, "#outputs")
    def action_make(self) -> None:
        """Write the marked output."""
        if self.marked is None:
            return
        if self.marked.kind in REPORTS:
            self._report(self.marked.kind)
        else:
            self.olive.start(jobs.make_export(self.folder, self.marked.kind))

    def _report(self, kind: str) -> None:
        self.olive.start(jobs.make_report(self.folder, kind))

    def action_report(self) -> None:
        """Make the report."""
        self._report("report")

    def action_pdf(self) -> None:
        """Make the report, also as PDF."""
        self._report("pdf")


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
