"""What a study hands back: tables, charts, and goals with what was measured beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import UsageError
from olivevib.progress import Tick

Cell: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True)
class Effort:
    """How much is measured: ``share`` of the full number of samples, and where the draws start.

    1 is the number that the goals ask for; less gives a first look whose table says so.
    """

    share: float = 1.0
    seed: int = 1

    def __post_init__(self) -> None:
        if not 0 < self.share <= 100:
            raise UsageError(
                f"An effort of {self.share:g} cannot be measured.",
                "It multiplies the number of samples.",
                "Give a number above 0 and up to 100; 1 is what the goals ask for.",
            )

    def count(self, full: int, least: int = 1) -> int:
        """The number of samples in place of ``full``, at least ``least``."""
        return max(least, round(full * self.share))

    def draws(self, *where: int) -> np.random.Generator:
        """Random numbers for one cell of a study: the same whatever else was measured."""
        return np.random.default_rng([self.seed, *where])


@dataclass(frozen=True)
class Table:
    """Rows of numbers and words under named columns, with their unit in the column's name."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"{self.title}: every row needs {len(self.columns)} cells")


@dataclass(frozen=True)
class Curve:
    """One line of a chart: points x (N,), y (N,), NaN where nothing was measured."""

    label: str
    x: Floats
    y: Floats


@dataclass(frozen=True)
class Chart:
    """Curves over one axis; drawn by report.figures.chart so that grey print can be read."""

    name: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log_y: bool = False


@dataclass(frozen=True)
class Goal:
    """One number that was asked for, what was measured, and whether it was reached."""

    quantity: str
    asked: str
    measured: str
    reached: bool | None  # None: not measured here (and why, in ``measured``)


@dataclass(frozen=True)
class Study:
    """Everything that a study measured; ``facts`` say with what (versions, machine, samples)."""

    name: str
    title: str
    tables: tuple[Table, ...]
    charts: tuple[Chart, ...] = ()
    goals: tuple[Goal, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()

    @property
    def missed(self) -> tuple[Goal, ...]:
        """The goals that were measured and not reached."""
        return tuple(goal for goal in self.goals if goal.reached is False)


StudyFunction: TypeAlias = Callable[[Effort, Tick], Study]
