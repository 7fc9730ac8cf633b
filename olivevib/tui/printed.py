"""The form of a print: markers on sheets, or a calibration board, at exact size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.tui.fields import Field, FieldError, number_in, read_field
from olivevib.tui.plan import BOARDS, IDS, LIBRARIES, SIZES
from olivevib.values import counted

if TYPE_CHECKING:
    from olivevib.marker import MarkerLibrary
    from olivevib.pipeline.prints import Prints

PAPERS = ("A4", "A4-landscape", "A3", "A3-landscape", "A2", "letter", "tabloid")
KINDS = ("markers", "board")
FIELDS = (
    Field("what", "what", "markers or board; empty: markers", choices=KINDS),
    Field("library", "marker library", "olive49; aruco:…, a TOML file", choices=LIBRARIES),
    Field("ids", "marker ids", "1-24; empty: every id of the library", choices=IDS),
    Field("size", "marker size, mm", "outer side of the dark square", choices=SIZES),
    Field("board", "board", "coded:5x5,pitch=60,size=44", choices=BOARDS),
    Field("paper", "paper", "empty: A4 for markers, A3 for a board", choices=PAPERS),
    Field("output", "file", "ends in .pdf or .svg; empty: markers.pdf, board.pdf"),
)


@dataclass(frozen=True)
class Printed:
    """What the form describes: the pages, where they go, and both in words."""

    prints: Prints
    target: Path
    words: str


def printed(values: Mapping[str, str], workspace: Path) -> Printed:
    """What the form describes; FieldError or UsageError where it is none. Nothing is written."""
    from olivevib.marker import load_library
    from olivevib.trial.workspace import find_library

    said = {name: text.strip() for name, text in values.items() if text.strip()}
    what = said.get("what", "markers")
    if what not in KINDS:
        raise FieldError("what", f"{what!r} is not known.", "Write markers or board.")
    library = load_library(find_library(said.get("library", "olive49"), workspace))
    prints, words = _board(said, library) if what == "board" else _markers(said, library)
    target = workspace / Path(said.get("output", f"{what}.pdf")).expanduser()
    return Printed(prints, target, f"{words}, {counted(len(prints.pages), 'page')}")


def _markers(said: Mapping[str, str], library: MarkerLibrary) -> tuple[Prints, str]:
    from olivevib import values as typed
    from olivevib.pipeline.prints import marker_sheets

    size = number_in(said, "size")
    if size is None:
        raise FieldError("size", "how large the markers are is not said.", "Write e.g. 60.")
    paper = said.get("paper", "A4")
    prints = marker_sheets(library, read_field(said, "ids", typed.id_list) or (), size, paper)
    told = f"{counted(len(prints.ids), 'marker')} of {library.name}, {size:g} mm, on {paper}"
    return prints, told


def _board(said: Mapping[str, str], library: MarkerLibrary) -> tuple[Prints, str]:
    from olivevib.pipeline.prints import board_sheet

    if "board" not in said:
        raise FieldError("board", "the board is not named.", "Ctrl+O in that line offers some.")
    paper = said.get("paper", "A3")
    return board_sheet(said["board"], library, paper), f"board {said['board']} on {paper}"
