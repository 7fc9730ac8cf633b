"""The cameras at this computer in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from olivevib.tui.harmless import harmless
from olivevib.tui.views.palette import Palette

if TYPE_CHECKING:
    from olivevib.tui.loader import CameraLine

MOST = 6


def cameras_text(cameras: Sequence[CameraLine], palette: Palette) -> Text:
    """A line a camera; what to do where there is none."""
    out = Text()
    if not cameras:
        out.append("none is connected. ", palette.warn)
        out.append("Streams are named by their http:// address; Ctrl+R rehearses.")
    for number, camera in enumerate(cameras[:MOST]):
        out.append(f"{number}  ", palette.accent)
        out.append(f"{harmless(camera.title, 60)}  ")
        out.append(f"{harmless(camera.modes, 120)}\n", palette.muted)
    out.rstrip()
    return out
