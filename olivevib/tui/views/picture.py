"""A grey image in quadrant characters: two grey levels a cell, brackets and ids on top of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from olivevib.arrays import Floats, Grey, floats

QUADRANTS = " ▗▖▄▝▐▞▟▘▚▌▙▀▜▛█"  # bits: 8 upper left, 4 upper right, 2 lower left, 1 lower right
LEVELS = 16  # grey levels on screen: a real 720p frame stays below 90 kB


@dataclass(frozen=True)
class Window:
    """The part of the image on screen, px: x, y of its corner, width and height."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Outline:
    """One marker in the image: id, corners_px (4, 2), words beside it, trail_px (K, 2)."""

    id: int
    corners_px: Floats
    words: str
    chosen: bool = False
    trail_px: Floats = field(default_factory=lambda: np.empty((0, 2)))

    def __post_init__(self) -> None:
        object.__setattr__(self, "trail_px", floats("trail_px", self.trail_px, (None, 2)))
        object.__setattr__(self, "corners_px", floats("corners_px", self.corners_px, (4, 2)))


def fitting(window: Window, columns: int, rows: int) -> tuple[int, int]:
    """Columns and rows that show the window undistorted (a cell is half as wide as high)."""
    if columns < 1 or rows < 1:
        return 0, 0
    scale = min(columns / (2 * window.width), rows / window.height)
    return max(1, int(2 * window.width * scale)), max(1, int(window.height * scale))


def picture(
    grey: Grey, window: Window, size: tuple[int, int], outlines: Sequence[Outline] = ()
) -> list[Strip]:
    """The window of the image in ``size`` (columns, rows) cells, markers bracketed and named."""
    columns, rows = size
    blocks = _averages(grey, window, columns, rows)
    pattern, fore, back = _two_levels(blocks)
    chars = np.array(list(QUADRANTS))[pattern]
    overlay: dict[tuple[int, int], tuple[str, bool]] = {}
    for outline in outlines:
        _brackets(overlay, outline, window, columns, rows)
    return [_strip(chars[y], fore[y], back[y], y, overlay) for y in range(rows)]


def _averages(grey: Grey, window: Window, columns: int, rows: int) -> Floats:
    """(rows, columns, 4) mean grey of the quadrants: upper left, upper right, lower left, right."""
    height, width = grey.shape
    across = _edges(window.x, window.width, 2 * columns, width)
    down = _edges(window.y, window.height, 2 * rows, height)
    sums = np.zeros((height + 1, width + 1))
    np.cumsum(np.cumsum(grey, axis=0, dtype=np.float64), axis=1, out=sums[1:, 1:])
    top, bottom = down[:-1], np.maximum(down[1:], down[:-1] + 1)
    left, right = across[:-1], np.maximum(across[1:], across[:-1] + 1)
    total = (
        sums[np.ix_(bottom, right)]
        - sums[np.ix_(top, right)]
        - sums[np.ix_(bottom, left)]
        + sums[np.ix_(top, left)]
    )
    means = total / ((bottom - top)[:, None] * (right - left)[None, :])
    quads = means.reshape(rows, 2, columns, 2).transpose(0, 2, 1, 3)
    return np.asarray(quads.reshape(rows, columns, 4))


def _edges(
    start: float, length: float, count: int, limit: int
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Pixel limits of ``count`` equal parts, kept inside the image."""
    edges = np.rint(start + length * np.arange(count + 1) / count).astype(np.int64)
    return np.asarray(np.clip(edges, 0, limit - 1))


def _two_levels(
    blocks: Floats,
) -> tuple[np.ndarray[tuple[int, int], np.dtype[np.int64]], Floats, Floats]:
    """Pattern (rows, columns) of bright quadrants, and the grey of the bright and dark ones."""
    bright = blocks > blocks.mean(axis=2, keepdims=True)
    count = bright.sum(axis=2)
    high = (blocks * bright).sum(axis=2) / np.maximum(count, 1)
    low = (blocks * ~bright).sum(axis=2) / np.maximum(4 - count, 1)
    pattern = bright.astype(np.int64) @ np.array([8, 4, 2, 1])
    step = 255 / (LEVELS - 1)
    levels = [np.rint(np.where(count > 0, v, low) / step) for v in (high, low)]
    same = levels[0] == levels[1]
    return np.where(same, 0, pattern), levels[0] * step, levels[1] * step


def _brackets(
    overlay: dict[tuple[int, int], tuple[str, bool]],
    outline: Outline,
    window: Window,
    columns: int,
    rows: int,
) -> None:
    """Corner brackets about a marker and its words above it, in cells."""
    low, high = outline.corners_px.min(axis=0), outline.corners_px.max(axis=0)
    scale = np.array([columns / window.width, rows / window.height])
    corner = np.array([window.x, window.y])
    x0, y0 = (int(v) for v in np.floor((low - corner) * scale))
    x1, y1 = (int(v) for v in np.floor((high - corner) * scale))
    ends = {(x0, y0): "┌", (x1, y0): "┐", (x0, y1): "└", (x1, y1): "┘"}
    if x1 - x0 < 2 or y1 - y0 < 1:
        ends = {(x0, y0): "▪"}
    words = {(x0 + 1 + k, max(0, y0)): c for k, c in enumerate(outline.words)}
    trail = (tuple(at) for at in np.floor((outline.trail_px - corner) * scale).tolist())
    for at, char in {**dict.fromkeys(trail, "·"), **ends, **words}.items():
        overlay[at] = (char, outline.chosen)


def _strip(
    chars: np.ndarray[tuple[int], np.dtype[np.str_]],
    fore: Floats,
    back: Floats,
    y: int,
    overlay: dict[tuple[int, int], tuple[str, bool]],
) -> Strip:
    segments: list[Segment] = []
    run, style = "", None
    for x, char in enumerate(chars):
        mark = overlay.get((x, y))
        cell = _mark_style(mark[1]) if mark else _grey_style(int(fore[x]), int(back[x]))
        if style is not None and cell is not style:
            segments.append(Segment(run, style))
            run = ""
        run, style = run + (mark[0] if mark else char), cell
    segments.append(Segment(run, style))
    return Strip(segments, len(chars))


@lru_cache(LEVELS * LEVELS)
def _grey_style(fore: int, back: int) -> Style:
    return Style(color=f"rgb({fore},{fore},{fore})", bgcolor=f"rgb({back},{back},{back})")


@lru_cache(2)
def _mark_style(chosen: bool) -> Style:
    return Style(color="rgb(0,0,0)", bgcolor="rgb(255,200,0)" if chosen else "rgb(90,220,120)")
