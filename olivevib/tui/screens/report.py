"""Report and exports: what can be written, what is there already, its place and its contents."""

from __future__ import annotations

from dataclasses import dataclass
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
from olivevib.tui.screens.choose import ChooseScreen
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.outputs import REPORTS, Output, id_words, output_rows, preview_text
from olivevib.tui.widgets.row_table import RowTable
from olivevib.values import id_list

if TYPE_CHECKING:
    from olivevib.pipeline.export_preview import ExportPreview

Outputs = tuple[Output, ...]


@dataclass(frozen=True)
class Leaving:
    """What can leave the trial, and the markers that have paths."""

    outputs: Outputs
    ids: tuple[int, ...]


class ReportPage(Page):
    """What leaves the trial."""

    NAME = "report and exports"
    HELP_TEXT = Help(
        "The report is one page that needs no network: it says what is known, what is not, and "
        "every warning; it can be set as PDF and its figures kept as SVG files. Exports hold the "
        "3-D paths for other programs, of all markers or of those that f chooses; gaps stay gaps. "
        "Below the list stands what the marked one will hold: its size, columns, units, gaps. "
        "Files are written whole or not at all, and the same trial gives the same bytes.",
        "Make the report last: one that is older than the results says so here.",
    )
    JUMPS = (Jump("o", "#outputs"), Jump("c", "#contents"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "make", "Write", priority=False),
        Binding("e", "report", "Make the report"),
        Binding("p", "pdf", "PDF"),
        Binding("f", "markers", "Markers to export"),
    ]

    class Previewed(Message):
        """What an export will hold, or why it cannot be made."""

        def __init__(self, kind: str, found: ExportPreview | OlivevibError) -> None:
            super().__init__()
            self.kind, self.found = kind, found

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._found: Outputs = ()
        self._ids: tuple[int, ...] = ()
        self._chosen: tuple[int, ...] | None = None  # None: every marker
        self._contents: dict[str, ExportPreview | OlivevibError] = {}

    def body(self) -> ComposeResult:
        """The outputs and a preview of the marked one."""
        yield RowTable(id="outputs")
        with VerticalScroll(id="contents", classes="pane"):
            yield Static("reading …", id="preview", classes="waits", markup=False)

    def on_mount(self) -> None:
        """Start in the table."""
        table = self.query_one("#outputs", DataTable)
        table.border_title = "Report and exports"
        self.query_one("#contents").border_title = "What will be written"
        table.add_columns("kind", "state", "what it holds")
        table.focus()

    def read(self) -> Leaving:
        """Which outputs are there, of which markers."""
        from olivevib import pipeline
        from olivevib.files.exports import FORMATS
        from olivevib.trial import Trial

        trial = Trial.open(self.folder)
        newest = _newest(self.folder)
        page = self.folder / "report.html"
        places = {"report": page, "pdf": page.with_suffix(".pdf")}
        places["figures"] = page.with_name("report-figures")
        ids: tuple[int, ...] = ()
        if trial.trajectory is not None and trial.trajectory.t_s.size:
            ids = tuple(sorted(int(i) for i in trial.trajectory.ids))
            places |= {to: pipeline.export_place(trial, to) for to in FORMATS}
        found = tuple(Output(k, _near(p), _state(p, newest)) for k, p in places.items())
        return Leaving(found, ids)

    def show(self, value: object) -> None:
        """Fill the table; the cursor stays."""
        if not isinstance(value, Leaving):
            return
        self._found, self._ids, self._contents = value.outputs, value.ids, {}
        self._fill()

    def _fill(self) -> None:
        table = self.query_one("#outputs", DataTable)
        at = table.cursor_row
        table.clear()
        for row in output_rows(self._found, self.olive.palette):
            table.add_row(*row)
        table.move_cursor(row=min(at, len(self._found) - 1))
        without = "no 3-D paths yet: only the report can be made"
        only = f"exports hold {id_words(self._chosen)} only" if self._chosen else ""
        table.border_subtitle = only if self._ids else without
        self._preview()

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self._fill()

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
        found = guarded(partial(export_contents, self.folder, kind, self._chosen))
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
            self.olive.start(jobs.make_export(self.folder, self.marked.kind, self._chosen))

    def _report(self, kind: str) -> None:
        self.olive.start(jobs.make_report(self.folder, kind))

    def action_markers(self) -> None:
        """Choose the markers that exports hold."""
        if self._ids:
            every = ",".join(map(str, self._ids))
            choices = (every, *(map(str, self._ids) if len(self._ids) > 1 else ()))
            value = ",".join(map(str, self._chosen or ()))
            title = "markers to export, such as 1,2,5-9; none: all"
            self.app.push_screen(ChooseScreen(title, value, choices), self._take)

    def _take(self, text: str | None) -> None:
        if text is None:
            return
        ids = guarded(lambda: id_list(text))
        if isinstance(ids, OlivevibError):
            self.olive.show_error(ids)
            return
        self._chosen = None if not ids or set(ids) == set(self._ids) else ids
        self._contents = {}
        self._fill()

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
