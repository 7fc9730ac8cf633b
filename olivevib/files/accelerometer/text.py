"""Delimited text of any make: sniffed, then read by pandas' C reader."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution, InputError
from olivevib.files.accelerometer.encoding import find_encoding
from olivevib.files.accelerometer.record import SEPARATORS, Channel, ImportOptions, Table
from olivevib.files.accelerometer.sniff import SNIFF_BYTES, TextLayout, lines_of, sniff

_SKIPPED = "Skipping line "  # what the reader says of each row with too many cells
_NEWLINE = re.compile(rb"\r\n|\n|\r")


def read_text(data: bytes, options: ImportOptions, source: str) -> Table:
    """Read delimited text; InputError where it holds no columns of numbers."""
    layout = sniff_bytes(data, options, source)
    return text_table(data, layout, source, "delimited text")


def sniff_bytes(data: bytes, options: ImportOptions, source: str) -> TextLayout:
    """The layout of the text in ``data``; InputError where there is none."""
    head = data[:SNIFF_BYTES]
    encoding = options.encoding or find_encoding(head)
    if encoding is None:
        raise InputError(
            f"{source} is neither text nor a known recording.",
            "It holds control bytes.",
            "Export the recording from the logger's own software as CSV.",
        )
    lines = lines_of(_decoded(head, encoding, source), cut=len(data) > len(head))
    separator = SEPARATORS[options.separator] if options.separator else None
    layout = sniff(lines, encoding, separator=separator, decimal=options.decimal)
    if layout is None or layout.first_row >= len(lines):
        raise InputError(
            f"{source} holds no columns of numbers.",
            "No separator and decimal mark make a table of its lines."
            if any(line.strip() for line in lines)
            else "The file is empty.",
            "Open it in an editor and see whether it is the recording; if so, name separator and "
            "decimal mark.",
        )
    _refuse_ambiguous_commas(lines, layout, source)
    return layout


def _decoded(head: bytes, encoding: str, source: str) -> str:
    try:
        return head.decode(encoding, errors="replace")
    except LookupError as error:
        raise InputError(
            f"{source}: the encoding {encoding} is unknown.", "", "Use utf-8, utf-16 or cp1252."
        ) from error


def _refuse_ambiguous_commas(lines: list[str], layout: TextLayout, source: str) -> None:
    """Decimal comma and comma separator at once: twice as many cells as names."""
    if layout.dialect.separator != "," or any(layout.names) or layout.first_row == 0:
        return
    names = [c for c in lines[layout.first_row - 1].split(",") if c.strip()]
    if len(layout.kinds) in (2 * len(names), 2 * len(names) - 1) and len(names) > 1:
        raise InputError(
            f"{source} uses the comma both between columns and within numbers.",
            f"The header has {len(names)} names, the rows have {len(layout.kinds)} cells.",
            "Export it again with a semicolon or tab between the columns.",
        )


def text_table(data: bytes, layout: TextLayout, source: str, format: str) -> Table:
    """The table of ``data`` under ``layout``."""
    frame, skipped = _read_frame(data, layout, source)
    channels = tuple(_channels(frame, layout))
    cautions = []
    if skipped:
        cautions.append(
            Caution(
                "sensor-rows-skipped",
                f"{skipped} rows of {source} have too many cells and were left out.",
                "Look at these rows in an editor; the times of the others are unaffected.",
            )
        )
    return Table(
        format,
        channels,
        layout.metadata,
        layout=layout.words(),
        decimal=layout.dialect.decimal,
        cautions=tuple(cautions),
    )


def _read_frame(data: bytes, layout: TextLayout, source: str) -> tuple[Any, int]:
    """The data rows as a pandas frame, and the number of rows that were left out."""
    import pandas as pd

    dialect = layout.dialect
    body, encoding, start = _body(data, layout)
    stream = io.BytesIO(body)
    stream.seek(start)
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", pd.errors.ParserWarning)
            frame = pd.read_csv(
                stream,
                sep=r"\s+" if dialect.separator == " " else dialect.separator,
                decimal=dialect.decimal,
                thousands=dialect.thousands or None,
                header=None,
                names=list(range(len(layout.kinds))),
                index_col=False,
                comment=layout.comment or None,
                encoding=encoding,
                encoding_errors="replace",
                on_bad_lines="warn",
                skipinitialspace=layout.padded,
                low_memory=False,  # a column in one piece: its type is decided once
                engine="c",
            )
    except (ValueError, pd.errors.ParserError, OverflowError, LookupError) as error:
        raise InputError(
            f"{source} cannot be read as {layout.words()}.",
            str(error).splitlines()[0] if str(error) else "",
            "Open it in an editor; name separator and decimal mark if the guess is wrong.",
        ) from error
    return frame, sum(str(warning.message).count(_SKIPPED) for warning in told)


def _body(data: bytes, layout: TextLayout) -> tuple[bytes, str, int]:
    """The file's bytes without a cut last row, their encoding, and where the data rows begin."""
    encoding = "utf-8" if layout.encoding == "utf-8-sig" else layout.encoding
    if encoding.startswith(("utf-16", "utf-32")):
        data, encoding = data.decode(encoding, errors="replace").encode("utf-8"), "utf-8"
    start = 3 if data.startswith(b"\xef\xbb\xbf") else 0
    for _, end in zip(range(layout.first_row), _NEWLINE.finditer(data), strict=False):
        start = end.end()
    if not data.endswith((b"\n", b"\r")):
        data = _without_cut_row(data, layout)
    return data, encoding, start


def _without_cut_row(data: bytes, layout: TextLayout) -> bytes:
    """Leave out a last line with too few cells: the recording was cut while it was written."""
    at = max(data.rfind(b"\n"), data.rfind(b"\r")) + 1
    last = data[at:].decode("latin-1")
    whole = len(layout.dialect.split(last)) == len(layout.kinds)
    return data if whole or at == 0 else data[:at]


def _channels(frame: Any, layout: TextLayout) -> Iterator[Channel]:
    rows = list(zip(layout.names, layout.units, layout.kinds, strict=True))
    for k, (name, unit, kind) in enumerate(rows):
        column = frame[k]
        if kind == "n":
            plain = column.dtype.kind in "fiu"
            values = column.to_numpy(dtype=np.float64) if plain else _numbers(column, layout)
            unread = int(np.isnan(values).sum())
            yield Channel(name, unit, values, bad=unread if unread < values.size else 0)
        else:
            texts = column.astype(str).to_numpy(dtype=object)
            yield Channel(name, unit, np.full(len(texts), np.nan), text=texts)


def _numbers(column: Any, layout: TextLayout) -> Floats:
    """A column with unreadable cells as numbers, NaN for these.

    The reader has turned some chunks of it into numbers already; only words are turned here.
    """
    import pandas as pd

    words = column.map(lambda cell: isinstance(cell, str)).to_numpy(dtype=np.bool_)
    text = column[words].astype(str).str.replace("−", "-", regex=False)
    if layout.dialect.thousands:
        text = text.str.replace(layout.dialect.thousands, "", regex=False)
    if layout.dialect.decimal == ",":
        text = text.str.replace(",", ".", regex=False)
    values = np.full(len(column), np.nan)
    values[words] = pd.to_numeric(text, errors="coerce").to_numpy(dtype=np.float64)
    values[~words] = column[~words].to_numpy(dtype=np.float64)
    return np.asarray(np.where(np.isinf(values), np.nan, values))
