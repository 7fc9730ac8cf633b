"""What goes wrong and what a person can do about it: errors and cautions with remedies."""

from __future__ import annotations

from dataclasses import dataclass


class OlivevibError(Exception):
    """A failure that a person can act on: what happened, why, and what to do next.

    ``exit_code`` is what the command line returns for it (1 failed, 2 wrong use).
    """

    exit_code = 1

    def __init__(self, what: str, why: str = "", remedy: str = "") -> None:
        super().__init__(what, why, remedy)
        self.what = what
        self.why = why
        self.remedy = remedy

    def __str__(self) -> str:
        return "\n".join(part for part in (self.what, self.why, self.remedy) if part)


class UsageError(OlivevibError):
    """The command or a setting was wrong: nothing was started."""

    exit_code = 2


class InputError(OlivevibError):
    """A file or recording cannot be used as it is: it names the file and the remedy."""


@dataclass(frozen=True)
class Caution:
    """A quality warning that travels with a result; ``code`` is listed in FORMAT.md."""

    code: str
    text: str
    remedy: str
