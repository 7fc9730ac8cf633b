"""The sigma to expect over the working volume: a row a distance, a column a place across."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from olivevib.arrays import Floats
from olivevib.tui.views.palette import Palette
from olivevib.tui.views.words import number

if TYPE_CHECKING:
    from olivevib.calibration.sigma_map import SigmaMap

CELL = 7  # columns of a number
EDGE = 10  # columns of a distance


def sigma_text(found: SigmaMap, palette: Palette) -> Text:
    """Sigma of one position in one frame, mm, far above near; the worst of all heights.

    A place that both cameras do not see is a dot; what of it is the calibration's stands below.
    """
    out = Text(no_wrap=False)
    out.append("One position in one frame, mm; the worst of all heights.", palette.accent)
    out.append(f" {len(found.xyz_mm)} places that both cameras see, left camera's frame.\n")
    total = found.total_mm
    across = _worst(found, np.hypot(total[:, 0], total[:, 1]))
    for name, grid in (("across", across), ("in depth", _worst(found, total[:, 2]))):
        _table(out, name, grid, _distances(found), palette)
    rig_across = np.hypot(found.rig_mm[:, 0], found.rig_mm[:, 1])
    out.append(
        f"Of it the calibration's part, the same in every frame: up to {_most(rig_across)} across, "
        f"{_most(found.rig_mm[:, 2])} in depth; of a length of 200 mm across "
        f"{_most(found.length_mm)}."
    )
    return out


def _table(out: Text, name: str, grid: Floats, far_mm: Floats, palette: Palette) -> None:
    """One sigma (X, Z) on the distances (Z,)."""
    wide = CELL * (len(grid) - 1)
    out.append(f"{name:<{EDGE}}", palette.accent)
    out.append(f"{'left':>{CELL}}{'right of the picture':>{wide}}\n", palette.muted)
    for k in np.flatnonzero(np.isfinite(far_mm))[::-1]:
        out.append(f"{far_mm[k]:>{EDGE - 3}.0f} mm", palette.muted)
        out.append("".join(f"{_cell(value):>{CELL}}" for value in grid[:, k]) + "\n")


def _cell(value: float) -> str:
    return number(float(value), 3 if value < 10 else 1) if np.isfinite(value) else "·"


def _most(values: Floats) -> str:
    """The largest of some values (K,), mm."""
    known = values[np.isfinite(values)]
    return number(float(known.max()), 3, "mm") if known.size else "unknown"


def _worst(found: SigmaMap, values: Floats) -> Floats:
    """Values (K,) on the box, the largest over the heights: (X, Z); NaN where nothing is seen."""
    return np.asarray(np.fmax.reduce(found.on_grid(values), axis=1), dtype=np.float64)


def _distances(found: SigmaMap) -> Floats:
    """The distance of each layer of the box, (Z,) mm; NaN for a layer that is not seen."""
    return np.asarray(np.fmax.reduce(_worst(found, found.xyz_mm[:, 2])), dtype=np.float64)
