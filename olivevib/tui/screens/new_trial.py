"""A new trial: recordings picked or typed, first frames shown, checked before anything is made."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import Button, Input, Label, Static
from textual.worker import get_current_worker

from olivevib.arrays import Grey
from olivevib.errors import OlivevibError
from olivevib.tui import jobs
from olivevib.tui.fields import Field
from olivevib.tui.form_words import sentence_of, taken_words
from olivevib.tui.frames import first_frame
from olivevib.tui.harmless import harmless
from olivevib.tui.loader import FormValues, form_values, guarded
from olivevib.tui.look import Look, look_at
from olivevib.tui.plan import (
    AFTER_SENSORS,
    BEFORE_SENSORS,
    form_fields,
    free_name,
    guesses,
    record_of,
    trial_name,
)
from olivevib.tui.screens.form_page import FormPage
from olivevib.tui.screens.page import Help, Jump
from olivevib.tui.sensors import PARTS, sensor_fields, sensor_line, sensor_of
from olivevib.tui.views.picture import Window
from olivevib.tui.widgets.form import Form, form_rows, say_source
from olivevib.tui.widgets.picture import Picture

SHOWN = ("left", "right")


class NewTrialPage(FormPage):
    """The form of ``olivevib new``."""

    NAME = "new trial"
    HELP_TEXT = Help(
        "Two recordings, and either two recordings of the calibration board with its description "
        "or the rig of an earlier calibration. Naming the left side fills in what lies beside it; "
        "n takes marker size, ids, board and more from the trial that was written last, N from the "
        "marked trial, and its calibration with it; each such line says so until you change it, "
        "and all of them stand below. ↑ ↓ go from line to line; Ctrl+O, or the button beside a "
        "line, picks a file or chooses a value. What is wrong with a line is told below when you "
        "leave it. Everything is checked before anything is made; recordings are copied, never "
        "moved. F2 makes room for one more accelerometer, F3 takes one out again; each is compared "
        "with its own marker, where it sat on it.",
        "Give the marker size, the ids on the tree, the shutter, the exposure and the band: "
        "without them a frequency may stay undecided and amplitudes keep the blur. All of it can "
        "be changed later (s on the trial).",
    )
    JUMPS = (Jump("f", "#form"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "make", "Make the trial"),
        Binding("f2", "add_sensor", "Add accelerometer"),
        Binding("f3", "drop_sensor", "Take an accelerometer out", show=False),
    ]

    class FrameRead(Message):
        """The first frame of one side, or why there is none."""

        def __init__(self, side: str, frame: Grey | OlivevibError) -> None:
            super().__init__()
            self.side, self.frame = side, frame

    class Looked(Message):
        """What is wrong with the form so far, or not said yet."""

        def __init__(self, looked: Look) -> None:
            super().__init__()
            self.looked = looked

    class Checked(Looked):
        """The whole form has been looked at, to make the trial that it describes."""

        def __init__(self, looked: Look, values: Mapping[str, str]) -> None:
            super().__init__(looked)
            self.values = values

    def __init__(self, workspace: Path, like: Path | None = None) -> None:
        super().__init__(workspace)
        self._like = like
        self._filled = False
        self._sensors = 1
        self._used: Mapping[str, tuple[str, ...]] = {}
        self._source = ""  # the trial that values are taken over from
        self._taken_over: dict[str, str] = {}

    def read(self) -> FormValues:
        """What the trial that was marked shares with the new one; what was said before."""
        return form_values(self.folder, self._like)

    def show(self, value: object) -> None:
        """Fill what is empty."""
        if not isinstance(value, FormValues) or self._filled:
            return
        self._used, self._filled = value.used, True
        self._source = harmless(value.source, 20)
        for name, text in value.shared.items():
            field = self.query_one(f"#{name}", Input)
            if not field.value:
                field.value = self._taken_over[name] = text
        self._say_taken()
        self._look()

    @on(Input.Changed)
    def _say_taken(self) -> None:
        """Say at each line, and below the form, what still stands as in another trial."""
        now = {n: t for n, t in self._taken_over.items() if self.values[n] == t}
        for name in self._taken_over:
            say_source(self, name, f"from {self._source}" if name in now else "")
        told = taken_words(
            self._source, [(f.label, now[f.name]) for f in self.fields if f.name in now]
        )
        self.query_one("#taken", Static).update(told)

    def body(self) -> ComposeResult:
        """First frames above, the form below."""
        with Horizontal(id="firsts"):
            yield Picture(id="left-first", title="left, first frame")
            yield Picture(id="right-first", title="right, first frame")
        with Form(id="form", classes="pane") as form:
            form.border_title = "New trial"
            yield from form_rows((*BEFORE_SENSORS, *sensor_fields(1)))
            yield from self._sensor_buttons()
            yield from form_rows(AFTER_SENSORS)
            yield Button("Make the trial", id="make", variant="primary")
        yield Static(id="taken", markup=False)
        yield Static(id="told", markup=False)

    def _sensor_buttons(self) -> ComposeResult:
        """For the mouse, below the lines of the last accelerometer."""
        with Horizontal(id="sensor-buttons"):
            yield Label("")
            for action, words in (("add_sensor", "+ one more  F2"), ("drop_sensor", "− out  F3")):
                button = Button(words, id=action, compact=True)
                button.can_focus = False
                yield button

    def on_mount(self) -> None:
        """Start at the name."""
        for side in SHOWN:
            self.query_one(f"#{side}-first", Picture).say(f"pick the {side} recording")
        name = self.query_one("#trial", Input)
        name.value = free_name(folder.name for folder in self.olive.trials)
        name.focus()

    # -- lines ----------------------------------------------------------------------------------

    def offered(self, field: Field) -> tuple[str, ...]:
        """What trials here said before, then what is usual."""
        return tuple(dict.fromkeys((*self._used.get(field.name, ()), *field.choices)))

    def start_folder(self) -> Path:
        """Beside what was named, else where a file was last picked, else here."""
        values = self.values
        named = [Path(values[f.name]).parent for f in self.fields if f.path and values[f.name]]
        return named[0] if named and named[0].is_dir() else super().start_folder()

    def changed(self, name: str) -> None:
        """A path was named: fill in its neighbours, show first frames; look at the whole form."""
        text = self.values.get(name, "").strip()
        is_path = any(f.path for f in self.fields if f.name == name)
        if is_path and text and Path(text).exists():
            for other, found in guesses(name, Path(text), self.values).items():
                self.query_one(f"#{other}", Input).value = found
            for side in SHOWN:
                self._read_first(side, self.values[side])
        self._look()

    @work(thread=True, group="first")
    def _read_first(self, side: str, path: str) -> None:
        if path and Path(path).is_file():
            frame = guarded(lambda: first_frame(Path(path)))
            if not get_current_worker().is_cancelled:
                self.post_message(self.FrameRead(side, frame))

    @on(FrameRead)
    def _first_read(self, message: FrameRead) -> None:
        pane, frame = self.query_one(f"#{message.side}-first", Picture), message.frame
        if isinstance(frame, OlivevibError):
            pane.say(str(frame))
        else:
            height, width = frame.shape
            pane.show(frame, Window(0, 0, width, height), ())
            pane.border_title = f"{message.side}, {width} × {height} px"

    # -- accelerometers ---------------------------------------------------------------------------

    @property
    def fields(self) -> tuple[Field, ...]:
        """The lines, with those of every accelerometer."""
        return form_fields(self._sensors)

    async def action_add_sensor(self) -> None:
        """Four more lines, for another accelerometer."""
        number = self._sensors + 1
        rows = form_rows(sensor_fields(number))
        await self.query_one("#form").mount_all(rows, before="#sensor-buttons")
        self._sensors = number
        self.query_one(f"#{sensor_line(number)}").focus()

    async def action_drop_sensor(self) -> None:
        """Take out the accelerometer with the cursor, else the last; the first is only emptied."""
        here = sensor_of((self.focused.id or "") if self.focused else "") or self._sensors
        for number in range(here, self._sensors + 1):
            for part in PARTS:
                later = self.query(f"#{sensor_line(number + 1, part)}").results(Input)
                line = self.query_one(f"#{sensor_line(number, part)}", Input)
                line.value = next((other.value for other in later), "")
        self.query_one(f"#{sensor_line(min(here, max(1, self._sensors - 1)))}").focus()
        if self._sensors > 1:
            last, self._sensors = self._sensors, self._sensors - 1
            for part in PARTS:
                row = self.query_one(f"#{sensor_line(last, part)}").parent
                if isinstance(row, Horizontal):
                    await row.remove()
        self._look()

    # -- looking and making -----------------------------------------------------------------------

    @work(thread=True, exclusive=True, group="look")
    def _look(self) -> None:
        """Look at what the form says so far, in a thread."""
        looked = look_at(self.values)
        if not get_current_worker().is_cancelled:
            self.post_message(self.Looked(looked))

    @on(Looked)
    def _looked(self, message: Looked) -> None:
        """Say what is wrong, or what is not said yet, below the form."""
        looked, told = message.looked, self.query_one("#told", Static)
        told.set_class(looked.error is not None, "-wrong")
        told.update(harmless(sentence_of(looked.error) if looked.error else looked.unsaid, 400))

    def action_make(self) -> None:
        """Check the form and make the trial."""
        self._checking(self.values)

    @work(thread=True, exclusive=True, group="read")
    def _checking(self, values: Mapping[str, str]) -> None:
        looked = look_at(values, whole=True)
        if not get_current_worker().is_cancelled:
            self.post_message(self.Checked(looked, values))

    @on(Checked)
    def _checked(self, message: Checked) -> None:
        """Make the trial; or say what is wrong, with the cursor in its line."""
        looked = message.looked
        if looked.error is not None:
            if looked.field:
                self.query_one(f"#{looked.field}", Input).focus()
            self.olive.show_error(looked.error)
        elif looked.plan is not None:
            name, record = trial_name(message.values), record_of(message.values)
            self.olive.start(jobs.make_trial(self.folder, name, looked.plan, record))
