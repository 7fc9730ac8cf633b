"""Before a trial: what cameras, markers and machine will let one measure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.containers import Vertical, VerticalScroll
from textual.message import Message
from textual.widgets import Input, Static
from textual.worker import get_current_worker

from olivevib.errors import OlivevibError
from olivevib.tui.fields import FieldError
from olivevib.tui.form_words import in_form_words
from olivevib.tui.loader import guarded
from olivevib.tui.planned import FIELDS, USUAL, planned_words
from olivevib.tui.screens.form_page import FormPage
from olivevib.tui.screens.page import Help, Jump
from olivevib.tui.widgets.form import Form, form_rows


class PlanningPage(FormPage):
    """The form of ``olivevib plan``."""

    NAME = "plan"
    FIELDS = FIELDS
    HELP_TEXT = Help(
        "What a recording like this will tell, before anybody drives to the grove. direct: no "
        "alias exists. confirmable: the sampling times will decide. ambiguous: candidates will "
        "remain. blind: no amplitude. What is not given counts as unknown, never as good. Without "
        "a frequency the whole band stands in a table.",
        "Keep the machine away from the zones to avoid; a marker of 40 px or more; frequency × "
        "exposure below 0.05; the least amplitude below what you expect.",
    )
    JUMPS: ClassVar[tuple[Jump, ...]] = (Jump("f", "#form"), Jump("o", "#outlook"))

    class Planned(Message):
        """What the plan tells, or why it is none."""

        def __init__(self, told: str | OlivevibError) -> None:
            super().__init__()
            self.told = told

    def body(self) -> ComposeResult:
        """The form, and what it amounts to."""
        with Vertical(id="plan"):
            with Form(id="form", classes="pane") as form:
                form.border_title = "Plan"
                yield from form_rows(FIELDS)
            with VerticalScroll(id="outlook", classes="pane") as outlook:
                outlook.border_title = "What it will tell"
                yield Static("", id="outlook-text", markup=False)

    def on_mount(self) -> None:
        """Begin with what the command takes where nothing is said."""
        for name, text in USUAL.items():
            self.query_one(f"#{name}", Input).value = text
        self.query_one("#fps").focus()
        self._planning(self.values)

    def changed(self, name: str) -> None:
        """Plan anew."""
        self._planning(self.values)

    @work(thread=True, exclusive=True, group="look")
    def _planning(self, values: Mapping[str, str]) -> None:
        told = guarded(lambda: planned_words(values))
        if not get_current_worker().is_cancelled:
            self.post_message(self.Planned(told))

    @on(Planned)
    def _planned(self, message: Planned) -> None:
        told = message.told
        if isinstance(told, OlivevibError):
            field = told.field if isinstance(told, FieldError) else None
            told = str(in_form_words(told, FIELDS, field))
        self.query_one("#outlook-text", Static).update(told)
