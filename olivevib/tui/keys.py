"""The keys of a screen: what its own classes and the app bind, in the order they are declared."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from textual.binding import Binding
from textual.screen import Screen

OURS = "olivevib."


class Key(NamedTuple):
    """A key as it is shown, what it does, and the action with the node that it is run on."""

    shown: str
    words: str
    action: str
    on_app: bool


def keys_of(screen: Screen[Any]) -> list[Key]:
    """The keys that the screen and the app declare; an action stands once."""
    found: dict[str, Key] = {}
    for owner, on_app in ((screen, False), (screen.app, True)):
        for binding in _declared(type(owner)):
            shown = binding.key_display or screen.app.get_key_display(_first(binding))
            key = Key(shown, binding.description, binding.action, on_app)
            found.setdefault(binding.action, key)
    return list(found.values())


def _declared(kind: type) -> Iterator[Binding]:
    for cls in kind.__mro__:
        if cls.__module__.startswith(OURS):
            yield from (b for b in cls.__dict__.get("BINDINGS", ()) if isinstance(b, Binding))


def _first(binding: Binding) -> Binding:
    """The binding with the first of its keys alone."""
    return Binding(binding.key.split(",")[0], binding.action, binding.description)
