"""The reading of words on the command line: what was meant, and what was expected, in an error."""

from __future__ import annotations

import argparse
from typing import Any

_KINDS: dict[Any, str] = {float: "a number with a point", int: "a whole number"}


class Parser(argparse.ArgumentParser):
    """argparse whose errors name the nearest choice, and the number that is expected."""

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is None or value in action.choices:
            return
        import difflib

        choices = [str(choice) for choice in action.choices]
        near = difflib.get_close_matches(str(value), choices, n=1)
        meant = f" Did you mean {near[0]}?" if near else ""
        what = f"there is no {value}.{meant} There are: {', '.join(choices)}."
        raise argparse.ArgumentError(action, what)

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            kind = _KINDS.get(action.type)
            if kind is None:
                raise
            raise argparse.ArgumentError(action, _expected(action, arg_string, kind)) from error


def _expected(action: argparse.Action, text: str, kind: str) -> str:
    """What stands there, and what should: kind, unit and an example."""
    usual = action.default if isinstance(action.default, int | float) else None
    example = f", such as {usual:g}" if usual is not None else ""
    about = f" ({action.help})" if action.help else ""
    return f"{text!r} was given; {action.metavar or 'it'} is {kind}{example}{about}."
