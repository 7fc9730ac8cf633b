"""Cells of delimited text: what is a number under a decimal mark, a stamp, or empty."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from functools import cached_property

_BLANK = re.compile(r"(?i)\s*(nan|na|n/a|null|none|inf|-inf|#n/a|-|--|)\s*")
STAMP = re.compile(
    r"(?=.*\d[-/.:]\d)\s*(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})?"
    r"[T ,_]*(\d{1,3}:\d{2}(:\d{2})?([.,:]\d+)?)?"
    r"\s*([AaPp]\.?[Mm]\.?)?\s*(Z|UTC|[+-]\d{2}:?\d{2})?\s*"
)


@dataclass(frozen=True)
class Dialect:
    """How cells are separated and numbers written; separator " " stands for runs of blanks."""

    separator: str
    decimal: str
    thousands: str = ""

    def split(self, line: str) -> list[str]:
        """The cells of a line, quotes respected."""
        if self.separator == " ":
            return line.split()
        if '"' in line:
            try:
                return next(csv.reader([line], delimiter=self.separator), [])
            except csv.Error:
                return line.split(self.separator)
        return line.split(self.separator)

    @cached_property
    def number(self) -> re.Pattern[str]:
        """What a number looks like in this dialect."""
        mark = re.escape(self.decimal)
        whole = r"\d+"
        if self.thousands:
            whole = rf"(?:\d{{1,3}}(?:{re.escape(self.thousands)}\d{{3}})+|\d+)"
        tail = rf"(?:{mark}\d*)?" if self.decimal == "." else rf"(?:{mark}\d+)?"
        return re.compile(rf"\s*[+\-−]?(?:{whole}{tail}|{mark}\d+)(?:[eEdD][+-]?\d+)?\s*")

    def kinds(self, cells: list[str]) -> str:
        """One letter a cell: n number, s stamp, b blank or NaN, t other text."""
        return "".join([_kind(cell, self.number) for cell in cells])


def _kind(cell: str, number: re.Pattern[str]) -> str:
    if number.fullmatch(cell):
        return "n"
    if _BLANK.fullmatch(cell):
        return "b"
    return "s" if len(cell) < 60 and STAMP.fullmatch(cell) else "t"
