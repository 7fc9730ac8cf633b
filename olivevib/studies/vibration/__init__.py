"""How near vibration analysis, comparison and import come to what is asked of them."""

from __future__ import annotations

from collections.abc import Callable

from olivevib.progress import Tick
from olivevib.studies.study import Effort, Study
from olivevib.studies.vibration import comparisons, conversions, cost, imports, lines, peers
from olivevib.studies.vibration.measures import Part

PARTS: tuple[Callable[[Effort, Tick], Part], ...] = (
    lines.frequency,
    lines.amplitude,
    lines.neighbours,
    lines.gaps,
    conversions.derivative,
    conversions.integral,
    conversions.damping,
    conversions.beam,
    comparisons.comparison,
    imports.matrix,
    imports.real,
    imports.speed,
    cost.cost,
    peers.beside,
)


def run(effort: Effort, tick: Tick) -> Study:
    """Every part in turn."""
    parts = [part(effort, tick) for part in PARTS]
    return Study(
        name="vibration",
        title="Vibration: lines, conversion, damping, comparison, import, cost",
        tables=tuple(part.table for part in parts),
        goals=tuple(goal for part in parts for goal in part.goals),
        facts=(("share of the trials that the goals ask for", f"{effort.share:g}"),),
    )
