"""What pages with curves over time have in common: zoom, move along, whole record again."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from olivevib.tui.screens.page import Jump, Page
from olivevib.tui.views.axes import LEFT
from olivevib.tui.views.motion import MotionPlot, motion_plot, window
from olivevib.tui.widgets.old_note import OldNote
from olivevib.tui.widgets.plot import Draw, Plot, nothing

MOST_ZOOM = 10
STEP = 0.25  # of the stretch on screen


class TimePage(Page):
    """Subclasses give the plot (``plot``) and the words below it (``words``)."""

    JUMPS = (Jump("p", "#curves"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("plus,equals_sign,up", "zoom(1)", "Zoom in", key_display="+"),
        Binding("minus,down", "zoom(-1)", "Zoom out", key_display="-", show=False),
        Binding("right", "along(1)", "Later", show=False),
        Binding("left", "along(-1)", "Earlier", show=False),
        Binding("home,0", "whole", "Whole record", show=False),
    ]
    _zoom = 0
    _centre_s: float | None = None

    def body(self) -> ComposeResult:
        """The curves and the numbers below them."""
        yield OldNote()
        yield Plot(id="curves", title=self.NAME)
        yield Static(id="numbers", markup=False)

    def on_mount(self) -> None:
        """Start in the plot."""
        self.query_one("#curves").focus()

    def plot(self) -> MotionPlot | None:
        """What to draw now; None while nothing is known."""
        return None

    def lacking(self) -> Draw:
        """What stands where the curves would be, as long as there are none."""
        return nothing

    def draw(self) -> None:
        """Draw the present stretch."""
        plot = self.plot()
        pane = self.query_one("#curves", Plot)
        pane.show(partial(motion_plot, plot, self._window(plot)) if plot else self.lacking())

    def _window(self, plot: MotionPlot) -> tuple[float, float]:
        return window(plot, self._zoom, self._centre_s)

    def recolour(self) -> None:
        """Draw again in the new theme."""
        self.draw()

    @on(Plot.Clicked, "#curves")
    def _clicked(self, event: Plot.Clicked) -> None:
        """A click zooms in about the instant that was clicked."""
        plot = self.plot()
        if plot is not None:
            start, end = self._window(plot)
            width = max(1, event.plot.content_size.width - LEFT - 2)
            self._centre_s = start + (event.x - LEFT - 1) / width * (end - start)
            self.action_zoom(1)

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """The wheel zooms in."""
        self.action_zoom(1)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """The wheel zooms out."""
        self.action_zoom(-1)

    def action_zoom(self, step: int) -> None:
        """Half or twice the stretch."""
        self._zoom = min(MOST_ZOOM, max(0, self._zoom + step))
        self.draw()

    def action_along(self, step: int) -> None:
        """Move along by a quarter of the stretch."""
        plot = self.plot()
        if plot is not None:
            start, end = self._window(plot)
            self._centre_s = (start + end) / 2 + step * STEP * (end - start)
            self.draw()

    def action_whole(self) -> None:
        """The whole record."""
        self._zoom, self._centre_s = 0, None
        self.draw()
