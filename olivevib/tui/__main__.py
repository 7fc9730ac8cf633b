"""``python -m olivevib.tui``: the app on the workspace here, for the browser."""

from pathlib import Path

from olivevib.tui import run_app

if __name__ == "__main__":
    run_app(Path())
