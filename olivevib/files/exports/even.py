"""The part of a path whose rows are evenly spaced, for formats that state one rate for all rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import UsageError
from olivevib.reconstruction.trajectory import Trajectory

ALIKE = 1e-3  # steps that differ by less than this part of a step are equal
FEWEST_STEPS = 4  # equal steps that make a grid
MOST_OFF = 0.1  # of a step: farther from its row no frame may lie


@dataclass(frozen=True)
class EvenPart:
    """Rows k of trajectory at start_s + k / rate_hz on the trial clock, gaps as NaN rows.

    whole: nothing was left out. span_s: of the path that it was taken of. worst_off_s: how far the
    instant at which a marker was seen lies from its row's time at most (readout, stamps).
    """

    trajectory: Trajectory
    rate_hz: float
    start_s: float
    whole: bool
    span_s: float

    @property
    def worst_off_s(self) -> float:
        """s; 0 where all samples lie on the grid, as those of a fitted motion do."""
        path = self.trajectory
        if not self.rate_hz or not path.seen.any():
            return 0.0
        grid = self.start_s + np.arange(path.t_s.size) / self.rate_hz
        return float(np.nanmax(np.where(path.seen, np.abs(path.sample_t_s - grid[:, None]), 0.0)))

    @property
    def words(self) -> str:
        """What a person should know of such a file: its rate, its start, what is not in it."""
        rows = self.trajectory.t_s.size
        end = self.start_s + max(rows - 1, 0) / self.rate_hz if self.rate_hz else self.start_s
        told = f"{rows} rows, {self.rate_hz:.4f} Hz; row 1 is at {self.start_s:.6f} s"
        told += " on the trial clock"
        if not self.whole:
            told += (
                f". It holds {self.start_s:.2f} s to {end:.2f} s of {self.span_s:.2f} s, where the "
                "motion was fitted: the rest has one row a frame, another rate"
                " (csv, txt, h5, mat, uff and parquet hold all, each row with its time)"
            )
        if self.worst_off_s * self.rate_hz > ALIKE:
            told += f". Markers were seen up to {1e3 * self.worst_off_s:.1f} ms beside their row's"
            told += " time (csv has each instant)"
        return told + "."


def even_part(trajectory: Trajectory) -> EvenPart:
    """What of ``trajectory`` a file of one rate can hold without a false time.

    Of a fitted path it is the fit's own grid: outside of it rows are one a frame, where the
    rate is another. Else every frame in its row, a row without a frame NaN and *dropped*; no
    sample is invented. Raises UsageError where frames lie more than a tenth of a row beside
    their rows (a camera whose rate varies).
    """
    t_s = trajectory.t_s
    span = float(t_s[-1] - t_s[0]) if t_s.size else 0.0
    if t_s.size < 2:
        start = float(t_s[0]) if t_s.size else 0.0
        return EvenPart(trajectory, 0.0, start, True, span)
    if trajectory.method == "continuous":
        first, beyond = _finest_stretch(t_s)
        if beyond - first > FEWEST_STEPS and (first, beyond) != (0, t_s.size):
            return replace(
                _on_grid(trajectory.rows(np.arange(first, beyond))), whole=False, span_s=span
            )
    return replace(_on_grid(trajectory), span_s=span)


def _finest_stretch(t_s: Floats) -> tuple[int, int]:
    """[first, beyond) of the rows with the smallest step that repeats; of several the longest."""
    steps = np.diff(t_s)
    turns = np.flatnonzero(np.abs(np.diff(steps)) > ALIKE * np.minimum(steps[1:], steps[:-1])) + 1
    edges = np.concatenate([[0], turns, [steps.size]])
    runs = [(int(a), int(b)) for a, b in pairwise(edges)]
    grids = [run for run in runs if run[1] - run[0] >= FEWEST_STEPS]
    if not grids:
        return 0, t_s.size
    size = {run: float(np.median(steps[run[0] : run[1]])) for run in grids}
    finest = min(size.values())
    alike = [run for run in grids if size[run] < finest * (1 + ALIKE)]
    first, last = max(alike, key=lambda run: run[1] - run[0])
    return first, last + 1


def _on_grid(trajectory: Trajectory) -> EvenPart:
    """Every row at its place of an even grid; missing places become NaN rows."""
    t_s = trajectory.t_s
    step = float(np.median(np.diff(t_s)))
    count = np.concatenate([[0], np.cumsum(np.maximum(np.rint(np.diff(t_s) / step), 1))])
    slope, start = np.polyfit(count, t_s, 1) if t_s.size > 2 else (step, float(t_s[0]))
    off = float(np.abs(t_s - start - slope * count).max())
    if off > MOST_OFF * slope:
        raise UsageError(
            "the frames of this trial do not come at one rate, and this format states one rate.",
            f"A frame lies {1e3 * off:.1f} ms beside its row; rows are {1e3 * slope:.1f} ms apart.",
            "Export csv, txt, h5, mat, uff or parquet: each row has its own time there.",
        )
    rows = np.rint(count).astype(np.int64)
    even = trajectory
    if rows[-1] + 1 > t_s.size:
        grid = start + slope * np.arange(rows[-1] + 1)
        grid[rows] = t_s
        even = trajectory.onto(grid, rows)
    return EvenPart(even, 1.0 / float(slope), float(start), True, float(t_s[-1] - t_s[0]))
