"""Keys typed while a screen opens: a fast hand loses none."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from textual import events
from textual.screen import Screen

APART_S = 0.04

if TYPE_CHECKING:
    AnyScreen = Screen[Any]
else:
    AnyScreen = object  # mixed into screens and modal screens alike


class EarlyKeys(AnyScreen):
    """Mixed into screens: keeps what is typed before anything has the focus, and types it then.

    Textual calls the handlers of every base class by itself: subclasses do not call these.
    """

    _early: tuple[events.Key, ...] = ()
    _is_open = False

    def on_mount(self) -> None:
        """Type again what came too early, once everything is in its place."""
        self.call_after_refresh(self._opened)

    def on_key(self, event: events.Key) -> None:
        """Keep a key that nothing would take."""
        if not self._is_open and self.focused is None:
            event.stop()
            event.prevent_default()
            self._early = (*self._early, event)

    def _opened(self) -> None:
        self._is_open = True
        for number, event in enumerate(self._early):  # each when the one before has had its effect
            key = events.Key(event.key, event.character)
            self.set_timer(APART_S * number, partial(self.app.post_message, key))
        self._early = ()
