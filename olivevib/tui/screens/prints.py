"""Printing: markers on sheets and calibration boards, at exact size, as PDF or SVG."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.message import Message
from textual.widgets import Button, Static
from textual.worker import get_current_worker

from olivevib.errors import OlivevibError
from olivevib.tui import tool_jobs
from olivevib.tui.fields import FieldError
from olivevib.tui.form_words import in_form_words
from olivevib.tui.harmless import harmless
from olivevib.tui.loader import guarded
from olivevib.tui.printed import FIELDS, Printed, printed
from olivevib.tui.screens.form_page import FormPage
from olivevib.tui.screens.page import Help, Jump
from olivevib.tui.widgets.form import Form, form_rows


class PrintsPage(FormPage):
    """The form of ``olivevib markers sheet`` and ``olivevib markers board``."""

    NAME = "prints"
    FIELDS = FIELDS
    HELP_TEXT = Help(
        "Markers to glue to the tree, and the board that the cameras are calibrated with, drawn at "
        "exact size: a PDF with all pages, or an SVG a page. Each marker has its id below it in "
        "words and cut lines round its white border, which must stay.",
        "Print at 100 %, never fitted to the page; the 150 mm ruler on the sheet must measure "
        "150 mm. A marker should be 40 px or more across in the picture (P plans that).",
    )
    JUMPS: ClassVar[tuple[Jump, ...]] = (Jump("f", "#form"), Jump("o", "#found"))
    BINDINGS: ClassVar[list[BindingType]] = [Binding("ctrl+s", "make", "Write the print")]

    class Looked(Message):
        """What the form describes, or what is wrong with it."""

        def __init__(self, told: Printed | OlivevibError, write: bool) -> None:
            super().__init__()
            self.told, self.write = told, write

    def body(self) -> ComposeResult:
        """The form, and what it amounts to."""
        with Form(id="form", classes="pane -short") as form:
            form.border_title = "Print"
            yield from form_rows(FIELDS)
            yield Button("Write the print", id="make", variant="primary")
        with VerticalScroll(id="found", classes="pane") as found:
            found.border_title = "What will be printed"
            yield Static("", id="found-text", markup=False)

    def on_mount(self) -> None:
        """Start at what is printed."""
        self.query_one("#what").focus()
        self._looking(self.values)

    def changed(self, name: str) -> None:
        """Look at the form anew."""
        self._looking(self.values)

    @work(thread=True, exclusive=True, group="look")
    def _looking(self, values: Mapping[str, str], write: bool = False) -> None:
        told = guarded(lambda: printed(values, self.folder))
        if not get_current_worker().is_cancelled:
            self.post_message(self.Looked(told, write))

    @on(Looked)
    def _looked(self, message: Looked) -> None:
        """Say what it is; write it where that was asked for."""
        told, text = message.told, self.query_one("#found-text", Static)
        if isinstance(told, Printed):
            text.update(f"{harmless(told.words, 300)}\n\ninto {harmless(told.target, 300)}")
            if message.write:
                self.olive.start(tool_jobs.make_prints(told.prints, told.target))
            return
        field = told.field if isinstance(told, FieldError) else None
        error = in_form_words(told, FIELDS, field)
        text.update(str(error))
        if message.write:
            self.olive.show_error(error)

    def action_make(self) -> None:
        """Write the file."""
        self._looking(self.values, write=True)
