"""Rows of a form: a label, a line to type in, and a button to pick a file or a value by mouse."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widget import Widget
from textual.widgets import Button, Input, Label

from olivevib.tui.fields import Field

PAGE = 8  # lines


class Form(VerticalScroll, can_focus=False, inherit_bindings=False):
    """Lines below one another: up and down go from line to line, so the line is always in view."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("down", "line(1)", "Next line", show=False),
        Binding("up", "line(-1)", "Line before", show=False),
        Binding("pagedown", f"line({PAGE})", "Lines further down", show=False),
        Binding("pageup", f"line(-{PAGE})", "Lines further up", show=False),
    ]

    def action_line(self, step: int) -> None:
        """Put the cursor so many lines further; it stops at the first and the last."""
        lines = [w for w in self.query("Input, Button") if w.focusable]
        here = next((k for k, line in enumerate(lines) if line.has_focus), None)
        if here is not None:
            lines[min(len(lines) - 1, max(0, here + step))].focus()


def form_rows(fields: Iterable[Field]) -> Iterator[Widget]:
    """One row a field."""
    for field in fields:
        shown, name = "…" if field.path else "▾", f"pick-{field.name}"
        pick = Button(shown, id=name, classes="pick", compact=True)
        pick.can_focus = False  # for the mouse; keys use Ctrl+O in the line
        row: list[Widget] = [
            Label(field.label, markup=False),
            Input(placeholder=field.hint, id=field.name, compact=True),
            Label("", id=f"from-{field.name}", classes="from", markup=False),
            pick,
        ]
        yield Horizontal(*row)


def form_values_of(form: Widget, fields: Iterable[Field]) -> dict[str, str]:
    """What has been typed."""
    return {field.name: form.query_one(f"#{field.name}", Input).value for field in fields}


def say_source(form: Widget, name: str, words: str) -> None:
    """Say beside a line where its value comes from; "" takes the words away."""
    form.query_one(f"#from-{name}", Label).update(words)
