"""Rows of a form: a label, a line to type in, and a button to pick a file or a value by mouse."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from textual.containers import Horizontal
from textual.widget import Widget
from textual.widgets import Button, Input, Label

from olivevib.tui.fields import Field


def form_rows(fields: Iterable[Field]) -> Iterator[Widget]:
    """One row a field."""
    for field in fields:
        pick = Button("…" if field.path else "▾", id=f"pick-{field.name}", compact=True)
        pick.can_focus = False  # for the mouse; keys use Ctrl+O in the line
        row: list[Widget] = [
            Label(field.label, markup=False),
            Input(placeholder=field.hint, id=field.name, compact=True),
            pick,
        ]
        yield Horizontal(*row)


def form_values_of(form: Widget, fields: Iterable[Field]) -> dict[str, str]:
    """What has been typed."""
    return {field.name: form.query_one(f"#{field.name}", Input).value for field in fields}
