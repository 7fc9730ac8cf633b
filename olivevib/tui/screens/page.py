"""What all screens have in common: title, help, panes to jump to, going back, reading."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, NamedTuple, cast

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Footer, Static
from textual.worker import get_current_worker

from olivevib.errors import OlivevibError
from olivevib.tui.loader import change_trial, guarded
from olivevib.tui.screens.early import EarlyKeys
from olivevib.tui.views.faults import error_text
from olivevib.tui.widgets.title import Title
from olivevib.tui.widgets.work_line import WorkLine

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from olivevib.tui.app import OlivevibApp


class Jump(NamedTuple):
    """A pane that jump mode reaches: its letter and its selector."""

    letter: str
    selector: str


@dataclass(frozen=True)
class Help:
    """What a screen measures and what good values are, for ``?``."""

    about: str
    good: str


class Command(NamedTuple):
    """Something the command palette offers on this screen beside the keys."""

    words: str
    run: Callable[[], object]


class Page(EarlyKeys, Screen[None]):
    """A screen of one trial (or of all): subclasses say what to read and how to show it."""

    NAME: ClassVar[str] = ""
    BACK: ClassVar[bool] = True  # False: there is no screen below
    HELP_TEXT: ClassVar[Help] = Help("", "")
    JUMPS: ClassVar[tuple[Jump, ...]] = ()
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "back", "Back", show=False)]
    _shown_once = False

    class Read(Message):
        """What was read in the thread, or the error that says why not."""

        def __init__(self, value: object) -> None:
            super().__init__()
            self.value = value

    class Saved(Message):
        """A setting has been written."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    @property
    def olive(self) -> OlivevibApp:
        """The app."""
        return cast("OlivevibApp", self.app)

    def compose(self) -> ComposeResult:
        """Title, the page's own body, the line of work, the keys."""
        yield Title(self.folder.resolve().name, self.NAME, back=self.BACK)
        yield from self.body()
        yield WorkLine()
        yield Footer()

    def body(self) -> ComposeResult:
        """The page's own widgets."""
        yield from ()

    def on_mount(self) -> None:
        """Read now, and again whenever work has changed the files.

        Textual calls the handlers of base classes by itself: subclasses do not call this one.
        """
        self.watch(self.app, "revision", self.reload)
        self.watch(self.app, "theme", self.recolour, init=False)

    def reload(self) -> None:
        """Read again, in a thread; what comes is handed to ``show``."""
        self._reading(partial(guarded, self.read))

    @work(thread=True, exclusive=True, group="read")
    def _reading(self, read: Callable[[], object]) -> None:
        worker = get_current_worker()
        value = read()
        if not worker.is_cancelled:
            self.post_message(self.Read(value))

    def on_page_read(self, message: Read) -> None:
        """Show what was read; an error is shown until it is read by a person."""
        if isinstance(message.value, OlivevibError):
            self._unread(message.value)
            self.olive.show_error(message.value)
        else:
            self._shown_once = True
            self.show(message.value)

    def _unread(self, error: OlivevibError) -> None:
        """Say in every pane that still waits why nothing will come."""
        from olivevib.tui.widgets.picture import Picture
        from olivevib.tui.widgets.plot import Plot

        if self._shown_once:
            return
        words = error_text(error)
        for plot in self.query(Plot):
            plot.show(lambda size, palette: words)
        for picture in self.query(Picture):
            picture.say(str(error))
        for text in self.query(".waits").results(Static):
            text.update(words)

    def read(self) -> object:
        """Frozen values for ``show``; runs in a thread and may raise OlivevibError."""
        return None

    def show(self, value: object) -> None:
        """Show the values that ``read`` gave."""

    def save_settings(self, changes: Mapping[str, object], folder: Path | None = None) -> None:
        """Write settings into trial.toml (of ``folder``) in a thread; None takes one out.

        Every screen reads its files again; an error is shown, and then nothing was written.
        """
        self._saving(changes, folder or self.folder)

    @work(thread=True, group="save")
    def _saving(self, changes: Mapping[str, object], folder: Path) -> None:
        saved = guarded(lambda: change_trial(folder, changes))
        wrong = isinstance(saved, OlivevibError)
        self.post_message(self.Read(saved) if wrong else self.Saved())

    def on_page_saved(self) -> None:
        """A setting has been written."""
        self.olive.revision += 1

    def recolour(self) -> None:
        """The theme changed: draw again."""

    def panes(self) -> dict[str, Widget]:
        """The panes on screen by their jump letter."""
        found = {jump.letter: self.query_one(jump.selector) for jump in self.JUMPS}
        return {letter: pane for letter, pane in found.items() if pane.region.area}

    def commands(self) -> Iterable[Command]:
        """What the command palette offers here beside the keys."""
        return ()

    def action_back(self) -> None:
        """Stop what is running here; where nothing runs, go back."""
        if self.olive.progress is not None and self.query(WorkLine):
            self.olive.action_cancel_work()
        elif len(self.app.screen_stack) > 1:
            self.dismiss()
