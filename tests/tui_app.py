"""Running the app in tests: start it on a workspace, press keys, wait for its threads."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from rich.text import Text
from textual.pilot import Pilot
from textual.worker import WorkerCancelled, WorkerFailed

from olivevib.tui.app import OlivevibApp

OURS = {"read", "work", "frame", "first", "save", "kept"}


async def settle(pilot: Pilot[None]) -> None:
    """Wait until no thread of ours is at work and every message has been handled."""
    await pilot.pause()
    while running := [w for w in pilot.app.workers if w.group in OURS and not w.is_finished]:
        for worker in running:
            with contextlib.suppress(WorkerCancelled, WorkerFailed):
                await worker.wait()
        await pilot.pause()


@asynccontextmanager
async def started(
    workspace: Path, size: tuple[int, int] = (120, 40)
) -> AsyncIterator[tuple[OlivevibApp, Pilot[None]]]:
    """The app on a workspace, its first screen filled."""
    app = OlivevibApp(workspace)
    async with app.run_test(size=size) as pilot:
        await settle(pilot)
        yield app, pilot


async def press(pilot: Pilot[None], *keys: str) -> None:
    """Press keys one after the other, each with all that it sets off."""
    for key in keys:
        await pilot.press(key)
        await settle(pilot)


def screen_text(app: OlivevibApp) -> str:
    """What is on screen, line by line."""
    return "\n".join(strip.text.rstrip() for strip in app.screen._compositor.render_strips())


def lines(text: Text) -> list[str]:
    """A view's lines without styles."""
    return text.plain.split("\n")
