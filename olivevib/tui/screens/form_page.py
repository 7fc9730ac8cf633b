"""A page with a form: ↑ ↓ Enter go from line to line, Ctrl+O or its button offers values."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.widgets import Button, Input

from olivevib.tui.fields import Field
from olivevib.tui.screens.choose import ChooseScreen
from olivevib.tui.screens.page import Page
from olivevib.tui.screens.pick import PickScreen
from olivevib.tui.widgets.form import form_values_of


class FormPage(Page):
    """Subclasses name the fields, and do something when a value has changed."""

    FIELDS: ClassVar[Sequence[Field]] = ()
    BINDINGS: ClassVar[list[BindingType]] = [Binding("ctrl+o", "pick", "Pick, choose")]

    @property
    def fields(self) -> Sequence[Field]:
        """The lines of the form as it stands."""
        return self.FIELDS

    @property
    def values(self) -> dict[str, str]:
        """What has been typed."""
        return form_values_of(self, self.fields)

    def changed(self, name: str) -> None:
        """A line was left, entered or chosen."""

    def offered(self, field: Field) -> tuple[str, ...]:
        """What is offered for a line."""
        return field.choices

    def start_folder(self) -> Path:
        """Where picking a file begins: where one was last picked, else the workspace."""
        last = Path(self.olive.kept.folder or ".")
        return last if self.olive.kept.folder and last.is_dir() else self.folder

    def action_pick(self) -> None:
        """Pick the file, or choose the value, of the line with the cursor."""
        if self.focused is not None:
            self.focused.scroll_visible(animate=False)
            self.pick(self.focused.id or "")

    def pick(self, name: str) -> None:
        """Show what is offered for a line of the form."""
        field = next((f for f in self.fields if f.name == name), None)
        if field is None:
            return
        taken = partial(self._taken, field)
        if field.path:
            self.app.push_screen(PickScreen(field.label, self.start_folder()), taken)
        else:
            value = self.values[name]
            self.app.push_screen(ChooseScreen(field.label, value, self.offered(field)), taken)

    def _taken(self, field: Field, value: Path | str | None) -> None:
        if value is not None:
            if isinstance(value, Path):
                self.olive.keep(folder=str(value.parent))
            line = self.query_one(f"#{field.name}", Input)
            line.value = str(value)
            line.focus()
            self.changed(field.name)

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        name = event.button.id or ""
        if name.startswith("pick-"):
            self.pick(name.removeprefix("pick-"))
        else:
            self.call_later(self.run_action, name)

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        """Enter goes to the next line."""
        self.changed(event.input.id or "")
        self.focus_next(Input)

    @on(Input.Blurred)
    def _left(self, event: Input.Blurred) -> None:
        self.changed(event.input.id or "")
