"""The calibration: where the board was seen, how well it fits, what it means in mm."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.message import Message
from textual.widgets import Static

from olivevib.tui import jobs
from olivevib.tui.loader import CalibrationFacts, calibration_facts
from olivevib.tui.screens.page import Help, Jump, Page
from olivevib.tui.views.coverage import calibration_text, coverage_plot
from olivevib.tui.views.faults import absent
from olivevib.tui.views.live import coverage_text
from olivevib.tui.views.old import old_words
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.rig import rig_plot
from olivevib.tui.views.sigma import sigma_text
from olivevib.tui.widgets.old_note import OldNote
from olivevib.tui.widgets.plot import Plot

if TYPE_CHECKING:
    from olivevib.calibration.guidance import Guidance
    from olivevib.calibration.sigma_map import SigmaMap

Told = tuple[str, int, Callable[[Palette], Text]]  # title, lines of the pane, words
SIDES = ("left", "right")
PANES = ("left-board", "right-board", "in-space")
NOT_YET = "Not calibrated yet: t runs it. trial.toml names the board recordings or a rig."
MAP_LINES = 11  # what to show, numbers, the map of the board, the frame


class CalibrationPage(Page):
    """Both cameras' coverage, where the cameras stand, and the verdict below."""

    NAME = "calibration"
    HELP_TEXT = Help(
        "Every dot is a point of the calibration board as a camera saw it; red ones lie more than "
        "three times the rms away from where the model puts them. Where no dot is, the lens is "
        "only extrapolated. The verdict is of views that the fit never saw: distances on the "
        "board, in mm and per cent. p goes through the board recordings and tells which tilts and "
        "distances are still missing; to record them live, Esc, Esc, c and name the board. "
        "S tells the sigma to expect of a marker anywhere in the working volume.",
        "Fit rms 0.1–0.3 px; distances on unused views within 0.5 mm or 0.3 %; dots in every "
        "corner of both pictures, the board tilted by 20–45°, near and far.",
    )
    JUMPS = (
        Jump("l", "#left-board"),
        Jump("r", "#right-board"),
        Jump("c", "#in-space"),
        Jump("v", "#verdict"),
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("t", "again", "Calibrate"),
        Binding("p", "preview", "Go through board"),
        Binding("S", "sigma", "Sigma"),
        Binding("o", "camera", "Next picture"),
    ]
    _found: CalibrationFacts | None = None
    _shown = 0
    _told: Told | None = None

    class Covered(Message):
        """The board recordings have been gone through further."""

        def __init__(self, guidance: Guidance) -> None:
            super().__init__()
            self.guidance = guidance

    class Mapped(Message):
        """The sigma to expect over the working volume."""

        def __init__(self, found: SigmaMap) -> None:
            super().__init__()
            self.found = found

    def body(self) -> ComposeResult:
        """Two pictures above, words below."""
        yield OldNote()
        with Horizontal(id="boards"):
            for side in SIDES:
                yield Plot(id=f"{side}-board", title=f"{side} camera")
            yield Plot(id="in-space", title="in space")
        with VerticalScroll(id="verdict", classes="pane"):
            yield Static("reading …", id="verdict-text", classes="waits", markup=False)

    def on_mount(self) -> None:
        """Left camera first."""
        self.query_one("#verdict").border_title = "Verdict"
        self.query_one("#left-board").add_class("-shown")
        self.query_one("#left-board").focus()

    def read(self) -> CalibrationFacts:
        """Residuals, rig and verdict from the files."""
        return calibration_facts(self.folder)

    def show(self, value: object) -> None:
        """Draw both pictures; say what to do where there is no calibration."""
        if not isinstance(value, CalibrationFacts):
            return
        self._found = value
        for coverage in value.coverage:
            plot = self.query_one(f"#{coverage.side}-board", Plot)
            plot.show(partial(coverage_plot, coverage))
        if value.scene is not None:
            self.query_one("#in-space", Plot).show(partial(rig_plot, value.scene))
        if not value.coverage:
            for pane in PANES:
                lacking = absent(value.summary, value.faults, "No calibration", "calibrate")
                self.query_one(f"#{pane}", Plot).show(lacking)
        self.query_one(OldNote).say(old_words(value.summary, "calibrate"))
        self._tell()

    def _tell(self) -> None:
        """The verdict; in its place what was asked for last, the coverage or the sigma."""
        pane, text = self.query_one("#verdict"), self.query_one("#verdict-text", Static)
        if self._told is not None:
            pane.border_title, pane.styles.min_height, words = self._told
            text.update(words(self.olive.palette))
        elif (found := self._found) is not None:
            parts = (found.summary, found.places, found.cautions)
            known = calibration_text(*parts, self.olive.palette) if found.coverage else NOT_YET
            text.update(known)

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(self._found)

    def action_again(self) -> None:
        """Run the stage."""
        self._told = None
        self.query_one("#verdict").border_title = "Verdict"
        self.olive.start(jobs.run_one(self.folder, "calibrate"))

    def action_preview(self) -> None:
        """Go through the board recordings: what they cover, what is still missing."""
        self.olive.start(jobs.preview_board(self.folder, self._take))

    def _take(self, guidance: Guidance) -> None:
        self.post_message(self.Covered(guidance))

    @on(Covered)
    def _covered(self, message: Covered) -> None:
        words = partial(coverage_text, message.guidance)
        self._told = ("Coverage of the board recordings", MAP_LINES, words)
        self._tell()

    def action_sigma(self) -> None:
        """The sigma of a marker over the working volume, from what the calibration knows."""
        self.olive.start(jobs.map_sigma(self.folder, self._take_sigma))

    def _take_sigma(self, found: SigmaMap) -> None:
        self.post_message(self.Mapped(found))

    @on(Mapped)
    def _mapped(self, message: Mapped) -> None:
        words = partial(sigma_text, message.found)
        self._told = ("Sigma to expect", self.size.height // 2, words)
        self._tell()
        self.query_one("#verdict").focus()

    def action_camera(self) -> None:
        """In a small terminal: the next of the three pictures."""
        self._shown = (self._shown + 1) % len(PANES)
        for pane in PANES:
            self.query_one(f"#{pane}").set_class(pane == PANES[self._shown], "-shown")
        self.query_one(f"#{PANES[self._shown]}").focus()
