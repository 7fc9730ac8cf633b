"""The recordings with their markers: one camera, and a window on one marker at the pixel scale."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

import numpy as np
from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.timer import Timer
from textual.widgets import Static
from textual.worker import get_current_worker

from olivevib.errors import OlivevibError
from olivevib.tui.frames import SIDES, FrameReader, Shot
from olivevib.tui.loader import guarded
from olivevib.tui.screens.page import Command, Help, Jump, Page
from olivevib.tui.screens.tuning import TuningPage
from olivevib.tui.views.picture import Window
from olivevib.tui.views.shot import inset_of, outlines_of, shot_words
from olivevib.tui.widgets.picture import Picture

PLAY_HZ = 3.0  # more would slow a running stage down


class PicturesPage(TuningPage):
    """What the cameras saw and what was tracked in it."""

    NAME = "pictures"
    HELP_TEXT = Help(
        "One camera's recording, with a bracket and the id about every tracked marker; beside it "
        "a window of 280 × 210 pixels about the marked one, with the trail of its last frames. "
        "Before tracking the pictures are shown alone: use them to judge light and focus. i finds "
        "the markers in this picture alone (the paper's INITIALIZE). p shows the six parameters: "
        "each change shows its effect on this picture at once; Ctrl+S keeps them, t tracks, "
        "u goes into space (STEREO 3D).",
        "A marker should be at least 40 pixels wide, its bars even grey, its white not burnt "
        "out, its edges sharp also while it moves; seen in 95 % of the frames or more.",
    )
    JUMPS = (Jump("p", "#whole"), Jump("w", "#inset"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "play", "Play"),
        Binding("o,tab", "camera", "Camera", key_display="o"),
        Binding("z", "zoom", "Window"),
        Binding("right_square_bracket", "marker(1)", "Next marker", key_display="]"),
        Binding("left_square_bracket", "marker(-1)", "Marker before", show=False, key_display="["),
        Binding("right,full_stop", "step(1)", "Next frame", show=False),
        Binding("left,comma", "step(-1)", "Frame before", show=False),
        Binding("pagedown", "step(30)", "30 frames on", show=False),
        Binding("pageup", "step(-30)", "30 frames back", show=False),
        Binding("home", "step(-1000000)", "First frame", show=False),
    ]
    _reader: FrameReader | None = None
    _shot: Shot | None = None
    _side = SIDES[0]
    _playing: Timer | None = None

    def body(self) -> ComposeResult:
        """Whole picture and window."""
        with Horizontal(id="pictures"):
            yield Picture(id="whole", title="left camera")
            yield Picture(id="inset", title="window")
        yield self.table()
        yield Static(id="why", markup=False)

    def on_mount(self) -> None:
        """Start with the whole picture."""
        self.query_one("#whole").focus()

    def on_unmount(self) -> None:
        """Release the recording."""
        if self._reader is not None:
            self._reader.close()

    def read(self) -> Shot:
        """The recordings anew, at the frame that was on screen."""
        if self._reader is not None:
            self._reader.close()
        self._reader = FrameReader(self.folder)
        return self._take(self._reader, self._side, self._shot.index if self._shot else 0)

    def _take(self, reader: FrameReader, side: str, index: int) -> Shot:
        if self.detecting:
            return reader.initialised(side, index, self.tried)
        return reader.shot(side, index)

    @work(thread=True, exclusive=True, group="frame")
    def _go(self, side: str, index: int) -> None:
        """Read a frame in a thread; one that is no longer wanted is not shown."""
        worker, reader = get_current_worker(), self._reader
        if reader is not None:
            shot = guarded(lambda: self._take(reader, side, index))
            if not worker.is_cancelled:
                self.post_message(self.Read(shot))

    def show(self, value: object) -> None:
        """Show a picture."""
        if not isinstance(value, Shot):
            return
        self._shot = value
        whole, inset = self.query_one("#whole", Picture), self.query_one("#inset", Picture)
        whole.border_title = f"{value.side} camera"
        marker = self._marker
        self.query_one("#why", Static).update(shot_words(value, marker, self.olive.palette))
        if value.grey is None:
            whole.say("this frame is damaged, or the recording ends here")
            inset.say("")
            return
        height, width = value.grey.shape
        outlines = outlines_of(value, marker)
        whole.show(value.grey, Window(0, 0, width, height), outlines)
        inset.show(value.grey, inset_of(value, marker), outlines)
        inset.border_title = f"marker {marker}" if marker is not None else "window"

    def on_page_read(self, message: Page.Read) -> None:
        """An error also stops the playing."""
        if isinstance(message.value, OlivevibError):
            self._stop()
            self.query_one("#whole", Picture).say(str(message.value))

    @property
    def _ids(self) -> list[int]:
        return [m.id for m in self._shot.markers] if self._shot else []

    @property
    def _marker(self) -> int | None:
        kept, ids = self.olive.kept.marker, self._ids
        return kept if kept in ids else ids[0] if ids else None

    @on(Picture.Clicked)
    def _clicked(self, event: Picture.Clicked) -> None:
        """A click marks the nearest marker."""
        if self._shot and self._shot.markers:
            at = np.array([event.x, event.y])
            centres = [m.corners_px.mean(axis=0) for m in self._shot.markers]
            nearest = int(np.argmin([np.hypot(*(c - at)) for c in centres]))
            self._choose(self._shot.markers[nearest].id)

    def _choose(self, marker: int) -> None:
        self.olive.keep(marker=marker)
        self.show(self._shot)

    def commands(self) -> list[Command]:
        """Every marker of the picture, and the paper's own words."""
        return self.paper_commands() + [
            Command(f"Marker {i}", partial(self._choose, i)) for i in self._ids
        ]

    # -- keys -----------------------------------------------------------------------------------

    def action_step(self, frames: int) -> None:
        """Frames on or back."""
        if self._shot is not None:
            self._go(self._side, self._shot.index + frames)

    def retake(self) -> None:
        """Show the present picture again."""
        self.action_step(0)

    def action_camera(self) -> None:
        """The other camera, at the same frame."""
        self._side = SIDES[1 - SIDES.index(self._side)]
        self.action_step(0)

    def action_marker(self, step: int) -> None:
        """The next or previous marker."""
        ids, marker = self._ids, self._marker
        if marker is not None:
            self._choose(ids[(ids.index(marker) + step) % len(ids)])

    def action_zoom(self) -> None:
        """Picture and window, the picture alone, the window alone (small: one or the other)."""
        if self.has_class("-narrow") or self.has_class("-alone"):
            self.remove_class("-alone")
            self.toggle_class("-zoomed")
        elif not self.has_class("-zoomed"):
            self.add_class("-alone")
        else:
            self.remove_class("-zoomed")

    def action_play(self) -> None:
        """Play in slow motion, or stop."""
        if self._playing is None:
            self._playing = self.set_interval(1 / PLAY_HZ, partial(self.action_step, 1))
        else:
            self._stop()

    def _stop(self) -> None:
        if self._playing is not None:
            self._playing.stop()
            self._playing = None
