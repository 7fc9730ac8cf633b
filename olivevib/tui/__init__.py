"""The terminal app: a trial from recordings to report, by keyboard and by mouse."""

from __future__ import annotations

from pathlib import Path


def run_app(workspace: Path) -> None:
    """Run the app on a workspace until the person leaves it."""
    from olivevib.tui.app import OlivevibApp

    OlivevibApp(workspace).run()
