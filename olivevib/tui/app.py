"""The app: which screen is shown, the one long work that may run, the theme, what is kept."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from textual import work
from textual.app import App
from textual.binding import Binding, BindingType
from textual.command import Provider
from textual.reactive import reactive
from textual.screen import Screen

from olivevib.errors import OlivevibError, UsageError
from olivevib.tui.commands import OlivevibCommands
from olivevib.tui.kept import Kept, read_kept, write_kept
from olivevib.tui.messages import WorkEnded, WorkTicked
from olivevib.tui.screens import make_page
from olivevib.tui.screens.error import ErrorScreen
from olivevib.tui.screens.help import help_on
from olivevib.tui.screens.jump import JumpScreen
from olivevib.tui.screens.page import Page
from olivevib.tui.screens.trials import TrialsPage
from olivevib.tui.themes import DARK, SUNLIGHT, THEMES, palette_of
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.progress import Progress
from olivevib.tui.work import Ended, PostedTick, Said, Work, perform


class OlivevibApp(App[None]):
    """olivevib in the terminal; ``workspace`` is the folder that holds ``trials/``."""

    TITLE = "olivevib"
    CSS_PATH = "app.tcss"
    COMMANDS: ClassVar[set[type[Provider] | Callable[[], type[Provider]]]] = {OlivevibCommands}
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]  # noqa: RUF012 (as Textual has it)
    VERTICAL_BREAKPOINTS = [(0, "-low"), (30, "-high")]  # noqa: RUF012
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("j", "jump", "Jump to a pane", show=False),
        Binding("question_mark,f1", "help", "Help", key_display="?"),
        Binding("l", "sunlight", "Light theme on/off", show=False),
        Binding("q", "quit", "Quit", show=False),
    ]

    progress: reactive[Progress | None] = reactive(None)
    cancelling: reactive[bool] = reactive(False)
    said: reactive[Said | None] = reactive(None)  # how the last work ended, with the next key
    revision: reactive[int] = reactive(0)  # counts what work has changed on the disk

    def __init__(self, workspace: Path) -> None:
        super().__init__()
        self.workspace = workspace
        self.kept = read_kept(workspace)
        self.trials: tuple[Path, ...] = ()
        self._cancel = threading.Event()
        self._leaving = False
        for theme in THEMES:
            self.register_theme(theme)
        self.theme = self.kept.theme if self.kept.theme in self.available_themes else DARK

    def get_default_screen(self) -> Screen[Any]:
        """The list of trials."""
        return TrialsPage(self.workspace)

    def on_mount(self) -> None:
        """Go on where the person left off."""
        folder = self.workspace / "trials" / self.kept.trial
        if self.kept.trial and self.kept.screen and (folder / "trial.toml").is_file():
            self.open(folder, self.kept.screen)

    @property
    def palette(self) -> Palette:
        """The plot styles of the present theme."""
        return palette_of(self.current_theme)

    def open(self, folder: Path, page: str = "trial") -> None:
        """Show a page of a trial over the list of trials; the trial's own page stands below it."""
        while len(self.screen_stack) > 1:
            self.pop_screen()
        self.push_screen(make_page("trial", folder))
        if page != "trial":
            self.push_screen(make_page(page, folder))
        self.keep(trial=folder.name, screen=page)

    def show_page(self, page: str, folder: Path) -> None:
        """Show a page of a trial over the present one."""
        self.push_screen(make_page(page, folder))
        self.keep(trial=folder.name, screen=page)

    def show_error(self, error: OlivevibError) -> None:
        """Show an error until it has been read."""
        self.push_screen(ErrorScreen(error))

    def action_help(self) -> None:
        """Explain the present screen."""
        if isinstance(self.screen, Page):
            self.push_screen(help_on(self.screen))

    def action_jump(self) -> None:
        """Put a letter on every pane of the present screen."""
        screen = self.screen
        if isinstance(screen, Page):
            panes = screen.panes()
            regions = {letter: pane.region for letter, pane in panes.items()}

            def go(letter: str | None) -> None:
                if letter:
                    panes[letter].focus()

            self.push_screen(JumpScreen(regions), go)

    def action_sunlight(self) -> None:
        """Change between the dark and the sunlight theme."""
        self.set_theme(DARK if self.theme == SUNLIGHT else SUNLIGHT)

    def set_theme(self, theme: str) -> None:
        """Change the theme and keep the choice."""
        self.theme = theme
        self.keep(theme=theme)

    def keep(self, **changes: Any) -> None:
        """Remember changes for the next start."""
        kept = self.kept.with_(**changes)
        if kept != self.kept:
            self.kept = kept
            self._write_kept(kept)

    @work(thread=True, group="kept")
    def _write_kept(self, kept: Kept) -> None:
        write_kept(self.workspace, kept)

    def is_free(self) -> bool:
        """Whether work can start now; says so where it cannot."""
        if self.progress is not None:
            what, remedy = f"{self.progress.title} is running.", "Wait for it, or cancel with Esc."
            self.show_error(UsageError(what, "One work runs at a time.", remedy))
        return self.progress is None

    def start(self, job: Work) -> None:
        """Do long work in a thread; one at a time."""
        if self.is_free():
            self._cancel.clear()
            self.cancelling, self.said = False, None
            self.progress = Progress(job.title, "starting", 0, None)
            self._perform(job)

    @work(thread=True, exclusive=True, group="work")
    def _perform(self, job: Work) -> None:
        tick = PostedTick(job.title, lambda p: self.post_message(WorkTicked(p)), self._cancel)
        self.post_message(WorkEnded(perform(job, tick)))

    def on_work_ticked(self, message: WorkTicked) -> None:
        """Show how far the work is."""
        if self.progress is not None:
            self.progress = message.progress

    def on_work_ended(self, message: WorkEnded) -> None:
        """Say how the work ended; every screen reads its files again."""
        self.progress = None
        self.revision += 1
        if self._leaving:
            self.exit()
        else:
            self._tell(message.ended)

    def _tell(self, ended: Ended) -> None:
        if ended.error is not None:
            self.show_error(ended.error)
        elif ended.cancelled:
            words = "Cancelled; finished work is kept. The same key goes on from there."
            self.say(words)
        elif ended.result is not None:
            result = ended.result
            self.say(result.words, result.warns or bool(result.cautions))
            if result.opens is not None:
                self.open(result.opens)

    def say(self, words: str, warned: bool = False) -> None:
        """Say an outcome on the line of work of every screen, where it covers nothing."""
        self.said = Said(words, warned)

    def action_cancel_work(self) -> None:
        """Ask the work to stop at its next step."""
        if self.progress is not None:
            self.cancelling = True
            self._cancel.set()

    def on_unmount(self) -> None:
        """However the app ends, its thread ends too, at the next safe place."""
        self._cancel.set()

    async def action_quit(self) -> None:
        """Leave; work that runs is stopped first, and what it finished is kept."""
        if self.progress is None:
            self.exit()
        self._leaving = True
        self.action_cancel_work()
