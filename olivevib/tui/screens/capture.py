"""A recording with cameras at this computer: which ones, in which mode, of what."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Button, Input, Static

from olivevib.errors import OlivevibError
from olivevib.tui.capturing import FIELDS, REHEARSAL, Recording, told_of
from olivevib.tui.fields import FieldError
from olivevib.tui.form_words import in_form_words
from olivevib.tui.loader import CameraLine, camera_lines, guarded
from olivevib.tui.plan import free_name
from olivevib.tui.screens.form_page import FormPage
from olivevib.tui.screens.page import Help, Jump
from olivevib.tui.views.cameras import cameras_text
from olivevib.tui.widgets.form import Form, form_rows


class CapturePage(FormPage):
    """The form of ``olivevib capture``."""

    NAME = "capture"
    FIELDS = FIELDS
    HELP_TEXT = Help(
        "Two cameras at this computer, or two streams. What a camera sends is recorded as it is, "
        "with a time stamp and a checksum for every picture; nothing is recorded before you press "
        "Space on the next screen. Ctrl+R names the simulated cameras, to rehearse. With a board "
        "the calibration board is recorded, into the same trial, before or after the tree.",
        "1280 × 720 at 30 frames/s or more, an exposure of 2 ms or less, focus held by hand; both "
        "cameras on USB ports of their own.",
    )
    JUMPS = (Jump("f", "#form"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "run", "Run the cameras"),
        Binding("ctrl+r", "rehearse", "Rehearse"),
    ]

    def __init__(self, workspace: Path, trial: str = "") -> None:
        super().__init__(workspace)
        self._trial = trial

    def body(self) -> ComposeResult:
        """The cameras that are there, and the form."""
        yield Static("looking for cameras …", id="cameras", classes="pane", markup=False)
        with Form(id="form", classes="pane") as form:
            form.border_title = "Capture"
            yield from form_rows(FIELDS)
            yield Button("Run the cameras", id="run", variant="primary")

    def on_mount(self) -> None:
        """Start at the name."""
        self.query_one("#cameras").border_title = "Cameras at this computer"
        name = free_name(folder.name for folder in self.olive.trials)
        self.query_one("#trial", Input).value = self._trial or name
        self.query_one("#trial").focus()

    def read(self) -> tuple[CameraLine, ...]:
        """Which cameras are there."""
        return camera_lines()

    def show(self, value: object) -> None:
        """List them; where two are there, they are the left and the right one to begin with."""
        if isinstance(value, tuple):
            self.query_one("#cameras", Static).update(cameras_text(value, self.olive.palette))
            for number, side in enumerate(("left", "right")):
                field = self.query_one(f"#{side}", Input)
                if len(value) > 1 and not field.value:
                    field.value = str(number)

    def action_run(self) -> None:
        """Open both cameras and show what they see; nothing is recorded yet."""
        told = guarded(lambda: told_of(self.values))
        if isinstance(told, OlivevibError):
            field = told.field if isinstance(told, FieldError) else None
            self.olive.show_error(in_form_words(told, FIELDS, field))
        elif self.olive.is_free():
            from olivevib.tui.screens.live import LivePage

            recording = Recording(self.folder, told)
            self.app.push_screen(LivePage(self.folder, recording))

    def action_rehearse(self) -> None:
        """Name the simulated cameras."""
        for side in ("left", "right"):
            self.query_one(f"#{side}", Input).value = REHEARSAL
        seconds = self.query_one("#seconds", Input)
        seconds.value = seconds.value or "25"
