"""All that is measured of detection, as one study."""

from __future__ import annotations

from olivevib.progress import Tick
from olivevib.studies.detection import (
    accuracy,
    clutter,
    follow,
    hardship,
    honesty,
    rates,
    speed,
    throughput,
)
from olivevib.studies.study import Effort, Study

PARTS = (
    *(rates.run, accuracy.run, honesty.run, hardship.occlusion, hardship.blur, hardship.light),
    *(clutter.run, follow.run, speed.run, throughput.run),
)


def run(effort: Effort, tick: Tick) -> Study:
    """Every part, one after the other."""
    return merged("detection", "Markers found and measured", [part(effort, tick) for part in PARTS])


def merged(name: str, title: str, parts: list[Study]) -> Study:
    """Several studies as one: their tables, charts, goals, and each fact once."""
    return Study(
        name=name,
        title=title,
        tables=tuple(table for part in parts for table in part.tables),
        charts=tuple(chart for part in parts for chart in part.charts),
        goals=tuple(goal for part in parts for goal in part.goals),
        facts=tuple(dict.fromkeys(fact for part in parts for fact in part.facts)),
    )
