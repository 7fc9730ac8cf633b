"""Tables of rows: Home and End go to the first and the last, Enter stands in the footer."""

from __future__ import annotations

from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.widgets import DataTable


class RowTable(DataTable[object]):
    """A table whose cursor is a whole row; left and right show the columns beside."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("home", "scroll_top", "First row", show=False),
        Binding("end", "scroll_bottom", "Last row", show=False),
    ]

    def __init__(self, *, id: str, zebra_stripes: bool = False) -> None:
        super().__init__(id=id, classes="pane", cursor_type="row", zebra_stripes=zebra_stripes)


class OpenTable(RowTable):
    """A table whose rows are opened."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "select_cursor", "Open")]
