"""Lines of a form: what each is called, what it offers, and the errors that name one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from olivevib.errors import UsageError

Value = TypeVar("Value")


@dataclass(frozen=True)
class Field:
    """One line of the form; ``path``: it names a file or folder that can be picked.

    choices: what is offered beside what trials of this workspace said before.
    """

    name: str
    label: str
    hint: str
    path: bool = False
    choices: tuple[str, ...] = ()


class FieldError(UsageError):
    """A line of a form that cannot be read; ``field`` is its name."""

    def __init__(self, field: str, what: str, remedy: str) -> None:
        super().__init__(what, "", remedy)
        self.field = field


def read_field(
    said: Mapping[str, str], name: str, how: Callable[[str | None], Value]
) -> Value | None:
    """What ``how`` makes of a line; a UsageError of it becomes a FieldError that names the line."""
    try:
        return how(said.get(name))
    except UsageError as error:
        raise FieldError(name, f"{said[name]!r} cannot be read.", error.remedy) from error


def number_in(said: Mapping[str, str], name: str) -> float | None:
    """The number in a field; None where it is empty, FieldError where it is none."""
    if name not in said:
        return None
    try:
        return float(said[name].replace(",", "."))
    except ValueError:
        raise FieldError(name, f"{said[name]!r} is no number.", "Write e.g. 60.") from None
