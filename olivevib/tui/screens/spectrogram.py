"""How the frequencies of one marker change in time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static
from textual.worker import get_current_worker

from olivevib.tui.harmless import harmless
from olivevib.tui.loader import Results, guarded, results, shades
from olivevib.tui.screens.page import Command, Help, Jump, Page
from olivevib.tui.views.faults import absent
from olivevib.tui.views.of_results import marker_name, phases_text
from olivevib.tui.views.old import old_words
from olivevib.tui.views.spectrogram import ShadePlot, shade_plot
from olivevib.tui.widgets.old_note import OldNote
from olivevib.tui.widgets.plot import Draw, Plot

TOO_SHORT = "No spectrogram: this marker has no path of two seconds."


@dataclass(frozen=True)
class Shown:
    """The results and the plot of one marker; None where its record is too short."""

    results: Results
    plot: ShadePlot | None


class SpectrogramPage(Page):
    """Time to the right, frequency upwards."""

    NAME = "spectrogram"
    HELP_TEXT = Help(
        "How strong each frequency is in each second of the record, all three axes together, from "
        "windows of 1 s fitted on the true times of the samples. Frequencies are as the frame rate "
        "shows them: what lies above half of it folds down. Above stand the phases.",
        "A steady phase is a level bar. A slope is the machine running up or down; a bar that "
        "wanders costs resolution of the line.",
    )
    JUMPS = (Jump("g", "#shades"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("right_square_bracket", "marker(1)", "Next marker", key_display="]"),
        Binding("left_square_bracket", "marker(-1)", "Marker before", key_display="["),
        Binding("m", "page('motion')", "Motion", show=False),
    ]
    _shown: Shown | None = None

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)

    def body(self) -> ComposeResult:
        """The plot and the phases below it."""
        yield OldNote()
        yield Plot(id="shades", title="spectrogram")
        yield Static(id="numbers", markup=False)

    def on_mount(self) -> None:
        """Start in the plot."""
        self.query_one("#shades").focus()

    def read(self) -> Shown:
        """The path of the marker that was looked at last, as shades."""
        found = results(self.folder)
        return Shown(found, self._plot(found, self.olive.kept.marker))

    def _plot(self, found: Results, marker: int) -> ShadePlot | None:
        ids = _ids(found)
        marker = marker if marker in ids else ids[0] if ids else -1
        return shades(found, marker, marker_name(marker, found.places))

    def show(self, value: object) -> None:
        """Draw; say why there is nothing to draw."""
        if isinstance(value, Shown):
            self._shown = value
            pane = self.query_one("#shades", Plot)
            found = value.results
            pane.show(partial(shade_plot, value.plot) if value.plot else self._lacking(found))
            old = old_words(found.summary, "reconstruct", "analyse")
            self.query_one(OldNote).say(old)
            text = phases_text(value.results.vibration, self.olive.palette)
            self.query_one("#numbers", Static).update(text)

    def _lacking(self, found: Results) -> Draw:
        if found.trajectory is None:
            return absent(found.summary, found.faults, "No path of any marker", "reconstruct")
        return lambda size, palette: Text(TOO_SHORT, palette.muted)

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.show(self._shown)

    def commands(self) -> list[Command]:
        """Every marker by name."""
        found = self._shown.results if self._shown else None
        return [
            Command(
                f"Marker {harmless(marker_name(i, found.places), 40)}", partial(self._choose, i)
            )
            for i in _ids(found)
            if found
        ]

    def _choose(self, marker: int) -> None:
        self.olive.keep(marker=marker)
        if self._shown is not None:
            self._compute(self._shown.results, marker)

    @work(thread=True, exclusive=True, group="frame")
    def _compute(self, found: Results, marker: int) -> None:
        worker = get_current_worker()
        value = guarded(lambda: Shown(found, self._plot(found, marker)))
        if not worker.is_cancelled:
            self.post_message(self.Read(value))

    def action_marker(self, step: int) -> None:
        """The next or previous marker."""
        ids = _ids(self._shown.results if self._shown else None)
        if ids:
            at = ids.index(self.olive.kept.marker) if self.olive.kept.marker in ids else 0
            self._choose(ids[(at + step) % len(ids)])

    def action_page(self, name: str) -> None:
        """Show another page of this trial."""
        self.olive.show_page(name, self.folder)


def _ids(found: Results | None) -> list[int]:
    path = found.trajectory if found else None
    return [int(i) for i in path.ids] if path is not None else []
