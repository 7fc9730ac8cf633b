"""Displacement of one marker over time, with the phases of the trial."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.widgets import Static

from olivevib.errors import OlivevibError
from olivevib.tui.harmless import harmless
from olivevib.tui.loader import Results, guarded, results
from olivevib.tui.screens.edit import EditScreen
from olivevib.tui.screens.page import Command, Help
from olivevib.tui.screens.time_page import TimePage
from olivevib.tui.views.faults import absent
from olivevib.tui.views.motion import MotionPlot
from olivevib.tui.views.of_results import marker_name, motion_of, phases_text
from olivevib.tui.views.old import old_words
from olivevib.tui.views.phases import HINT, Row, phases_of, typed_phases, with_steady
from olivevib.tui.widgets.old_note import OldNote
from olivevib.tui.widgets.plot import Draw, nothing


class MotionPage(TimePage):
    """x, y and z of one marker on one scale."""

    NAME = "motion"
    HELP_TEXT = Help(
        "Displacement of one marker from its mean, on the trial clock: t = 0 is the middle of "
        "the left camera's first exposure. x is right, y down, z away from the left camera. Gaps "
        "are gaps: there the marker was hidden, lost or outside. Above the curves stand the "
        "phases that were found: rest, start-up, steady, shut-down, decay. p types them by hand, w "
        "takes the stretch on screen as the steady phase; r on the trial then analyses anew.",
        "Noise at rest well below a tenth of the motion; a steady phase of 3 s or more.",
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("right_square_bracket", "marker(1)", "Next marker", key_display="]"),
        Binding("left_square_bracket", "marker(-1)", "Marker before", show=False, key_display="["),
        Binding("p", "phases", "Phases"),
        Binding("w", "steady", "This is steady"),
        Binding("g", "page('spectrogram')", "Spectrogram", show=False),
    ]
    _results: Results | None = None

    def read(self) -> Results:
        """Paths and phases from the files."""
        return results(self.folder)

    def show(self, value: object) -> None:
        """Draw the marker that was looked at last."""
        if isinstance(value, Results):
            self._results = value
            old = old_words(value.summary, "reconstruct", "analyse")
            self.query_one(OldNote).say(old)
            self.draw()
            text = phases_text(value.vibration, self.olive.palette)
            self.query_one("#numbers", Static).update(text)

    def lacking(self) -> Draw:
        """Why there is no path yet."""
        found = self._results
        if found is None:
            return nothing
        return absent(found.summary, found.faults, "No path of any marker", "reconstruct")

    @property
    def _ids(self) -> list[int]:
        path = self._results.trajectory if self._results else None
        return [int(i) for i in path.ids] if path is not None else []

    def plot(self) -> MotionPlot | None:
        """The chosen marker's displacement."""
        found, ids = self._results, self._ids
        if found is None or found.trajectory is None or not ids:
            return None
        kept = self.olive.kept.marker
        marker = kept if kept in ids else ids[0]
        return motion_of(found.trajectory, found.vibration, marker, self._words_of(marker))

    def _words_of(self, marker: int) -> str:
        return marker_name(marker, self._results.places if self._results else {})

    def commands(self) -> list[Command]:
        """Every marker by name."""
        return [
            Command(f"Marker {harmless(self._words_of(i), 40)}", partial(self._choose, i))
            for i in self._ids
        ]

    def _choose(self, marker: int) -> None:
        self.olive.keep(marker=marker)
        self.draw()

    def action_phases(self) -> None:
        """Type the phases; nothing typed lets them be found again."""
        phases = self._results.vibration.phases if self._results and self._results.vibration else ()
        screen = EditScreen("the phases, s", HINT, typed_phases(phases))
        self.app.push_screen(screen, self._phases_typed)

    def _phases_typed(self, text: str | None) -> None:
        rows = None if text is None else guarded(lambda: phases_of(text))
        if isinstance(rows, OlivevibError):
            self.olive.show_error(rows)
        elif rows is not None:
            self._save_phases(rows)

    def action_steady(self) -> None:
        """The stretch on screen is the steady phase."""
        plot, found = self.plot(), self._results
        if plot is not None and found is not None and found.vibration is not None:
            self._save_phases(with_steady(found.vibration.phases, *self._window(plot)))

    def _save_phases(self, rows: list[Row]) -> None:
        self.save_settings({"vibration.phases": [list(row) for row in rows] or None})
        words = "Phases are written; Esc, then r analyses anew."
        self.olive.say(words)

    def action_page(self, name: str) -> None:
        """Show another page of this trial."""
        self.olive.show_page(name, self.folder)

    def action_marker(self, step: int) -> None:
        """The next or previous marker."""
        ids = self._ids
        if ids:
            at = ids.index(self.olive.kept.marker) if self.olive.kept.marker in ids else 0
            self._choose(ids[(at + step) % len(ids)])
