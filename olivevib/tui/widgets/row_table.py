"""Tables of rows: Home and End go to the first and the last, Enter stands in the footer."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.widgets import DataTable
from textual.widgets._data_table import CellKey, RowKey


class RowTable(DataTable[object]):
    """A table whose cursor is a whole row; left and right show the columns beside."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("home", "scroll_top", "First row", show=False),
        Binding("end", "scroll_bottom", "Last row", show=False),
    ]

    def __init__(self, *, id: str, zebra_stripes: bool = False) -> None:
        super().__init__(id=id, classes="pane", cursor_type="row", zebra_stripes=zebra_stripes)

    # Textual (8.2.8) widens columns when it is idle, for new rows and for changed cells, and keeps
    # the lines that were drawn before: such a row stayed cut.

    def _update_column_widths(self, updated_cells: set[CellKey]) -> None:
        """Widen the columns for changed cells; what was drawn before is drawn again."""
        super()._update_column_widths(updated_cells)
        self._draw_again()

    def _update_dimensions(self, new_rows: Iterable[RowKey]) -> None:
        """Widen the columns for new rows; what was drawn before is drawn again."""
        super()._update_dimensions(new_rows)
        self._draw_again()

    def _draw_again(self) -> None:
        self._clear_caches()
        self.refresh()


class OpenTable(RowTable):
    """A table whose rows are opened."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "select_cursor", "Open")]
