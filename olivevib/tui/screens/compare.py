"""Camera against accelerometer: overlay, residual, offset, rotation, verdict."""

from __future__ import annotations

from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.widgets import Static

from olivevib.comparison import Comparison
from olivevib.tui.loader import Results, results
from olivevib.tui.screens.page import Help
from olivevib.tui.screens.time_page import TimePage
from olivevib.tui.views.faults import absent
from olivevib.tui.views.motion import MotionPlot
from olivevib.tui.views.of_results import comparison_of
from olivevib.tui.views.old import old_words
from olivevib.tui.views.tables import comparison_text, not_compared_text
from olivevib.tui.widgets.old_note import OldNote
from olivevib.tui.widgets.plot import Draw, nothing


class ComparePage(TimePage):
    """One sensor at a time."""

    NAME = "camera against accelerometer"
    HELP_TEXT = Help(
        "The motion of a marker as the cameras saw it, and over it that of the accelerometer "
        "fixed beside it, on the trial clock and in the camera's axes. Clock offset is the "
        "sensor's stamp minus the trial clock; gain is camera over sensor.",
        "agrees: gain within two sigma of 1, coherence above 0.95, no rival lag near. Look at "
        "the residual (d): it should look like noise, not like the motion.",
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("d", "residual", "Difference"),
        Binding("right_square_bracket", "sensor(1)", "Next sensor", key_display="]", show=False),
        Binding("left_square_bracket", "sensor(-1)", "Sensor before", key_display="[", show=False),
    ]
    _results: Results | None = None
    _at = 0
    _residual = False

    def read(self) -> Results:
        """The comparisons from the files."""
        return results(self.folder)

    def show(self, value: object) -> None:
        """Draw the first sensor, or say why there is none."""
        if isinstance(value, Results):
            self._results = value
            old = old_words(value.summary, "compare")
            self.query_one(OldNote).say(old)
            self.draw()

    def lacking(self) -> Draw:
        """Why there is no comparison."""
        found = self._results
        if found is None:
            return nothing
        return absent(found.summary, found.faults, "No comparison", "compare")

    @property
    def _one(self) -> Comparison | None:
        found = self._results.comparisons if self._results else ()
        return found[self._at % len(found)] if found else None

    def plot(self) -> MotionPlot | None:
        """Overlay or residual of the chosen sensor."""
        return comparison_of(self._one, self._residual) if self._one else None

    def draw(self) -> None:
        """Curves, and the numbers below them."""
        super().draw()
        palette = self.olive.palette
        if self._one is not None:
            text = comparison_text(self._one, palette)
        else:
            text = not_compared_text(self._results.summary if self._results else {}, palette)
        self.query_one("#numbers", Static).update(text)

    def action_residual(self) -> None:
        """Overlay or difference."""
        self._residual = not self._residual
        self.draw()

    def action_sensor(self, step: int) -> None:
        """The next or previous sensor."""
        self._at += step
        self.draw()
