"""The row time of a camera: from a flashing lamp, or from a board that was waved."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.message import Message
from textual.widgets import Button, Input, Static

from olivevib.errors import OlivevibError
from olivevib.tui import tool_jobs
from olivevib.tui.fields import Field, FieldError, number_in
from olivevib.tui.form_words import in_form_words
from olivevib.tui.harmless import harmless
from olivevib.tui.loader import book_lines, guarded
from olivevib.tui.screens.form_page import FormPage
from olivevib.tui.screens.page import Help, Jump
from olivevib.tui.widgets.form import Form, form_rows
from olivevib.tui.work import Work


class RowTimePage(FormPage):
    """The form of ``olivevib rowtime``."""

    NAME = "row time"
    FIELDS = (
        Field("recording", "lamp recording", "video of an LED through paper at the lens", True),
        Field("led", "flashes a second", "such as 500", choices=("500", "330", "1000")),
        Field("camera", "camera", "whose it is, where the file cannot say"),
        Field("board_trial", "or a trial", "calibrated from a board that was waved"),
    )
    HELP_TEXT = Help(
        "The time from one sensor row to the next; a rolling shutter sees the rows one after the "
        "other, and frequencies above half the frame rate hang on it. Lamp: let an LED flash at a "
        "known frequency (no multiple of half the frame rate) through paper right before the "
        "lens, exposure less than half a flash; stripes must travel. Or name a trial whose board "
        "was waved in a video. What is found is kept in cameras.toml for the camera in this mode.",
        "A webcam at 720 rows reads out in 10–33 ms: 14–46 µs a row. A lamp tells it to 0.1 %.",
    )
    JUMPS: ClassVar[tuple[Jump, ...]] = (Jump("f", "#form"), Jump("o", "#found"))
    BINDINGS: ClassVar[list[BindingType]] = [Binding("ctrl+s", "measure", "Measure")]

    class Told(Message):
        """A sentence of the result."""

        def __init__(self, words: str) -> None:
            super().__init__()
            self.words = words

    def __init__(self, workspace: Path, trial: str = "") -> None:
        super().__init__(workspace)
        self._trial = trial
        self._told: list[str] = []
        self._book: tuple[str, ...] = ()

    def body(self) -> ComposeResult:
        """The form, what was found, the book of cameras."""
        with Form(id="form", classes="pane -short") as form:
            form.border_title = "Row time"
            yield from form_rows(self.FIELDS)
            yield Button("Measure", id="measure", variant="primary")
        with VerticalScroll(id="found", classes="pane") as found:
            found.border_title = "Found, and the cameras of this workspace"
            yield Static("", id="found-text", markup=False)

    def on_mount(self) -> None:
        """Start at the recording."""
        self.query_one("#board_trial", Input).value = self._trial
        self.query_one("#recording").focus()

    def offered(self, field: Field) -> tuple[str, ...]:
        """The trials by name."""
        names = tuple(folder.name for folder in self.olive.trials)
        return names if field.name == "board_trial" else field.choices

    def read(self) -> tuple[str, ...]:
        """The book of cameras."""
        return book_lines(self.folder)

    def show(self, value: object) -> None:
        """What was found, over what is kept."""
        if isinstance(value, tuple):
            self._book = value
            self._draw()

    @on(Told)
    def _heard(self, message: Told) -> None:
        self._told.append(message.words)
        self._draw()

    def _draw(self) -> None:
        out, palette = Text(), self.olive.palette
        for words in self._told:
            out.append(f"{harmless(words, 300)}\n", palette.accent)
        out.append("\nKept in cameras.toml:\n" if self._book else "\nNothing is kept here yet.")
        for line in self._book:
            out.append(f"  {harmless(line, 200)}\n")
        self.query_one("#found-text", Static).update(out)

    def action_measure(self) -> None:
        """Measure, and keep what was found."""
        job = guarded(self._job)
        if isinstance(job, OlivevibError):
            field = job.field if isinstance(job, FieldError) else None
            self.olive.show_error(in_form_words(job, self.FIELDS, field))
        else:
            self._told = []
            self.olive.start(job)

    def _job(self) -> Work:
        said = {name: text.strip() for name, text in self.values.items() if text.strip()}
        tell = lambda words: self.post_message(self.Told(words))  # noqa: E731
        if "board_trial" in said and "recording" not in said:
            from olivevib.trial.workspace import find_trial

            folder = find_trial(said["board_trial"], self.folder)
            return tool_jobs.board_row_time(folder, self.folder, tell)
        if "recording" not in said:
            remedy = "Pick it with Ctrl+O, or name a trial below."
            raise FieldError("recording", "the recording of the lamp is not named.", remedy)
        led_hz = number_in(said, "led")
        if led_hz is None:
            raise FieldError("led", "how often the lamp flashes is not said.", "Write e.g. 500.")
        video = Path(said["recording"]).expanduser()
        return tool_jobs.lamp_row_time(video, led_hz, said.get("camera", ""), self.folder, tell)
