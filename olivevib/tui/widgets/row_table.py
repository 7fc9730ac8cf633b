"""Tables of rows: Home and End go to the first and the last, Enter stands in the footer."""

from __future__ import annotations

from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.widgets import DataTable
from textual.widgets._data_table import CellKey


class RowTable(DataTable[object]):
    """A table whose cursor is a whole row; left and right show the columns beside."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("home", "scroll_top", "First row", show=False),
        Binding("end", "scroll_bottom", "Last row", show=False),
    ]

    def __init__(self, *, id: str, zebra_stripes: bool = False) -> None:
        super().__init__(id=id, classes="pane", cursor_type="row", zebra_stripes=zebra_stripes)

    def _update_column_widths(self, updated_cells: set[CellKey]) -> None:
        """Widen the columns; lines that were drawn with the old widths are drawn again.

        Textual keeps such lines (8.2.8): a row drawn between update and idle stayed cut.
        """
        super()._update_column_widths(updated_cells)
        self._clear_caches()
        self.refresh()


class OpenTable(RowTable):
    """A table whose rows are opened."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "select_cursor", "Open")]
