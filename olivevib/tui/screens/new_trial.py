"""A new trial: recordings picked or typed, first frames shown, checked before anything is made."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.message import Message
from textual.widgets import Button, Input
from textual.worker import get_current_worker

from olivevib.arrays import Grey
from olivevib.errors import OlivevibError
from olivevib.tui import jobs
from olivevib.tui.frames import first_frame
from olivevib.tui.harmless import harmless
from olivevib.tui.loader import FormValues, form_values, guarded
from olivevib.tui.plan import (
    FIELDS,
    PATHS,
    free_name,
    guesses,
    plan_of,
    record_of,
    trial_name,
)
from olivevib.tui.screens.choose import ChooseScreen
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.screens.pick import PickScreen
from olivevib.tui.views.picture import Window
from olivevib.tui.widgets.form import form_rows, form_values_of
from olivevib.tui.widgets.picture import Picture

SHOWN = ("left", "right")


class NewTrialPage(Page):
    """The form of ``olivevib new``."""

    NAME = "new trial"
    HELP_TEXT = Help(
        "Two recordings, and either two recordings of the calibration board with its description "
        "or the rig of an earlier calibration. Naming the left side fills in what lies beside it. "
        "Everything is checked before anything is made; recordings are copied, never moved. "
        "Ctrl+O, or the button beside a line, picks a file or chooses a value.",
        "Give the marker size, the ids on the tree, the shutter and the band: without them a "
        "frequency cannot be decided. All of it can be changed later (s on the trial).",
    )
    JUMPS = (Jump("f", "#form"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+o", "pick", "Pick, choose"),
        Binding("ctrl+s", "make", "Make the trial"),
    ]

    class FrameRead(Message):
        """The first frame of one side, or why there is none."""

        def __init__(self, side: str, frame: Grey | OlivevibError) -> None:
            super().__init__()
            self.side, self.frame = side, frame

    def __init__(self, workspace: Path, like: Path | None = None) -> None:
        super().__init__(workspace)
        self._like = like
        self._used: Mapping[str, tuple[str, ...]] = {}

    def read(self) -> FormValues:
        """What the trial that was marked shares with the new one; what was said before."""
        return form_values(self.folder, self._like)

    def show(self, value: object) -> None:
        """Fill what is empty."""
        if not isinstance(value, FormValues):
            return
        self._used = value.used
        if self._like is not None:
            for name, text in value.shared.items():
                field = self.query_one(f"#{name}", Input)
                field.value = field.value or text
            name = harmless(self._like.name, 40)
            self.query_one("#form").border_subtitle = f"settings as in {name}"
            self._like = None

    def body(self) -> ComposeResult:
        """First frames above, the form below."""
        with Horizontal(id="firsts"):
            yield Picture(id="left-first", title="left, first frame")
            yield Picture(id="right-first", title="right, first frame")
        with VerticalScroll(id="form", classes="pane", can_focus=False) as form:
            form.border_title = "New trial"
            yield from form_rows(FIELDS)
            yield Button("Make the trial", id="make", variant="primary")

    def on_mount(self) -> None:
        """Start at the name."""
        for side in SHOWN:
            self.query_one(f"#{side}-first", Picture).say(f"pick the {side} recording")
        name = self.query_one("#trial", Input)
        name.value = free_name(folder.name for folder in self.olive.trials)
        name.focus()

    @property
    def values(self) -> dict[str, str]:
        """What has been typed."""
        return form_values_of(self, FIELDS)

    # -- picking --------------------------------------------------------------------------------

    def action_pick(self) -> None:
        """Pick the file, or choose the value, of the field with the cursor."""
        name = (self.focused.id or "") if self.focused else ""
        if any(field.name == name for field in FIELDS):
            self._pick(name)

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        name = (event.button.id or "").removeprefix("pick-")
        if name == "make":
            self.action_make()
        else:
            self._pick(name)

    def _pick(self, name: str) -> None:
        field = next(f for f in FIELDS if f.name == name)
        if field.path:
            self.app.push_screen(
                PickScreen(field.label, self._start()), partial(self._picked, name)
            )
        else:
            value = self.values[name]
            choices = tuple(dict.fromkeys((*self._used.get(name, ()), *field.choices)))
            self.app.push_screen(
                ChooseScreen(field.label, value, choices), partial(self._chosen, name)
            )

    def _chosen(self, name: str, text: str | None) -> None:
        if text is not None:
            field = self.query_one(f"#{name}", Input)
            field.value = text
            field.focus()

    def _start(self) -> Path:
        """Where to begin: beside what was named last, else the folder the app was started in."""
        named = [Path(self.values[p]) for p in PATHS if self.values[p]]
        return named[0].parent if named and named[0].parent.is_dir() else Path()

    def _picked(self, name: str, path: Path | None) -> None:
        if path is not None:
            field = self.query_one(f"#{name}", Input)
            field.value = str(path)
            field.focus()
            self._named(name)

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        """Enter goes to the next line."""
        self._named(event.input.id or "")
        self.focus_next(Input)

    @on(Input.Blurred)
    def _left_field(self, event: Input.Blurred) -> None:
        self._named(event.input.id or "")

    def _named(self, name: str) -> None:
        """A path was named: fill in its neighbours, show first frames."""
        text = self.values.get(name, "").strip()
        if name in PATHS and text and Path(text).exists():
            for other, found in guesses(name, Path(text), self.values).items():
                self.query_one(f"#{other}", Input).value = found
            for side in SHOWN:
                self._read_first(side, self.values[side])

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

    # -- making ---------------------------------------------------------------------------------

    def action_make(self) -> None:
        """Check the form and make the trial."""
        plan = guarded(lambda: (trial_name(self.values), plan_of(self.values)))
        if isinstance(plan, OlivevibError):
            self.olive.show_error(plan)
        else:
            name, told = plan
            record = record_of(self.values)
            self.olive.start(jobs.make_trial(self.folder, name, told, record))
