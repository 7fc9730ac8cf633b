"""The layout of delimited text from its first 64 kB: separator, decimal mark, header, first row."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from itertools import islice

from olivevib.files.accelerometer.cells import Dialect
from olivevib.files.accelerometer.units import parse_unit

SNIFF_BYTES = 65536
COMMENTS = ("#", ";", "%", "//", "'")
_MAY_BE_COMMENT = "#;% \t"
_DIALECTS = (
    *(Dialect(s, ".") for s in ("\t", ";", ",", "|")),
    *(Dialect(s, ",") for s in ("\t", ";", "|", ",")),
    *(Dialect(" ", d) for d in ".,"),
    *(Dialect(s, ",", ".") for s in ("\t", ";", "|")),
    *(Dialect(s, ".", ",") for s in ("\t", ";", "|", ",")),
    *(Dialect(s, d, t) for s in ("\t", ";") for d, t in ((",", " "), (".", "'"), (",", "'"))),
)


@dataclass(frozen=True)
class TextLayout:
    """How a delimited text is to be read.

    first_row: 0-based line of the first data row; kinds: one letter a column (n number, s stamp,
    t text, b empty); names and units as written ("" where there is none); metadata: key, value.
    """

    encoding: str
    dialect: Dialect
    first_row: int
    kinds: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    metadata: tuple[tuple[str, str], ...]
    comment: str = ""
    padded: bool = False  # blanks after separators

    def words(self) -> str:
        """The layout in words, shown to the technician."""
        separator = {"\t": "tab", " ": "blanks", ";": "semicolon", ",": "comma"}
        name = separator.get(self.dialect.separator, self.dialect.separator)
        mark = {".": "point", ",": "comma"}[self.dialect.decimal]
        thousands = f", thousands {self.dialect.thousands!r}" if self.dialect.thousands else ""
        return (
            f"{self.encoding}, separator {name}, decimal {mark}{thousands}, "
            f"data from line {self.first_row + 1}"
        )


def lines_of(text: str, *, cut: bool) -> list[str]:
    """The lines of a text as a CSV reader counts them; a cut last line is left out."""
    lines = re.split(r"\r\n|\n|\r", text)
    return lines[:-1] if cut and len(lines) > 1 else lines


def sniff(
    lines: list[str],
    encoding: str,
    *,
    separator: str | None = None,
    decimal: str | None = None,
) -> TextLayout | None:
    """The layout of ``lines``, or None where no dialect makes columns of numbers of them.

    The dialect is the one under which most cells of the last lines are numbers or stamps in rows
    of one width; the header is what stands before the first such row.
    """
    hints = _hints(lines)
    cells = (x for x in reversed(lines) if x.strip() and not x.lstrip().startswith(COMMENTS))
    tail = list(islice(cells, 200))[::-1]
    if not tail:
        return None
    sample = tail[-1 :: -max(1, len(tail) // 30)]
    present = {s for s in ("\t", ";", ",", "|", " ") if any(s in line for line in sample)} or {","}
    scored = [
        (_score(d, sample), d)
        for d in _DIALECTS
        if d.separator in present
        and d.separator == (separator or d.separator)
        and d.decimal == (decimal or d.decimal)
    ]
    if not scored:
        return None
    best = max(score for score, _ in scored)
    if best < 0.4:
        return None
    equal = [d for score, d in scored if score > best - 1e-9]
    preferred = [d for d in equal if hints.get("decimal_separator") == d.decimal]
    dialect = _thousands_in_disguise((preferred or equal)[0], tail)
    return _layout(lines, encoding, dialect, tail)


def _score(dialect: Dialect, lines: list[str]) -> float:
    """Share of number and stamp cells times share of rows of the commonest width."""
    rows = [dialect.split(line) for line in lines]
    width, count = Counter(len(row) for row in rows).most_common(1)[0]
    good = total = 0.0
    for row in rows:
        if len(row) == width:
            kinds = dialect.kinds(row)
            good += kinds.count("n") + kinds.count("s") + 0.5 * kinds.count("b")
            total += len(kinds)
    if not total:
        return 0.0
    # Equal shares: more columns are better (a separator was found), thousands marks are worse.
    bonus = min(width, 8) * 1e-4 - (1e-3 if dialect.thousands else 0.0)
    share = good / total
    return share * count / len(rows) + (bonus if share > 0 else 0.0)


def _thousands_in_disguise(dialect: Dialect, lines: list[str]) -> Dialect:
    """``1.107`` beside ``-57`` and never ``0.5``: the point groups thousands (and so the comma).

    Only where each number with a mark has groups of three, none starts with 0, and a column mixes
    them with numbers that have no mark; a column of measured decimals does none of that.
    """
    if dialect.thousands or dialect.separator == dialect.decimal:
        return dialect
    mark = re.escape(dialect.decimal)
    grouped = re.compile(rf"\s*[+-]?[1-9]\d{{0,2}}(?:{mark}\d{{3}})+\s*")
    plain = re.compile(r"\s*[+-]?\d{1,3}\s*")
    rows = [dialect.split(line) for line in lines]
    seen = {"grouped": 0, "mixed": 0}
    for column in zip(*(r for r in rows if len(r) == len(rows[-1])), strict=True):
        marked = [c for c in column if dialect.decimal in c and dialect.kinds([c]) == "n"]
        if not all(grouped.fullmatch(c) for c in marked):
            return dialect
        seen["grouped"] += len(marked)
        seen["mixed"] += bool(marked) and any(plain.fullmatch(c) for c in column)
    if seen["grouped"] < 20 or not seen["mixed"]:
        return dialect
    other = "," if dialect.decimal == "." else "."
    return Dialect(dialect.separator, other, dialect.decimal)


def _layout(lines: list[str], encoding: str, dialect: Dialect, tail: list[str]) -> TextLayout:
    rows = [dialect.split(line) for line in tail]
    width = Counter(len(row) for row in rows).most_common(1)[0][0]
    kinds = _column_kinds([dialect.kinds(r) for r in rows if len(r) == width], width)
    first = _first_row(lines, dialect, kinds)
    above = lines[:first]
    names, units, used = _header(above, dialect, width, len(kinds.rstrip("b")))
    metadata = _metadata([x for k, x in enumerate(above) if k not in used], dialect)
    metadata += tuple(("header mark", above[k].lstrip()[:1]) for k in sorted(used)[:1])
    begun = (x.lstrip()[:1] for x in lines[first:] if x[:1] in _MAY_BE_COMMENT)
    mark = next((c for c in begun if c and c in "#;%"), "")
    comment = "" if mark == dialect.separator else mark
    padded = any(cell[:1] == " " for row in rows for cell in row[1:])
    return TextLayout(encoding, dialect, first, kinds, names, units, metadata, comment, padded)


def _column_kinds(rows: list[str], width: int) -> str:
    """The commonest kind of each column; a column of blanks and numbers is one of numbers."""
    kinds = ""
    for k in range(width):
        counts = Counter(row[k] for row in rows)
        blank = counts.pop("b", 0)
        kinds += counts.most_common(1)[0][0] if counts else ("b" if blank else "t")
    return kinds


def _first_row(lines: list[str], dialect: Dialect, kinds: str) -> int:
    """The first line that has the columns' kinds and is followed by another one (or the end)."""
    for k, line in enumerate(lines):
        if line.strip() and _is_row(dialect.kinds(dialect.split(line)), kinds):
            after = islice((x for x in islice(lines, k + 1, None) if x.strip()), 3)
            following = [dialect.kinds(dialect.split(x)) for x in after]
            if not following or any(_is_row(found, kinds) for found in following):
                return k
    return len(lines)


def _is_row(found: str, kinds: str) -> bool:
    if len(found) != len(kinds):
        return False
    pairs = [(f, k) for f, k in zip(found, kinds, strict=True) if k in "ns"]
    return all(f in (k, "b") for f, k in pairs) and any(f != "b" for f, _ in pairs)


def _uncommented(line: str) -> str:
    stripped = line.strip()
    for mark in COMMENTS:
        if stripped.startswith(mark):
            return stripped[len(mark) :].strip()
    return line


def _header(
    above: list[str], dialect: Dialect, width: int, filled_width: int
) -> tuple[tuple[str, ...], tuple[str, ...], set[int]]:
    """Names and units of the columns from the lines above the data, and the lines they took."""
    filled = [k for k, line in enumerate(above) if line.strip()]
    rows = {k: _header_cells(above[k], dialect, width) for k in filled[-2:]}
    if filled and rows[filled[-1]] is None and filled_width < width:  # a separator ends each row
        short = {k: _header_cells(above[k], dialect, filled_width) for k in filled[-2:]}
        rows = {k: cells and (*cells, *[""] * (width - filled_width)) for k, cells in short.items()}
    none = ("",) * width
    if not filled or rows[filled[-1]] is None:
        return none, none, set()
    last = rows[filled[-1]] or none
    if not _all_units(last):
        return last, none, {filled[-1]}
    names = rows[filled[-2]] if len(filled) > 1 else None
    return names or none, last, set(filled[-2:] if names else filled[-1:])


def _header_cells(line: str, dialect: Dialect, width: int) -> tuple[str, ...] | None:
    """The cells of a header line of ``width`` columns; None where it has another number of them."""
    text = _uncommented(line)
    splits = (dialect.split(text), *(re.split(p, text.strip()) for p in _OTHER_SPLITS))
    for split in splits:
        cells = [c.strip().strip('"').strip() for c in split]
        if cells and re.fullmatch(r"(?i)headers?|columns?|fields?", cells[0]):
            cells = cells[1:]
        if len(cells) > width and not any(cells[width:]):
            cells = cells[:width]
        if len(cells) == width and (width > 1 or dialect.kinds(cells) != "n"):
            return tuple(cells)
    return None


_OTHER_SPLITS = (r"\t+", r"\s{2,}", r"\s*;\s*", r"\s*,\s*")


def _all_units(cells: tuple[str, ...]) -> bool:
    """True for a row of units alone, as in ``s;g;g;g``; names such as ``t`` or ``g`` are few."""
    filled = [c for c in cells if c.strip("-")]
    return len(filled) >= max(2, len(cells) - 1) and all(parse_unit(c) for c in filled)


def _metadata(lines: list[str], dialect: Dialect) -> tuple[tuple[str, str], ...]:
    """Keys and values of the header: ``key;value``, ``key: value``, ``a = value, b = value``."""
    found: list[tuple[str, str]] = []
    for line in lines[:500]:
        text = _uncommented(line).strip()
        if not text:
            continue
        cells = [c.strip().strip('"') for c in dialect.split(text)]
        spelled = dialect.separator == " " and (":" in text or "=" in text)
        if len(cells) > 1 and cells[0] and not (spelled or "=" in cells[0] or ":" in cells[0]):
            found.append((cells[0].casefold(), " ".join(c for c in cells[1:] if c)))
            continue
        text = re.sub(r"^[^:=]*:\s*(?=[^:=]+=)", "", text)
        for part in re.split(r",\s(?=[^,]*[:=])", text):
            key, mark, value = part.partition("=") if "=" in part else part.partition(":")
            found.append((key.strip().casefold(), value.strip()) if mark else ("", part.strip()))
    return tuple(found)


def _hints(lines: list[str]) -> dict[str, str]:
    """What LabVIEW and Excel say of themselves: ``Decimal_Separator``, ``sep=``."""
    found = {}
    for line in lines[:30]:
        match = re.match(r"(?i)\s*decimal[_ ]separator[\s;:=]+([.,])", line)
        if match:
            found["decimal_separator"] = match[1]
    return found
