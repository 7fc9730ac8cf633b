"""Calibration boards: what a SPEC such as ``charuco:4x5,square=54,...`` means, in millimetres."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from olivevib.arrays import Floats, floats
from olivevib.errors import UsageError

LENGTHS = {  # kind: its lengths, the larger first
    "charuco": ("square", "marker"),
    "arucogrid": ("size", "gap"),
    "chessboard": ("square",),
    "coded": ("pitch", "size"),
}
WORDS = {"charuco": ("inverted", "legacy"), "arucogrid": ("inverted",), "chessboard": ()}
EXAMPLES = {
    "charuco": "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000",
    "arucogrid": "arucogrid:5x7,size=40,gap=10,dict=DICT_6X6_250",
    "chessboard": "chessboard:9x6,square=25",
    "coded": "coded:5x5,pitch=60,size=44",
}
CORNERS_PER_MARKER = 5  # arucogrid: point 5 m is the centre of marker m, 5 m + 1 ... 4 its corners


@dataclass(frozen=True)
class Board:
    """One flat calibration board: its points in mm by point id, and how to recognise it.

    columns x rows count squares (charuco), markers (arucogrid, coded) or inner corners
    (chessboard). ``lengths_mm`` holds the SPEC's lengths by key. Board frame: x right, y down as
    printed, z into the board. ``first`` is the id of the first marker of a coded board.
    """

    kind: str
    columns: int
    rows: int
    lengths_mm: Mapping[str, float] = field(hash=False)
    dictionary: str = ""
    inverted: bool = False
    legacy: bool = False
    first: int = 1

    @cached_property
    def points_mm(self) -> Floats:
        """All points (N, 3) in the board frame; the row is the point id."""
        return floats("points_mm", _POINTS[self.kind](self), (None, 3))

    @property
    def half_width_mm(self) -> float:
        """Half of the larger side between the outermost points, mm."""
        span = self.points_mm.max(axis=0) - self.points_mm.min(axis=0)
        return float(span.max()) / 2

    @property
    def pitch_mm(self) -> float:
        """Distance between neighbouring squares or markers, mm."""
        lengths = self.lengths_mm
        if self.kind == "arucogrid":
            return lengths["size"] + lengths["gap"]
        return lengths["pitch" if self.kind == "coded" else "square"]

    @property
    def spec(self) -> str:
        """The SPEC that ``parse_board`` reads back to this board."""
        parts = [f"{self.kind}:{self.columns}x{self.rows}"]
        parts += [f"{key}={self.lengths_mm[key]:g}" for key in LENGTHS[self.kind]]
        if self.dictionary:
            parts.append(f"dict={self.dictionary}")
        parts += [word for word in ("inverted", "legacy") if getattr(self, word)]
        if self.kind == "coded" and self.first != 1:
            parts.append(f"first={self.first}")
        return ",".join(parts)

    @property
    def name(self) -> str:
        """The board in words, for people: ``ChArUco board 4x5, 54 mm squares, inverted``."""
        what = {
            "charuco": "ChArUco board",
            "arucogrid": "grid of ArUco markers",
            "chessboard": "chessboard",
            "coded": "board of coded markers",
        }[self.kind]
        unit = "squares" if self.kind in ("charuco", "chessboard") else "spacing"
        words = [f"{what} {self.columns}x{self.rows}", f"{self.pitch_mm:g} mm {unit}"]
        words += [word for word in ("inverted", "legacy") if getattr(self, word)]
        return ", ".join(words)


def _grid(columns: int, rows: int, pitch: float, start: float) -> Floats:
    x, y = np.meshgrid(np.arange(columns) * pitch + start, np.arange(rows) * pitch + start)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def _charuco_points(board: Board) -> Floats:
    square = board.lengths_mm["square"]
    return _grid(board.columns - 1, board.rows - 1, square, square)


def _chessboard_points(board: Board) -> Floats:
    return _grid(board.columns, board.rows, board.lengths_mm["square"], 0.0)


def _coded_points(board: Board) -> Floats:
    return _grid(board.columns, board.rows, board.lengths_mm["pitch"], 0.0)


def _arucogrid_points(board: Board) -> Floats:
    size = board.lengths_mm["size"]
    centres = _grid(board.columns, board.rows, board.pitch_mm, size / 2)
    h = size / 2
    around = np.array([[0, 0, 0], [-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]])
    return np.asarray((centres[:, None] + around).reshape(-1, 3), dtype=np.float64)


_POINTS = {
    "charuco": _charuco_points,
    "arucogrid": _arucogrid_points,
    "chessboard": _chessboard_points,
    "coded": _coded_points,
}


def dictionary_names() -> tuple[str, ...]:
    """The marker dictionaries that OpenCV knows."""
    return tuple(sorted(n for n in dir(cv2.aruco) if n.startswith("DICT_") and n.upper() == n))


def markers_on(kind: str, columns: int, rows: int) -> int:
    """How many coded markers such a board carries."""
    return {"charuco": columns * rows // 2, "chessboard": 0}.get(kind, columns * rows)


def parse_board(spec: str) -> Board:
    """The board that a SPEC describes; every fault of the SPEC is told at once.

    Grammar: ``KIND:COLUMNSxROWS,key=value,...`` with lengths in mm, see EXAMPLES. Raises
    UsageError naming each wrong or missing key with the nearest right one.
    """
    kind, _, rest = spec.strip().partition(":")
    if kind not in LENGTHS:
        raise UsageError(
            f"--board {spec!r}: {kind!r} is no kind of board{_nearest(kind, LENGTHS)}",
            f"known kinds: {', '.join(LENGTHS)}",
            "write for example " + EXAMPLES["charuco"],
        )
    counts, *items = [item.strip() for item in rest.split(",")]
    table: dict[str, object] = {"kind": kind, "counts": counts}
    faults: list[str] = []
    for item in items:
        key, equals, value = (part.strip() for part in item.partition("="))
        if key in table:
            faults.append(f"{key} is given twice")
        table[key] = value if equals else True
    return _checked(spec, table, faults)


def board_from_table(table: Mapping[str, object]) -> Board:
    """The board of a TOML table such as ``kind = "charuco"``, ``columns = 4``, ``square = 54``.

    Keys are those of the SPEC plus ``kind``, ``columns`` and ``rows``. Raises UsageError with all
    faults.
    """
    kind = str(table.get("kind", ""))
    rest = {
        k: v for k, v in table.items() if k not in ("kind", "columns", "rows") and v is not False
    }
    if kind not in LENGTHS:
        return parse_board(kind + ":")  # tells the known kinds
    counts = f"{table.get('columns', '?')}x{table.get('rows', '?')}"
    return _checked(str(dict(table)), {"kind": kind, "counts": counts, **rest}, [])


def _checked(spec: str, table: Mapping[str, object], faults: list[str]) -> Board:
    kind = str(table["kind"])
    known = (*LENGTHS[kind], *_other_keys(kind))
    for key in table:
        if key not in ("kind", "counts", *known):
            faults.append(f"{key or '(nothing)'} is no key of a {kind}{_nearest(key, known)}")
    columns, rows = _counts(kind, str(table["counts"]), faults)
    lengths = {key: _length(key, table, faults) for key in LENGTHS[kind]}
    _fits(kind, lengths, faults)
    dictionary = _dictionary(kind, columns * rows, table, faults)
    words = {word: _word(word, table, faults) for word in WORDS.get(kind, ())}
    first = _first(table, faults) if kind == "coded" else 1
    if faults:
        why = "\n".join(f"- {fault}" for fault in faults)
        raise UsageError(f"--board {spec!r} is wrong", why, "write for example " + EXAMPLES[kind])
    return Board(kind, columns, rows, lengths, dictionary, first=first, **words)


def _other_keys(kind: str) -> tuple[str, ...]:
    if kind == "coded":
        return ("first",)
    return ("dict", *WORDS[kind]) if WORDS[kind] else ()


def _counts(kind: str, text: str, faults: list[str]) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text)
    least = 3 if kind in ("charuco", "chessboard") else 2
    if not match:
        faults.append(f"columns x rows must stand first, such as 4x5; got {text!r}")
        return 0, 0
    columns, rows = int(match[1]), int(match[2])
    if min(columns, rows) < least or max(columns, rows) > 100:
        faults.append(f"{text}: a {kind} has {least} to 100 columns and rows")
        return 0, 0
    return columns, rows


def _length(key: str, table: Mapping[str, object], faults: list[str]) -> float:
    if key not in table:
        faults.append(f"{key} (mm) is missing")
        return math.nan
    try:
        value = float(str(table[key]))
    except ValueError:
        value = math.nan
    if not 0 < value < 10_000:
        faults.append(f"{key} must be a length in mm above 0, got {table[key]!r}")
        return math.nan
    return value


def _fits(kind: str, lengths: Mapping[str, float], faults: list[str]) -> None:
    outer, inner = {"charuco": ("square", "marker"), "coded": ("pitch", "size")}.get(kind, ("", ""))
    if outer and lengths[inner] >= lengths[outer]:
        faults.append(f"{inner}={lengths[inner]:g} must be smaller than {outer}={lengths[outer]:g}")


def _dictionary(kind: str, cells: int, table: Mapping[str, object], faults: list[str]) -> str:
    if kind not in ("charuco", "arucogrid"):
        return ""
    names = dictionary_names()
    given = str(table.get("dict", ""))
    name = given.upper()  # OpenCV spells some both ways: DICT_APRILTAG_36h11, ..._36H11
    if not name:
        faults.append("dict is missing, such as dict=DICT_4X4_1000")
    elif name not in names:
        faults.append(f"dict={given} is no dictionary{_nearest(given, names)}")
    else:
        needed = cells // 2 if kind == "charuco" else cells
        codes = len(predefined(name).bytesList)
        if needed > codes:
            faults.append(f"dict={name} has {codes} markers, the board needs {needed}")
    return name


def _word(word: str, table: Mapping[str, object], faults: list[str]) -> bool:
    value = table.get(word, False)
    if not isinstance(value, bool):
        faults.append(f"{word} takes no value, got {word}={value}")
    return value is True


def _first(table: Mapping[str, object], faults: list[str]) -> int:
    text = str(table.get("first", "1"))
    if not re.fullmatch(r"\d{1,6}", text):
        faults.append(f"first must be a marker id, got {text!r}")
        return 1
    return int(text)


def _nearest(word: str, known: Mapping[str, object] | tuple[str, ...]) -> str:
    upper = {k.upper(): k for k in known}
    close = difflib.get_close_matches(word.upper(), upper, n=1, cutoff=0.5)
    return f"; did you mean {upper[close[0]]}?" if close else ""


def predefined(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of that name."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def own_codes(board: Board) -> cv2.aruco.Dictionary:
    """The codes of its markers alone: a thousand others need not be compared with each square."""
    book = predefined(board.dictionary)
    count = markers_on(board.kind, board.columns, board.rows)
    own = np.ascontiguousarray(book.bytesList[:count])
    return cv2.aruco.Dictionary(own, book.markerSize, book.maxCorrectionBits)
