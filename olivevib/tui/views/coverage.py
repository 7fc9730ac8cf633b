"""Where the calibration board was seen: points over each camera's picture, residuals in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.text import Text

from olivevib.arrays import Floats, floats
from olivevib.tui.harmless import harmless
from olivevib.tui.views.cells import Cells, scatter
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.picture import Window, fitting
from olivevib.tui.views.words import number

THIRDS = ("upper", "middle", "lower"), ("left", "centre", "right")
FEW = 0.02  # share of the points below which a ninth of the picture counts as bare


@dataclass(frozen=True)
class Coverage:
    """One camera: points (K, 4) as u, v and residual du, dv in px, and the picture's size."""

    side: str
    points: Floats
    size_px: tuple[int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", floats("points", self.points, (None, 4)))


def coverage_plot(coverage: Coverage, size: tuple[int, int], palette: Palette) -> Text:
    """The picture's outline with a dot at every board point; large residuals stand out."""
    cells = Cells(*size)
    if size[0] < 16 or size[1] < 6:
        return cells.text()
    width, height = coverage.size_px
    columns, rows = fitting(Window(0, 0, width, height), size[0] - 2, size[1] - 3)
    _outline(cells, columns, rows, palette)
    shape = (4 * rows, 2 * columns)
    x = coverage.points[:, 0] / width * (shape[1] - 1)
    y = coverage.points[:, 1] / height * (shape[0] - 1)
    large = _large(coverage.points)
    for which, style in ((~large, palette.good), (large, palette.bad)):
        cells.dots(1, 1, scatter(shape, x[which], y[which]), style)
    cells.put(1, rows + 2, coverage_words(coverage), palette.muted)
    return cells.text()


def _outline(cells: Cells, columns: int, rows: int, palette: Palette) -> None:
    for y, (left, middle, right) in ((0, "┌─┐"), (rows + 1, "└─┘")):
        cells.put(0, y, f"{left}{middle * columns}{right}", palette.muted)
    for y in range(rows):
        cells.put(0, y + 1, "│", palette.muted)
        cells.put(columns + 1, y + 1, "│", palette.muted)


def _large(points: Floats) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Residuals beyond three times the rms of all."""
    residual = np.hypot(points[:, 2], points[:, 3])
    rms = np.sqrt(np.mean(residual**2)) if residual.size else 0.0
    return np.asarray(residual > 3 * rms)


def bare_ninths(coverage: Coverage) -> tuple[str, ...]:
    """The ninths of the picture in which the board was hardly seen."""
    width, height = coverage.size_px
    if not coverage.points.size:
        return ()
    column = np.clip(3 * coverage.points[:, 0] / width, 0, 2.999).astype(np.int64)
    row = np.clip(3 * coverage.points[:, 1] / height, 0, 2.999).astype(np.int64)
    share = np.bincount(3 * row + column, minlength=9) / row.size
    return tuple(f"{THIRDS[0][k // 3]} {THIRDS[1][k % 3]}" for k in np.flatnonzero(share < FEW))


def coverage_words(coverage: Coverage) -> str:
    """How many points, and where the board is still missing."""
    if not coverage.points.size:
        return "no board points are stored for this calibration"
    bare = bare_ninths(coverage)
    missing = f"; hardly any {', '.join(bare)}" if bare else "; every part of the picture"
    return f"{len(coverage.points)} board points{missing}"


def calibration_text(
    summary: Mapping[str, Any],
    places: Sequence[str],
    cautions: Sequence[Mapping[str, str]],
    palette: Palette,
) -> Text:
    """Verdict in mm, residuals in px, where the cameras stand, what to do better."""
    c = summary["calibration"]
    out = Text()
    out.append(f"{harmless(c['verdict'] or 'no verdict yet', 900)}\n", palette.accent)
    rms = [f"{side} {number(c[side]['rms_px'], 3, 'px')}" for side in ("left", "right")]
    mm, share = number(c["holdout_rms_mm"], 3, "mm"), number(c["holdout_rms_percent"], 2, "%")
    out.append(f"fit rms {', '.join(rms)}; distances on unused views {mm} ({share})\n")
    out.append("".join(f"{place}\n" for place in places))
    for caution in cautions:
        out.append(f"⚠ {harmless(caution['text'], 300)} ", palette.warn)
        out.append(f"{harmless(caution['remedy'], 300)}\n")
    out.rstrip()
    return out


def camera_places(R_right_left: Floats, t_right_left_mm: Floats) -> tuple[str, ...]:
    """Where the right camera stands and how far it is turned, seen from the left one."""
    x, y, z = -R_right_left.T @ t_right_left_mm
    cosine = np.clip((np.trace(R_right_left) - 1) / 2, -1, 1)
    turn = np.degrees(np.arccos(cosine))
    across = "right" if x >= 0 else "left"
    return (
        f"the right camera stands {abs(x):.0f} mm to the {across}, {abs(y):.0f} mm "
        f"{'lower' if y >= 0 else 'higher'}, {abs(z):.0f} mm {'ahead' if z >= 0 else 'behind'}; "
        f"turned by {turn:.1f}°",
    )
