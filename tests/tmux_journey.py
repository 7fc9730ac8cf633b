"""The whole journey in a real terminal: tmux, 120 x 40 or 80 x 24, keys only.

python tests/tmux_journey.py [80x24]      prints each screen; exit 0: all came out
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tui_journey import KEYS, WAIT, check_outcome, raw_workspace

NAMES = {"enter": "Enter", "escape": "Escape", "down": "Down", "ctrl+o": "C-o", "ctrl+s": "C-s"}
BUSY = "Esc cancels"
FAILED = "This did not work"
SIGNS = {"n": "Make the trial", "ctrl+o": "take it", "c": "Difference", "v": "▶1"}
MADE = ("trial.toml", "comparison.h5", "report.html", "exports/T01.dxf")  # the works in turn
PATIENCE_S = 150.0
CHANGE_S = 2.0
QUIET_S = 0.3  # a screen that has not changed for so long is finished


class Tmux:
    """One app in a terminal of its own; a context manager."""

    def __init__(self, folder: Path, size: tuple[int, int]) -> None:
        self._place = tempfile.TemporaryDirectory()
        self._base = ["tmux", "-S", f"{self._place.name}/socket", "-f", "/dev/null"]
        columns, rows = (str(n) for n in size)
        command = f"exec {sys.executable} -m olivevib"
        env = {**os.environ, "TERM": "xterm-256color"}
        new = ["new-session", "-d", "-x", columns, "-y", rows, "-c", str(folder), command]
        subprocess.run([*self._base, *new], check=True, env=env)
        self._tmux("set", "-s", "escape-time", "0")

    def __enter__(self) -> Tmux:
        return self

    def __exit__(self, *error: object) -> None:
        subprocess.run([*self._base, "kill-server"], check=False, capture_output=True)
        self._place.cleanup()

    def _tmux(self, *words: str) -> str:
        done = subprocess.run([*self._base, *words], check=True, capture_output=True, text=True)
        return done.stdout

    def screen(self) -> str:
        """What is on screen."""
        return self._tmux("capture-pane", "-p")

    def coloured(self) -> str:
        """What is on screen, with its colours: where the focus is."""
        return self._tmux("capture-pane", "-p", "-e")

    def press(self, key: str) -> None:
        """Press a key or type a text."""
        if key.startswith("text:"):
            self._tmux("send-keys", "-l", key[5:])
        else:
            self._tmux("send-keys", NAMES.get(key, key))

    def settled(self, was: str) -> str:
        """The screen with its colours once it differs from ``was`` and then stays, or works."""
        began = time.monotonic()
        while self.coloured() == was and time.monotonic() - began < CHANGE_S:
            time.sleep(0.05)
        before, since = self.coloured(), time.monotonic()
        while time.monotonic() - since < QUIET_S:
            time.sleep(0.05)
            now = self.coloured()
            if now != before and BUSY not in now:
                before, since = now, time.monotonic()
        return before

    def until(self, words: str) -> str:
        """The screen once it shows these words."""
        return self._wait(words, lambda now: words in now)

    def worked(self, file: Path) -> str:
        """The screen once the work that writes this file has ended: however late it began."""
        return self._wait(file.name, lambda now: BUSY not in now and file.is_file())

    def _wait(self, what: str, done: Callable[[str], bool]) -> str:
        began = time.monotonic()
        while not done(now := self.screen()):
            if FAILED in now or time.monotonic() - began > PATIENCE_S:
                raise AssertionError(f"{what!r} did not come:\n{now}")
            time.sleep(0.1)
        return now


def journey(folder: Path, size: tuple[int, int], show: bool = False) -> list[str]:
    """Go the whole way in ``folder``; every screen on it."""
    raw_workspace(folder)
    works, began = iter(MADE), time.monotonic()
    screens = []
    with Tmux(folder, size) as tmux:
        screens.append(tmux.until("No trials here yet"))
        colours = tmux.coloured()
        for key in KEYS:
            if key == WAIT:
                tmux.worked(folder / "trials" / "T01" / next(works))
            else:
                tmux.press(key)
            if key in SIGNS:
                tmux.until(SIGNS[key])
            colours = tmux.settled(colours)
            screens.append(tmux.screen())
            if show:
                print(f"== {key} {time.monotonic() - began:.1f} s\n{screens[-1]}", flush=True)
            assert FAILED not in screens[-1], screens[-1]
    check_outcome(folder)
    return screens


if __name__ == "__main__":
    words = (sys.argv[1] if len(sys.argv) > 1 else "120x40").split("x")
    with tempfile.TemporaryDirectory() as name:
        journey(Path(name) / "olive", (int(words[0]), int(words[1])), show=True)
