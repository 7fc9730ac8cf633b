"""A pane that shows a pure view at whatever size it has."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, cast

from rich.text import Text
from textual import events
from textual.message import Message
from textual.widget import Widget

from olivevib.tui.views.palette import Palette

if TYPE_CHECKING:
    from olivevib.tui.app import OlivevibApp

Draw = Callable[[tuple[int, int], Palette], Text]


def nothing(size: tuple[int, int], palette: Palette) -> Text:
    """The view of a pane that has not been given one."""
    return Text("reading …", palette.muted)


class Plot(Widget, can_focus=True):
    """Draws ``draw((columns, rows), palette)``; says where it was clicked."""

    class Clicked(Message):
        """The cell of the plot that was clicked."""

        def __init__(self, plot: Plot, x: int, y: int) -> None:
            super().__init__()
            self.plot, self.x, self.y = plot, x, y

        @property
        def control(self) -> Plot:
            """The plot that was clicked."""
            return self.plot

    def __init__(self, *, id: str, title: str) -> None:
        super().__init__(id=id, classes="pane")
        self.border_title = title
        self._draw: Draw = nothing

    def show(self, draw: Draw) -> None:
        """Show another view from now on."""
        self._draw = draw
        self.refresh()

    def render(self) -> Text:
        """The view at the present size and in the present theme."""
        palette = cast("OlivevibApp", self.app).palette
        return self._draw((self.content_size.width, self.content_size.height), palette)

    def on_click(self, event: events.Click) -> None:
        """Tell the screen which cell was clicked."""
        offset = event.get_content_offset(self)
        if offset is not None:
            self.post_message(self.Clicked(self, offset.x, offset.y))
