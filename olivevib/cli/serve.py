"""Verb serve: the app in a browser on this computer."""

from __future__ import annotations

import argparse
import importlib.util
import shlex
import sys

from olivevib.cli.console import Console
from olivevib.errors import UsageError

EVERYWHERE = ("", "0.0.0.0", "::")
LOOPBACK = ("127.0.0.1", "localhost", "::1")


def serve(arguments: argparse.Namespace, console: Console) -> int:
    """Serve the app until Ctrl-C; every browser window gets an app of its own."""
    if importlib.util.find_spec("textual_serve") is None:
        raise UsageError(
            "the app in a browser needs the package textual-serve, which is not installed.",
            "It is an extra, because few need it; the app in a terminal works without.",
            "Install it beside olivevib: pip install textual-serve",
        )
    from olivevib.cli.browser import LocalServer

    if arguments.host in EVERYWHERE:
        raise UsageError(
            f"--host {arguments.host!r} is no address that a browser can ask for.",
            "Requests for another name than the one that is served are refused.",
            "Name this computer's address in its network, such as --host 192.168.1.20.",
        )
    if arguments.host not in LOOPBACK:
        console.say(
            f"warning: whoever reaches {arguments.host}:{arguments.port} can read and change "
            "everything in this workspace."
        )
    command = shlex.join([sys.executable, "-m", "olivevib.tui"])
    server = LocalServer(command, arguments.host, arguments.port)
    console.say(f"Open {server.public_url} · Ctrl-C ends.")
    try:
        server.serve()
    except OSError as error:
        raise UsageError(
            f"port {arguments.port} of {arguments.host} cannot be served.",
            str(error),
            "Another program may hold it: choose another one with --port.",
        ) from error
    return 0
