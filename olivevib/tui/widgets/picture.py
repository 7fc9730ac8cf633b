"""A pane that shows a grey picture with brackets, ids and trails."""

from __future__ import annotations

from collections.abc import Sequence

from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from olivevib.arrays import Grey
from olivevib.tui.harmless import harmless
from olivevib.tui.views.picture import Outline, Window, fitting, picture


class Picture(Widget, can_focus=True):
    """The window of a picture, as large as fits undistorted; says which pixel was clicked."""

    class Clicked(Message):
        """The pixel (x, y) that was clicked."""

        def __init__(self, x: float, y: float) -> None:
            super().__init__()
            self.x, self.y = x, y

    def __init__(self, *, id: str, title: str) -> None:
        super().__init__(id=id, classes="pane")
        self.border_title = title
        self._shown: tuple[Grey, Window, Sequence[Outline]] | None = None
        self._words = "reading …"
        self._strips: list[Strip] = []

    def show(self, grey: Grey, window: Window, outlines: Sequence[Outline]) -> None:
        """Show a part of a picture."""
        self._shown = (grey, window, outlines)
        self._redraw()

    def say(self, words: str) -> None:
        """Show words in place of a picture."""
        self._shown, self._words = None, harmless(words, 400)
        self._redraw()

    def on_resize(self) -> None:
        """Draw for the new size."""
        self._redraw()

    def _redraw(self) -> None:
        self._strips = self._drawn()
        self.refresh()

    def _drawn(self) -> list[Strip]:
        if self._shown is None:
            return []
        grey, window, outlines = self._shown
        size = fitting(window, self.content_size.width, self.content_size.height)
        return picture(grey, window, size, outlines) if all(size) else []

    def render_line(self, y: int) -> Strip:
        """One row of the picture; words where there is none."""
        width = self.content_size.width
        if self._shown is None:
            from rich.segment import Segment

            text = self._words[y * width : (y + 1) * width] if width else ""
            return Strip([Segment(text.ljust(width), self.rich_style)], width)
        if y < len(self._strips):
            return self._strips[y].adjust_cell_length(width, self.rich_style)
        return Strip.blank(width, self.rich_style)

    def on_click(self, event: events.Click) -> None:
        """Tell the screen which pixel was clicked."""
        offset = event.get_content_offset(self)
        if offset is None or self._shown is None or not self._strips:
            return
        window = self._shown[1]
        across = (offset.x + 0.5) / self._strips[0].cell_length * window.width
        down = (offset.y + 0.5) / len(self._strips) * window.height
        self.post_message(self.Clicked(window.x + across, window.y + down))
