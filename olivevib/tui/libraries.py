"""The form of marker libraries: one to look at, and a new one to draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib.tui.fields import Field, FieldError, number_in, read_field
from olivevib.tui.harmless import harmless
from olivevib.tui.plan import IDS, LIBRARIES

if TYPE_CHECKING:
    from olivevib.marker import MarkerLibrary
    from olivevib.pipeline.new_library import NewLibrary

YES = ("yes", "no")
DRAWN = 12  # markers that are drawn on the screen where no ids are named
FIELDS = (
    Field("library", "marker library", "olive49; aruco:…, a TOML file", choices=LIBRARIES),
    Field("ids", "marker ids", "drawn below; empty: the first of them", choices=IDS),
    Field("picture", "picture of the first id", "ends in .png; empty: marker-ID.png"),
    Field("distance", "new: distance", "18: safe; 12: many codes", choices=("18", "15", "12")),
    Field("mirrors", "new: mirror images too", "yes: told apart; empty: no", choices=YES),
    Field("code", "new: code modules", "a side; empty: 7", choices=("7", "8", "9")),
    Field("seed", "new: seed", "empty: 1; another gives other codes"),
    Field("output", "new: file", "empty: into markers/, named by its distance"),
)


@dataclass(frozen=True)
class Shown:
    """A library as it is named in the form: what is proved of it, and some markers drawn."""

    library: MarkerLibrary
    ids: tuple[int, ...]
    words: str


def shown(values: Mapping[str, str], workspace: Path) -> Shown:
    """The library of the form; FieldError or UsageError where there is none."""
    from olivevib import values as typed
    from olivevib.files.prints import marker_text
    from olivevib.marker import check_library, load_library
    from olivevib.pipeline.libraries import only_known
    from olivevib.trial.workspace import find_library

    said = _said(values)
    library = load_library(find_library(said.get("library", "olive49"), workspace))
    asked = read_field(said, "ids", typed.id_list) or ()
    every = tuple(int(i) for i in only_known(library, asked).ids)
    ids = every if asked else every[:DRAWN]
    name = harmless(library.name, 60)
    proved = "\n".join(harmless(line, 120) for line in check_library(library).lines())
    drawn = "\n\n".join(f"{name} {i}\n{marker_text(library, i)}" for i in ids)
    return Shown(library, ids, f"{proved}\n\n{drawn}")


def picture_file(values: Mapping[str, str], told: Shown, workspace: Path) -> Path:
    """Where the picture of the first marker goes."""
    name = _said(values).get("picture", f"marker-{told.ids[0]}.png")
    return workspace / Path(name).expanduser()


def asked_for(values: Mapping[str, str]) -> tuple[NewLibrary, str]:
    """The new library of the form and its file; FieldError where the distance is missing."""
    from olivevib.pipeline.new_library import NewLibrary

    said = _said(values)
    mirrors = said.get("mirrors", "no")
    if mirrors not in YES:
        raise FieldError("mirrors", f"{mirrors!r} is not known.", "Write yes or no.")
    if "distance" not in said:
        why = "in how many modules any two codes differ is not said."
        raise FieldError("distance", why, "Write 18 for a safe library, 12 for many codes.")
    asked = NewLibrary(
        distance=_whole(said, "distance", 0),
        mirrors=mirrors == "yes",
        seed=_whole(said, "seed", 1),
        code=_whole(said, "code", 7),
    )
    return asked, said.get("output", "")


def _whole(said: Mapping[str, str], name: str, usual: int) -> int:
    value = number_in(said, name)
    if value is not None and value != int(value):
        raise FieldError(name, f"{said[name]!r} is no whole number.", "Write e.g. 18.")
    return usual if value is None else int(value)


def _said(values: Mapping[str, str]) -> dict[str, str]:
    return {name: text.strip() for name, text in values.items() if text.strip()}
