"""One picture of a trial in words and outlines."""

from __future__ import annotations

import numpy as np
from rich.text import Text

from olivevib.tui.frames import Shot
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.picture import Outline, Window
from olivevib.values import counted

INSET_PX = (280.0, 210.0)  # bars and most modules of a marker can be seen


def outlines_of(shot: Shot, chosen: int | None) -> tuple[Outline, ...]:
    """A bracket about each marker, with its id; the state where it is not plainly seen."""
    return tuple(
        Outline(
            m.id,
            m.corners_px,
            f"{m.id}" if m.state == "seen" else f"{m.id} {m.state}",
            m.id == chosen,
            m.trail_px if m.id == chosen else np.empty((0, 2)),
        )
        for m in shot.markers
    )


def inset_of(shot: Shot, chosen: int | None) -> Window:
    """The window about the chosen marker, or about the middle of the picture, inside it."""
    height, width = shot.grey.shape if shot.grey is not None else (1, 1)
    middle = np.array([width, height]) / 2
    for marker in shot.markers:
        if marker.id == chosen:
            middle = marker.corners_px.mean(axis=0)
    size = np.minimum(INSET_PX, [width, height])
    corner = np.clip(middle - size / 2, 0, np.array([width, height]) - size)
    return Window(float(corner[0]), float(corner[1]), float(size[0]), float(size[1]))


def shot_words(shot: Shot, chosen: int | None, palette: Palette) -> Text:
    """Camera, frame, instant, and the quality of the chosen marker."""
    out = Text()
    total = f" of {shot.count}" if shot.count else ""
    out.append(f"{shot.side}  frame {shot.index}{total}", palette.accent)
    if np.isfinite(shot.t_s):
        out.append(f"  {shot.t_s:.4f} s (camera's stamp)", palette.muted)
    found = "found in this picture alone" if shot.detected else "tracked here"
    out.append(f"  {counted(len(shot.markers), 'marker')} {found}")
    for marker in shot.markers:
        if marker.id == chosen:
            sides = np.hypot(*np.diff(marker.corners_px[[0, 1, 2, 3, 0]], axis=0).T)
            out.append(f"\nmarker {marker.id} {marker.state}", palette.accent)
            out.append(f"  {sides.mean():.0f} px wide")
            if np.isfinite(marker.share):
                out.append(f", seen in {marker.share:.0%} of the frames")
    return out
