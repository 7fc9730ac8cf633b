"""Marker libraries: how the markers look, what is proved of their codes, and a new one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.message import Message
from textual.widgets import Button, Static
from textual.worker import get_current_worker

from olivevib.errors import OlivevibError
from olivevib.tui import tool_jobs
from olivevib.tui.fields import FieldError
from olivevib.tui.form_words import in_form_words
from olivevib.tui.libraries import FIELDS, Shown, asked_for, picture_file, shown
from olivevib.tui.loader import guarded
from olivevib.tui.screens.form_page import FormPage
from olivevib.tui.screens.page import Help, Jump
from olivevib.tui.widgets.form import Form, form_rows


class LibrariesPage(FormPage):
    """The forms of ``olivevib markers show``, ``check``, ``draw`` and ``generate``."""

    NAME = "marker libraries"
    FIELDS = FIELDS
    HELP_TEXT = Help(
        "A library is a set of codes that differ in many modules from one another, however a "
        "marker is turned. What is proved of it stands first, then the markers as they look. "
        "Ctrl+S writes the first one as a picture; Ctrl+G draws a new library.",
        "olive49 is 18 modules apart, mirror images included, and holds 78 markers. Fewer modules "
        "apart: more codes, and more wrong ids in bad light.",
    )
    JUMPS: ClassVar[tuple[Jump, ...]] = (Jump("f", "#form"), Jump("o", "#outlook"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "draw", "Picture"),
        Binding("ctrl+g", "generate", "New library"),
    ]

    class Looked(Message):
        """The library of the form, or what is wrong with it."""

        def __init__(self, told: Shown | OlivevibError, draw: bool) -> None:
            super().__init__()
            self.told, self.draw = told, draw

    def body(self) -> ComposeResult:
        """The form, and what the library is."""
        with Vertical(id="plan"):
            with Form(id="form", classes="pane") as form:
                form.border_title = "Library"
                yield from form_rows(FIELDS)
                with Horizontal(classes="buttons"):
                    yield Button("Write the picture", id="draw")
                    yield Button("Draw a new library", id="generate")
            with VerticalScroll(id="outlook", classes="pane") as found:
                found.border_title = "What it holds"
                yield Static("", id="outlook-text", markup=False)

    def on_mount(self) -> None:
        """Start at the library."""
        self.query_one("#library").focus()
        self._looking(self.values)

    def changed(self, name: str) -> None:
        """Look at the library anew."""
        self._looking(self.values)

    @work(thread=True, exclusive=True, group="look")
    def _looking(self, values: Mapping[str, str], draw: bool = False) -> None:
        told = guarded(lambda: shown(values, self.folder))
        if not get_current_worker().is_cancelled:
            self.post_message(self.Looked(told, draw))

    @on(Looked)
    def _looked(self, message: Looked) -> None:
        """Show it; write the picture where that was asked for."""
        told, text = message.told, self.query_one("#outlook-text", Static)
        if isinstance(told, Shown):
            text.update(told.words)
            if message.draw:
                target = picture_file(self.values, told, self.folder)
                self.olive.start(tool_jobs.draw_marker(told.library, told.ids[0], target))
            return
        error = self._in_words(told)
        text.update(str(error))
        if message.draw:
            self.olive.show_error(error)

    def _in_words(self, error: OlivevibError) -> OlivevibError:
        return in_form_words(error, FIELDS, error.field if isinstance(error, FieldError) else None)

    def action_draw(self) -> None:
        """Write the first marker as a picture."""
        self._looking(self.values, draw=True)

    def action_generate(self) -> None:
        """Draw the new library of the form."""
        asked = guarded(lambda: asked_for(self.values))
        if isinstance(asked, OlivevibError):
            self.olive.show_error(self._in_words(asked))
        else:
            self.olive.start(tool_jobs.new_library(asked[0], self.folder, asked[1]))
