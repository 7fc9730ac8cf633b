"""The command line: one verb a step of the work; data on stdout, narration on stderr."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from olivevib.cli.parser import build_parser
from olivevib.threads import use_one_thread

if TYPE_CHECKING:
    from olivevib.cli.console import Console

    Verb = Callable[[argparse.Namespace, Console], int]

DONE, FAILED, WRONG_USE, DONE_WITH_WARNINGS, CANCELLED = 0, 1, 2, 3, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code (0, 1, 2, 3 or 130)."""
    arguments = build_parser().parse_args(argv)
    use_one_thread(os.environ)  # before a verb loads numpy
    from olivevib.cli.console import Console

    console = Console(sys.stderr, quiet=arguments.quiet)
    try:
        return _verb(arguments.verb)(arguments, console)
    except KeyboardInterrupt:
        console.say("Cancelled; finished work is kept, the same command goes on from there.")
        return CANCELLED
    except BrokenPipeError:
        sys.stderr.close()
        return DONE
    except Exception as error:
        if arguments.debug:
            raise
        return _explain(error, console)


def _verb(name: str) -> Verb:
    """The function of a verb, imported only now so that the start stays fast."""
    from importlib import import_module

    module, function = name.split(":")
    found: Verb = getattr(import_module(f"olivevib.cli.{module}"), function)
    return found


def _explain(error: Exception, console: Console) -> int:
    """Say what, why and what to do next; an unforeseen error says how to report it."""
    from olivevib.errors import OlivevibError
    from olivevib.progress import Cancelled

    if isinstance(error, Cancelled):
        console.say("Cancelled; finished work is kept, the same command goes on from there.")
        return CANCELLED
    if isinstance(error, OlivevibError):
        console.error(error.what, error.why, error.remedy)
        return error.exit_code
    if isinstance(error, PermissionError) and error.filename:
        place = error.filename
        remedy = "Check the rights of the file and its folder, or work in a folder of your own."
        console.error(f"{place} may not be read or written.", error.strerror or "", remedy)
        return FAILED
    console.error(
        f"olivevib met an unforeseen error: {type(error).__name__}: {error}",
        "This is a fault of the program, not yours; nothing that was measured is lost.",
        "Run the same command with --debug and send what it prints to the authors.",
    )
    return FAILED
