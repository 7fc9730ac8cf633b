"""Running the app in tests: start it on a workspace, press keys, wait for its threads."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from rich.text import Text
from textual.app import App
from textual.pilot import Pilot
from textual.widgets import DataTable
from textual.worker import WorkerCancelled, WorkerFailed

from olivevib.tui.app import OlivevibApp

OURS = {"read", "look", "work", "frame", "first", "save", "kept"}


async def settle(pilot: Pilot[None]) -> None:
    """Wait until no thread of ours is at work, every message is handled, every layout is made."""
    await quiet(pilot)
    while running := [w for w in pilot.app.workers if w.group in OURS and not w.is_finished]:
        for worker in running:
            with contextlib.suppress(WorkerCancelled, WorkerFailed):
                await worker.wait()
        await quiet(pilot)


async def quiet(pilot: Pilot[None], turns: int = 3) -> None:
    """Wait until nothing has been waiting for a few turns, however loaded the machine is."""
    calm = 0
    while calm < turns:
        await asyncio.sleep(0.01)
        calm = 0 if is_busy(pilot.app) else calm + 1


def is_busy(app: App[None]) -> bool:
    """Whether a message, a layout or a repaint is still to come."""
    if app._exit:
        return False
    screen = app.screen
    nodes = [app, *app.screen_stack, *screen.walk_children()]
    waiting = any(not node._message_queue.empty() for node in nodes)
    due = screen._layout_required or screen._repaint_required or bool(screen._dirty_widgets)
    tables = screen.query(DataTable)  # they widen their columns when next idle
    widths = any(t._require_update_dimensions or t._updated_cells for t in tables)
    return waiting or due or widths or bool(screen._callbacks)


@asynccontextmanager
async def started(
    workspace: Path, size: tuple[int, int] = (120, 40)
) -> AsyncIterator[tuple[OlivevibApp, Pilot[None]]]:
    """The app on a workspace, its first screen filled."""
    app = OlivevibApp(workspace)
    async with app.run_test(size=size) as pilot:
        await settle(pilot)
        yield app, pilot


async def shown(pilot: Pilot[None], *words: str, patience_s: float = 20.0) -> str:
    """What is on screen once all these words are; fails with the screen where they do not come."""
    ends = asyncio.get_running_loop().time() + patience_s
    while any(word not in (text := screen_text(pilot.app)) for word in words):
        assert asyncio.get_running_loop().time() < ends, f"{words} did not come:\n{text}"
        await settle(pilot)
    return text


async def press(pilot: Pilot[None], *keys: str) -> None:
    """Press keys one after the other, each with all that it sets off; ``text:…`` is typed."""
    for key in keys:
        await pilot.press(*(key[5:] if key.startswith("text:") else [key]))
        await settle(pilot)


def screen_text(app: App[None]) -> str:
    """What is on screen, line by line."""
    return "\n".join(strip.text.rstrip() for strip in app.screen._compositor.render_strips())


def lines(text: Text) -> list[str]:
    """A view's lines without styles."""
    return text.plain.split("\n")
