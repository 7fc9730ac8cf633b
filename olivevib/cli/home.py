"""``olivevib`` without a verb: the terminal app on the workspace here."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from olivevib.cli.console import Console
from olivevib.errors import UsageError


def app(arguments: argparse.Namespace, console: Console) -> int:
    """Open the app; it needs a terminal for input and output."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UsageError(
            "the app needs a terminal.",
            "Input or output is not one (a pipe, a file or a job without a screen).",
            "Use the verbs instead: olivevib --help lists them.",
        )
    from olivevib.tui import run_app

    run_app(Path())
    return 0
