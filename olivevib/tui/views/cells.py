"""A grid of character cells that plots are drawn into: braille dots below, words on top."""

from __future__ import annotations

import numpy as np
from rich.cells import cell_len
from rich.style import Style
from rich.text import Text

from olivevib.arrays import Bools, Floats

_WEIGHTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
BRAILLE = 0x2800


class Cells:
    """Characters and styles, ``columns`` x ``rows``; what lies outside is cut off."""

    def __init__(self, columns: int, rows: int) -> None:
        self.columns, self.rows = max(0, columns), max(0, rows)
        self._chars = [[" "] * self.columns for _ in range(self.rows)]
        self._styles: list[list[Style | None]] = [[None] * self.columns for _ in range(self.rows)]

    def put(self, x: int, y: int, text: str, style: Style | None = None) -> None:
        """Write text from cell (x, y) to the right; wide characters take two cells."""
        if not 0 <= y < self.rows:
            return
        for char in text:
            width = cell_len(char)
            if width and x >= 0 and x + width <= self.columns:
                self._chars[y][x] = char
                self._styles[y][x] = style
                if width == 2:
                    self._chars[y][x + 1] = ""
            x += width

    def put_right(self, x: int, y: int, text: str, style: Style | None = None) -> None:
        """Write text that ends before cell x."""
        self.put(x - cell_len(text), y, text, style)

    def dots(self, x: int, y: int, bitmap: Bools, style: Style | None = None) -> None:
        """Draw a bitmap (4 rows, 2 columns a cell) as braille; dots already there stay."""
        values = braille_values(bitmap)
        for row, column in zip(*np.nonzero(values), strict=True):
            self._dot(x + int(column), y + int(row), int(values[row, column]), style)

    def _dot(self, x: int, y: int, value: int, style: Style | None) -> None:
        if not (0 <= y < self.rows and 0 <= x < self.columns):
            return
        there = ord(self._chars[y][x] or " ")
        old = there - BRAILLE if BRAILLE <= there < BRAILLE + 256 else 0
        self._chars[y][x] = chr(BRAILLE + (old | value))
        self._styles[y][x] = style

    def text(self) -> Text:
        """The grid as text, one line a row."""
        out = Text(no_wrap=True, end="")
        for y in range(self.rows):
            self._append_row(out, y)
            if y + 1 < self.rows:
                out.append("\n")
        return out

    def _append_row(self, out: Text, y: int) -> None:
        chars, styles = self._chars[y], self._styles[y]
        start = 0
        for x in range(1, self.columns + 1):
            if x == self.columns or styles[x] is not styles[start]:
                out.append("".join(chars[start:x]), styles[start])
                start = x


def braille_values(bitmap: Bools) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """(rows, columns) braille dot patterns of a bitmap (4 rows, 2 columns); 0 = blank."""
    rows, columns = bitmap.shape[0] // 4, bitmap.shape[1] // 2
    blocks = bitmap[: 4 * rows, : 2 * columns].reshape(rows, 4, columns, 2)
    return np.asarray(np.einsum("rick,ik->rc", blocks.astype(np.int64), _WEIGHTS))


def scatter(shape: tuple[int, int], x: Floats, y: Floats) -> Bools:
    """A bitmap (height, width) with a dot at each finite (x, y) that lies inside."""
    bitmap = np.zeros(shape, dtype=np.bool_)
    good = np.isfinite(x) & np.isfinite(y)
    column, row = np.rint(x[good]).astype(np.int64), np.rint(y[good]).astype(np.int64)
    inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    bitmap[row[inside], column[inside]] = True
    return bitmap


def polyline(shape: tuple[int, int], x: Floats, y: Floats) -> Bools:
    """A bitmap of the line through the points; a NaN interrupts it."""
    if x.size < 2:
        return scatter(shape, x, y)
    reach = np.maximum(np.abs(np.diff(x)), np.abs(np.diff(y)))
    steps = np.where(np.isfinite(reach), np.minimum(np.ceil(reach), 4 * max(shape)), 0)
    counts = steps.astype(np.int64)
    segment = np.repeat(np.arange(counts.size), counts)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    share = (np.arange(segment.size) - first) / np.maximum(1, counts[segment])
    along_x = x[segment] + share * (x[segment + 1] - x[segment])
    along_y = y[segment] + share * (y[segment + 1] - y[segment])
    return scatter(shape, np.concatenate([along_x, x]), np.concatenate([along_y, y]))
