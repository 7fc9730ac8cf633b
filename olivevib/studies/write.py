"""A study as text for a terminal, as Markdown and JSON for the record, its charts as SVG."""

from __future__ import annotations

import json
import math
from pathlib import Path

from olivevib.files.atomic import write_text_atomic
from olivevib.studies.study import Cell, Goal, Study, Table

_REACHED = {True: "reached", False: "NOT reached", None: "not measured"}


def write_study(study: Study, folder: Path) -> tuple[Path, ...]:
    """Write NAME.md, NAME.json and one NAME-chart.svg a chart into ``folder``; their paths."""
    from olivevib.report.figures.chart import chart_figure

    folder.mkdir(parents=True, exist_ok=True)
    stem = study.name.replace(" ", "-")
    texts = {f"{stem}.md": as_markdown(study), f"{stem}.json": as_json(study)}
    for chart in study.charts:
        lines = [(c.label, c.x, c.y) for c in chart.curves]
        labels = (chart.title, chart.x_label, chart.y_label)
        texts[f"{stem}-{chart.name}.svg"] = chart_figure(chart.name, labels, lines, chart.log_y)
    for name, text in texts.items():
        write_text_atomic(folder / name, text)
    return tuple(folder / name for name in texts)


def as_json(study: Study) -> str:
    """Tables as lists of objects, goals, facts; NaN is null."""
    tables = [
        {
            "title": t.title,
            "note": t.note,
            "rows": [dict(zip(t.columns, map(_plain, row), strict=True)) for row in t.rows],
        }
        for t in study.tables
    ]
    goals = [
        {"quantity": g.quantity, "asked": g.asked, "measured": g.measured, "reached": g.reached}
        for g in study.goals
    ]
    whole = {
        "study": study.name,
        "title": study.title,
        "facts": dict(study.facts),
        "goals": goals,
        "tables": tables,
    }
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def as_text(study: Study) -> str:
    """Everything as aligned columns for a terminal."""
    parts = [study.title, *(f"  {name}: {value}" for name, value in study.facts)]
    for table in _tables(study):
        parts += ["", table.title, *_aligned(table)]
        if table.note:
            parts.append(f"  {table.note}")
    return "\n".join(parts) + "\n"


def as_markdown(study: Study) -> str:
    """Everything as a Markdown page."""
    parts = [f"# {study.title}", ""]
    parts += [f"- {name}: {value}" for name, value in study.facts]
    for table in _tables(study):
        parts += ["", f"## {table.title}", "", "| " + " | ".join(table.columns) + " |"]
        parts.append("|" + "---|" * len(table.columns))
        parts += ["| " + " | ".join(_word(cell) for cell in row) + " |" for row in table.rows]
        if table.note:
            parts += ["", table.note]
    stem = study.name.replace(" ", "-")
    parts += [f"\n![{chart.title}]({stem}-{chart.name}.svg)" for chart in study.charts]
    return "\n".join(parts) + "\n"


def _tables(study: Study) -> tuple[Table, ...]:
    return (_goal_table(study.goals), *study.tables) if study.goals else study.tables


def _goal_table(goals: tuple[Goal, ...]) -> Table:
    rows = tuple((g.quantity, g.asked, g.measured, _REACHED[g.reached]) for g in goals)
    return Table("Asked and measured", ("quantity", "asked", "measured", "verdict"), rows)


def _aligned(table: Table) -> list[str]:
    cells = [table.columns, *(tuple(_word(cell) for cell in row) for row in table.rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(table.columns))]
    right = [
        all(isinstance(row[k], int | float) or row[k] is None for row in table.rows)
        for k in range(len(table.columns))
    ]
    return [
        "  " + "  ".join(
            word.rjust(w) if r else word.ljust(w)
            for word, w, r in zip(row, widths, right, strict=True)
        ).rstrip()
        for row in cells
    ]  # fmt: skip


def _word(cell: Cell) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "-"
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _plain(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell
