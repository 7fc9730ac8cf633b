"""Both cameras while they run: pictures with markers, what to do now, and the verdict after."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.message import Message
from textual.widgets import Static

from olivevib.tui.capturing import Recorded, Recording
from olivevib.tui.frames import SIDES
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.live import live_outlines, prompt_text, state_text, verdict_text
from olivevib.tui.views.picture import Window
from olivevib.tui.widgets.picture import Picture

if TYPE_CHECKING:
    from olivevib.pipeline.capture import CaptureState


MAP_LINES = 10  # what to show, numbers, the map, the frame


class LivePage(Page):
    """Shows a capture; whatever happens here, what was recorded is kept."""

    NAME = "live"
    HELP_TEXT = Help(
        "Both cameras now. Space starts the recording and ends it; Esc ends it too, and what was "
        "recorded is kept. A bracket with its id stands about every marker that is seen, dots on "
        "the board. The prompts follow the motion in the pictures: rest, start the shaker, steady, "
        "stop, wait for the decay.",
        "Every marker in both pictures, blur below 1.6 px, white 110–240 and hardly anything "
        "saturated, no frame lost; cameras a quarter of a frame apart tell most above half the "
        "frame rate.",
    )
    JUMPS = (Jump("l", "#left-live"), Jump("r", "#right-live"), Jump("s", "#state-pane"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "record", "Record, end"),
        Binding("o", "camera", "Other camera"),
        Binding("enter", "open", "Open the trial"),
    ]

    class Seen(Message):
        """The capture has come further."""

        def __init__(self, state: CaptureState) -> None:
            super().__init__()
            self.state = state

    class Over(Message):
        """The capture is over."""

        def __init__(self, recorded: Recorded) -> None:
            super().__init__()
            self.recorded = recorded

    def __init__(self, workspace: Path, recording: Recording) -> None:
        super().__init__(workspace)
        self._recording = recording
        self._recorded: Recorded | None = None
        self._state: CaptureState | None = None

    def body(self) -> ComposeResult:
        """What to do now, both pictures, the numbers."""
        yield Static("the cameras are being opened …", id="prompt", markup=False)
        with Horizontal(id="live"):
            for side in SIDES:
                yield Picture(id=f"{side}-live", title=f"{side} camera")
        with VerticalScroll(id="state-pane", classes="pane"):
            yield Static("", id="state", markup=False)

    def on_mount(self) -> None:
        """Run the cameras."""
        self.query_one("#state-pane").border_title = "What is measured"
        for side in SIDES:
            self.query_one(f"#{side}-live", Picture).say("no picture yet")
        self.query_one("#left-live").focus()
        self._recording.seen = lambda state: self.post_message(self.Seen(state))
        self._recording.over = lambda recorded: self.post_message(self.Over(recorded))
        self.olive.start(self._recording.work)

    @on(Seen)
    def _seen(self, message: Seen) -> None:
        self._state = message.state
        self._draw()

    def _draw(self) -> None:
        state, palette = self._state, self.olive.palette
        if state is None or self._recorded is not None:
            return
        self.query_one("#prompt", Static).update(prompt_text(state, palette))
        self.query_one("#state", Static).update(state_text(state, palette))
        if state.coverage is not None:  # the map of a board takes seven lines
            self.query_one("#state-pane").styles.min_height = MAP_LINES
        for side, camera in state.cameras.items():
            pane = self.query_one(f"#{side}-live", Picture)
            pane.border_title = f"{side} camera · {camera.facts.title}"[:60].replace("[", "(")
            if camera.picture is not None and pane.display:
                height, width = camera.picture.shape
                window = Window(0, 0, width, height)
                pane.show(camera.picture, window, live_outlines(camera))

    @on(Over)
    def _over(self, message: Over) -> None:
        self._recorded = message.recorded
        self.recolour()

    def recolour(self) -> None:
        """Draw again in the new theme."""
        done = self._recorded
        if done is None:
            self._draw()
            return
        board = self._recording.told.plan.board is not None
        next_ = (
            "Enter opens the trial."
            if done.trial
            else "Esc, then record the tree into the same trial."
            if board
            else "No trial was made of it."
        )
        self.query_one("#prompt", Static).update("The recording is closed and safe.")
        text = verdict_text(done.words, done.cautions, next_, self.olive.palette)
        self.query_one("#state", Static).update(text)
        self.query_one("#state-pane").border_title = "Verdict"

    # -- keys -----------------------------------------------------------------------------------

    def action_record(self) -> None:
        """Start the recording; once it runs, end it."""
        if self._state is None or self.olive.progress is None:
            return
        if self._state.recording:
            self._recording.end()
        else:
            self._recording.begin()

    def action_camera(self) -> None:
        """In a small terminal: the other picture."""
        self.toggle_class("-zoomed")
        self._draw()

    def action_open(self) -> None:
        """Open the trial that was made."""
        if self._recorded is not None and self._recorded.trial is not None:
            self.olive.open(self._recorded.trial)
