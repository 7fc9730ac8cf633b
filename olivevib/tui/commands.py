"""The command palette: every action of the screen, every trial and marker by name, every theme."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, cast

from textual.command import DiscoveryHit, Hit, Hits, Provider
from textual.content import Content

from olivevib.tui.harmless import harmless
from olivevib.tui.keys import keys_of
from olivevib.tui.screens.page import Command, Page

if TYPE_CHECKING:
    from olivevib.tui.app import OlivevibApp


class OlivevibCommands(Provider):
    """What can be done from the screen that the palette was opened on."""

    async def discover(self) -> Hits:
        """Everything, before a letter is typed."""
        for command in self._commands():
            yield DiscoveryHit(Content(command.words), command.run, command.words)

    async def search(self, query: str) -> Hits:
        """What matches the letters typed."""
        matcher = self.matcher(query)
        for command in self._commands():
            score = matcher.match(command.words)
            if score > 0:
                yield Hit(score, Content(command.words), command.run, command.words)

    def _commands(self) -> Iterator[Command]:
        olive = cast("OlivevibApp", self.app)
        for key in keys_of(self.screen):
            node = olive if key.on_app else self.screen
            words = f"{key.words} ({key.shown})"
            yield Command(words, partial(olive.run_action, key.action, node))
        if isinstance(self.screen, Page):
            yield from self.screen.commands()
        for folder in olive.trials:
            yield Command(f"Open trial {harmless(folder.name, 80)}", partial(olive.open, folder))
        for theme in sorted(olive.available_themes):
            yield Command(f"Theme: {theme}", partial(olive.set_theme, theme))
