"""Results: orbits on one mm scale, the spectrum with its status word, the marker table."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.widgets import DataTable

from olivevib.tui.harmless import harmless
from olivevib.tui.loader import Results, results
from olivevib.tui.screens.page import Command, Help, Jump, Page
from olivevib.tui.views.faults import absent
from olivevib.tui.views.of_results import AXES, QUANTITIES, marker_name, orbits_of, spectrum_of
from olivevib.tui.views.old import OLD, old_words
from olivevib.tui.views.orbits import PLANES, Orbit, Plane, orbit_at, orbits_plot, page_of
from olivevib.tui.views.spectrum import SpectrumPlot, frame_of, next_peak, spectrum_plot
from olivevib.tui.views.tables import MARKER_COLUMNS, marker_row
from olivevib.tui.widgets.old_note import OldNote
from olivevib.tui.widgets.plot import Plot
from olivevib.tui.widgets.row_table import RowTable

PANES = ("orbits", "spectrum", "markers")


class ResultsPage(Page):
    """What was measured, marker by marker."""

    NAME = "results"
    HELP_TEXT = Help(
        "Orbits: the path of each marker about its mean in the steady phase, all on one mm scale; "
        "dots are samples, the curve is the dominant line. Spectrum: peak amplitude of the marked "
        "marker, logarithmic; its line carries a status. direct: no alias exists. confirmed: "
        "decided by sampling times. supported: probably so. ambiguous, aliased: any of the "
        "candidates. blind: looks like sway. chirp: the speed changes. none: nothing stands out.",
        "A shaken trunk moves 5–30 mm, branches more. A frequency can be quoted when it is "
        "direct or confirmed; velocity and acceleration are given only then. – is not known.",
    )
    JUMPS = (Jump("o", "#orbits"), Jump("s", "#spectrum"), Jump("m", "#markers"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("right_square_bracket", "marker(1)", "Next marker", key_display="]"),
        Binding(
            "left_square_bracket", "marker(-1)", "Previous marker", show=False, key_display="["
        ),
        Binding("p", "plane", "Plane"),
        Binding("a", "axis", "Axis"),
        Binding("y", "quantity", "Displacement, velocity, acceleration", show=False),
        Binding("z", "zoom", "Zoom"),
        Binding("1", "pane('orbits')", "Orbits", show=False),
        Binding("2", "pane('spectrum')", "Spectrum", show=False),
        Binding("3", "pane('markers')", "Table", show=False),
        Binding("right", "peak(1)", "Cursor to the next peak", show=False),
        Binding("left", "peak(-1)", "Cursor to the peak before", show=False),
        Binding("m", "page('motion')", "Motion", show=False),
        Binding("g", "page('spectrogram')", "Spectrogram", show=False),
        Binding("e", "page('report')", "Report", show=False),
    ]
    _results: Results | None = None
    _orbits: tuple[Orbit, ...] = ()
    _chosen = 0
    _old = ""  # since when the numbers are out of date
    _quantity = "displacement"
    _cursor_hz: float | None = None

    def body(self) -> ComposeResult:
        """The three panes; above them since when they are old."""
        yield OldNote()
        with Container(id="results"):
            yield Plot(id="orbits", title="1 Orbits")
            yield Plot(id="spectrum", title="2 Spectrum")
            yield RowTable(id="markers", zebra_stripes=True)

    def on_mount(self) -> None:
        """Orbits first."""
        table = self.query_one("#markers", DataTable)
        table.border_title = "3 Markers (x, y, z: peak of the dominant line)"
        table.add_columns(*MARKER_COLUMNS)
        self.action_pane("orbits")

    def read(self) -> Results:
        """Paths, spectra and summary from the files."""
        return results(self.folder)

    def show(self, value: object) -> None:
        """Fill the three panes."""
        if not isinstance(value, Results):
            return
        self._results = value
        path = value.trajectory
        self._old = old_words(value.summary, "reconstruct", "analyse")
        self.query_one(OldNote).say(self._old)
        self._orbits = orbits_of(path, value.vibration, value.summary) if path else ()
        ids = [o.id for o in self._orbits]
        kept = self.olive.kept.marker
        self._chosen = ids.index(kept) if kept in ids else 0
        self._fill()
        self._draw()

    def _fill(self) -> None:
        table = self.query_one("#markers", DataTable)
        table.clear()
        rows = self._results.summary["markers"] if self._results else []
        for marker in rows:
            table.add_row(*marker_row(marker, self.olive.palette, bool(self._old)))
        if rows:
            table.move_cursor(row=self._chosen)

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self._fill()
        self._draw()

    def _draw(self) -> None:
        found, plot = self._results, self._spectrum()
        if found is None:
            return
        lacking = partial(absent, found.summary, found.faults)
        orbits, spectrum = self.query_one("#orbits", Plot), self.query_one("#spectrum", Plot)
        drawn = partial(orbits_plot, self._orbits, self._plane, self._chosen)
        orbits.show(drawn if self._orbits else lacking("No path of any marker", "reconstruct"))
        line = partial(spectrum_plot, plot, self._cursor_hz) if plot else None
        spectrum.show(line or lacking("No spectrum", "analyse"))
        for pane in (orbits, spectrum):
            pane.border_subtitle = f"{OLD} {self._old}" if self._old else ""
        self.query_one("#markers").border_subtitle = self._table_words(found)

    def _table_words(self, found: Results) -> str:
        """What is to be known of the table: why it is empty, that it is old or goes on."""
        if not found.summary["markers"]:
            told = found.summary["stages"]["reconstruct"]
            return f"no markers: reconstruct is {told['state']}"
        parts = [f"{OLD} {self._old}"] if self._old else []
        parts += ["→ more columns"] if self.has_class("-narrow") else []
        return " · ".join(parts)

    @property
    def _plane(self) -> Plane:
        return PLANES[self.olive.kept.plane % len(PLANES)]

    def _spectrum(self) -> SpectrumPlot | None:
        found = self._results
        if found is None or found.vibration is None or not self._orbits:
            return None
        marker, axis = self._orbits[self._chosen].id, self.olive.kept.axis
        rate = found.summary["timing"]["left"]["frame_rate_hz"]
        name = marker_name(marker, found.places)
        axis = axis if axis in AXES else "all"
        return spectrum_of(found.vibration, marker, self._quantity, axis, rate, name)

    # -- choosing -------------------------------------------------------------------------------

    def choose(self, number: int) -> None:
        """Mark another marker in all three panes."""
        if not self._orbits:
            return
        self._chosen = number % len(self._orbits)
        self.olive.keep(marker=self._orbits[self._chosen].id)
        table = self.query_one("#markers", DataTable)
        if table.cursor_row != self._chosen:
            table.move_cursor(row=self._chosen)
        self._draw()

    @on(DataTable.RowHighlighted, "#markers")
    def _row_marked(self, event: DataTable.RowHighlighted) -> None:
        if self.focused is event.control and event.cursor_row != self._chosen:
            self.choose(event.cursor_row)

    @on(Plot.Clicked, "#orbits")
    def _orbit_clicked(self, event: Plot.Clicked) -> None:
        page = page_of(self._orbits, self._plane, self._chosen, event.plot.content_size)
        number = orbit_at(page, event.x, event.y)
        if number is not None:
            self.choose(number)

    @on(Plot.Clicked, "#spectrum")
    def _spectrum_clicked(self, event: Plot.Clicked) -> None:
        plot, size = self._spectrum(), event.plot.content_size
        frame = frame_of(plot, size.width, size.height) if plot else None
        if frame is not None:
            self._cursor_hz = frame.value_at(event.x)
            self._draw()

    def commands(self) -> list[Command]:
        """Every marker by name."""
        places = self._results.places if self._results else {}
        names = [harmless(marker_name(o.id, places), 40) for o in self._orbits]
        return [Command(f"Marker {n}", partial(self.choose, k)) for k, n in enumerate(names)]

    # -- keys -----------------------------------------------------------------------------------

    def action_marker(self, step: int) -> None:
        """The next or previous marker."""
        self.choose(self._chosen + step)

    def action_plane(self) -> None:
        """Look from the front, from above, from the side."""
        self.olive.keep(plane=(self.olive.kept.plane + 1) % len(PLANES))
        self._draw()

    def action_axis(self) -> None:
        """All axes together, x, y, z."""
        axis = self.olive.kept.axis
        at = AXES.index(axis) if axis in AXES else 0
        self.olive.keep(axis=AXES[(at + 1) % len(AXES)])
        self._draw()

    def action_quantity(self) -> None:
        """Displacement, velocity, acceleration."""
        at = QUANTITIES.index(self._quantity)
        self._quantity = QUANTITIES[(at + 1) % len(QUANTITIES)]
        self._draw()

    def action_peak(self, step: int) -> None:
        """Move the cursor to a neighbouring peak."""
        plot = self._spectrum()
        if plot is not None:
            self._cursor_hz = next_peak(plot, self._cursor_hz, step)
            self._draw()

    def action_pane(self, name: str) -> None:
        """Go to a pane; in a small terminal it takes the whole screen."""
        for pane in PANES:
            self.query_one(f"#{pane}").set_class(pane == name, "-shown")
        self.query_one(f"#{name}").focus()

    def action_zoom(self) -> None:
        """The focused pane alone, or all again; in a small terminal the next pane."""
        now = next((p for p in PANES if self.query_one(f"#{p}").has_focus), PANES[0])
        if self.has_class("-narrow"):
            now = PANES[(PANES.index(now) + 1) % len(PANES)]
        else:
            self.toggle_class("-zoomed")
        self.action_pane(now)

    def action_page(self, name: str) -> None:
        """Show another page of this trial."""
        self.olive.show_page(name, self.folder)
