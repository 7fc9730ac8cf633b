"""The line above results that are out of date."""

from __future__ import annotations

from textual.widgets import Static

from olivevib.tui.views.old import OLD


class OldNote(Static):
    """Hidden as long as the numbers below it are of the present files and settings."""

    def __init__(self) -> None:
        super().__init__("", id="old", markup=False)
        self.display = False

    def say(self, words: str) -> None:
        """Mark what stands below as old; "" takes the mark away."""
        self.display = bool(words)
        self.update(f"{OLD} OLD NUMBERS, {words}: Esc, then r measures anew." if words else "")
