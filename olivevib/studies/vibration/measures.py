"""What the parts of the vibration study hand to one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from olivevib.studies.study import Goal, Table


@dataclass(frozen=True)
class Part:
    """One part of the study: its table and the goals that it measured."""

    table: Table
    goals: tuple[Goal, ...]


def rms(values: ArrayLike) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def within(value: float, limit: float, samples: int, enough: int) -> bool | None:
    """Whether a measured number keeps its limit; None where too few samples could tell."""
    return bool(value <= limit) if samples >= enough else None


def covers(inside: Sequence[bool], enough: int) -> tuple[float, bool | None]:
    """Per cent of 95 % intervals that hold the truth; whether 93-97 %, where enough were drawn."""
    share = 100 * float(np.mean(inside))
    return share, (bool(93 <= share <= 97) if len(inside) >= enough else None)
