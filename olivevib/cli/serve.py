"""Verb serve: the app in a browser on this computer."""

from __future__ import annotations

import argparse
import importlib.util
import shlex
import socket
import sys

from olivevib.cli.console import Console
from olivevib.errors import UsageError

EVERYWHERE = ("", "0.0.0.0", "::")
MOST_PORT = 65535
LOOPBACK = ("127.0.0.1", "localhost", "::1")


def serve(arguments: argparse.Namespace, console: Console) -> int:
    """Serve the app until Ctrl-C; every browser window gets an app of its own."""
    if importlib.util.find_spec("textual_serve") is None:
        raise UsageError(
            "the app in a browser needs the package textual-serve, which is not installed.",
            "It is an extra, because few need it; the app in a terminal works without.",
            "Install it beside olivevib: pip install textual-serve",
        )
    if not 1 <= arguments.port <= MOST_PORT:
        raise UsageError(
            f"--port {arguments.port} is no port.", "", f"Give one from 1024 to {MOST_PORT}."
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
    _try(arguments.host, arguments.port)
    command = shlex.join([sys.executable, "-m", "olivevib.tui"])
    server = LocalServer(command, arguments.host, arguments.port)
    console.say(f"Open {server.public_url} · Ctrl-C ends.")
    try:
        server.serve()
    except OSError as error:
        raise _taken(arguments.host, arguments.port, error) from error
    return 0


def _try(host: str, port: int) -> None:
    """UsageError where the port cannot be had; before an address is told, not after it."""
    try:
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, socket.SOCK_STREAM) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(place)
    except OSError as error:
        raise _taken(host, port, error) from error


def _taken(host: str, port: int, error: OSError) -> UsageError:
    return UsageError(
        f"port {port} of {host} cannot be served.",
        str(error),
        "Another program may hold it: choose another one with --port.",
    )
