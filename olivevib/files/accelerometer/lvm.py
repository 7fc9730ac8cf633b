"""LabVIEW measurement files (LVM): header blocks, any decimal mark, empty X column, segments."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import InputError
from olivevib.files.accelerometer.cells import Dialect
from olivevib.files.accelerometer.encoding import find_encoding
from olivevib.files.accelerometer.record import Channel, Table
from olivevib.files.accelerometer.sniff import TextLayout
from olivevib.files.accelerometer.stamps import written_start
from olivevib.files.accelerometer.text import text_table

_END = re.compile(rb"\*\*\*End_of_Header\*\*\*[^\r\n]*\r?\n?")


@dataclass(frozen=True)
class _Segment:
    """One segment: its header's cells by key, its column names, its rows as bytes."""

    header: dict[str, list[str]]
    names: list[str]
    rows: bytes

    def numbers(self, key: str, decimal: str) -> list[float]:
        texts = [c.replace(",", ".") if decimal == "," else c for c in self.header.get(key, [])]
        return [float(t) for t in texts if re.fullmatch(r"\s*[+-]?[\d.]+([eE][+-]?\d+)?\s*", t)]


def is_lvm(head: bytes) -> bool:
    """True where a file begins as LabVIEW writes it."""
    return head.lstrip(b"\xef\xbb\xbf\r\n\t ").startswith(b"LabVIEW Measurement")


def read_lvm(data: bytes, source: str) -> Table:
    """Read an LVM file; units stand in its header, times come of X0 and Delta_X or the X column.

    Several segments of the same channels are joined on their own times. InputError where the
    header is cut, or the abscissa is no time.
    """
    encoding = find_encoding(data[:65536]) or "cp1252"
    ends = [(m.start(), m.end()) for m in _END.finditer(data)]
    if not ends:
        raise _damaged(source, "The end of its header is missing.")
    file_header = _header(data[: ends[0][0]].decode(encoding, errors="replace"), None)
    separator = {"comma": ",", ",": ","}.get(_one(file_header, "separator").casefold(), "\t")
    decimal = _one(file_header, "decimal_separator") or "."
    segments = _segments(data, ends, separator, encoding)
    if not segments:
        raise _damaged(source, "It has no header of channels.")
    style = _one(file_header, "x_columns").casefold()
    dialect = Dialect(separator, decimal if decimal in ".," else ".")
    tables = [_segment_table(s, dialect, style, encoding, source) for s in segments]
    return _joined(tables, [_start(s, file_header) for s in segments], source)


def _segments(
    data: bytes, ends: list[tuple[int, int]], separator: str, encoding: str
) -> list[_Segment]:
    found = []
    for k, (start, end) in enumerate(ends[1:], start=1):
        before = data[ends[k - 1][1] : start]
        at = max(before.rfind(b"\nChannels"), 0)
        header = _header(before[at:].decode(encoding, errors="replace"), separator)
        stop = len(data)
        if k + 1 < len(ends):
            block = data[end : ends[k + 1][0]]
            at = block.rfind(b"\nChannels")
            stop = end + (at if at >= 0 else len(block))
        title, _, rows = data[end:stop].partition(b"\n")
        names = title.decode(encoding, errors="replace").rstrip("\r\n").split(separator)
        found.append(_Segment(header, names, rows))
    return found


def _header(text: str, separator: str | None) -> dict[str, list[str]]:
    """Keys (lower case) and the cells after them."""
    rows = (re.split(separator or r"[\t,;]", line, maxsplit=0) for line in text.splitlines())
    if separator is None:  # the decimal comma must survive: split at the first tab or comma alone
        rows = (re.split(r"\t|,(?!$)|;", line, maxsplit=1) for line in text.splitlines())
    return {row[0].strip().casefold(): [c.strip() for c in row[1:]] for row in rows if len(row) > 1}


def _one(header: dict[str, list[str]], key: str) -> str:
    cells = header.get(key, [])
    return cells[0].strip() if cells else ""


def _start(segment: _Segment, file_header: dict[str, list[str]]) -> datetime | None:
    for header in (segment.header, file_header):
        day, clock = _one(header, "date"), _one(header, "time")
        clock = re.sub(r"([.,]\d{6})\d+", r"\1", clock)
        start = written_start(f"{day} {clock}")
        if start is not None:
            return start
    return None


def _segment_table(
    segment: _Segment, dialect: Dialect, style: str, encoding: str, source: str
) -> Table:
    """One segment's channels and stamps."""
    count = len([c for c in segment.header.get("samples", []) if c]) or max(
        1, len(segment.names) - 2
    )
    dimension = _one(segment.header, "x_dimension").casefold()
    if dimension not in ("", "time"):
        raise InputError(
            f"{source} is no time history: its abscissa is {dimension}.",
            "",
            "Save the waveform itself, not its spectrum.",
        )
    pairs = style == "multi"
    width = 2 * count if pairs else 1 + count
    names = [*segment.names[:width], *[""] * (width - len(segment.names)), "Comment"]
    layout = TextLayout(
        encoding, dialect, 0, "n" * width + "t", tuple(names), ("",) * (width + 1), ()
    )
    table = text_table(segment.rows, layout, source, "LVM")
    columns = table.channels[:width]
    units = segment.header.get("y_unit_label", [])
    step = 2 if pairs else 1
    values = columns[1::step]
    channels = tuple(
        Channel(
            c.name or f"Channel {k + 1}", units[k] if k < len(units) else "", c.values, bad=c.bad
        )
        for k, c in enumerate(values)
    )
    stamps = columns[0].values if style in ("one", "multi") else None
    return _timed(channels, stamps, segment, dialect, source)


def _timed(
    channels: tuple[Channel, ...],
    stamps: Floats | None,
    segment: _Segment,
    dialect: Dialect,
    source: str,
) -> Table:
    layout = f"LabVIEW, decimal {'comma' if dialect.decimal == ',' else 'point'}"
    if stamps is not None and np.isfinite(stamps).any():
        return Table("LVM", channels, stamps_s=stamps, layout=layout)
    steps = segment.numbers("delta_x", dialect.decimal)
    if not steps or steps[0] <= 0:
        raise _damaged(source, "It has neither times nor Delta_X.")
    t0_s = (segment.numbers("x0", dialect.decimal) or [0.0])[0]
    return Table("LVM", channels, rate_hz=1 / steps[0], t0_s=t0_s, layout=layout)


def _joined(tables: list[Table], starts: list[datetime | None], source: str) -> Table:
    """Segments one after the other, each at its own date and time."""
    first = tables[0]
    if len(tables) == 1:
        return Table(**{**first.__dict__, "start": starts[0]})
    if any(len(t.channels) != len(first.channels) for t in tables):
        raise _damaged(source, "Its segments have different channels.")
    stamps = []
    for table, start in zip(tables, starts, strict=True):
        shift = (start - starts[0]).total_seconds() if start and starts[0] else 0.0
        own = table.stamps_s
        if own is None:
            own = table.t0_s + np.arange(table.rows) / (table.rate_hz or 1.0)
        stamps.append(own + shift)
    channels = tuple(
        Channel(
            c.name,
            c.unit,
            np.concatenate([t.channels[k].values for t in tables]),
            bad=sum(t.channels[k].bad for t in tables),
        )
        for k, c in enumerate(first.channels)
    )
    return Table(
        "LVM", channels, stamps_s=np.concatenate(stamps), start=starts[0], layout=first.layout
    )


def _damaged(source: str, why: str) -> InputError:
    return InputError(
        f"{source} cannot be read as a LabVIEW file.", why, "Save it again from LabVIEW, or as CSV."
    )
