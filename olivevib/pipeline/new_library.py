"""A new library of codes, drawn at random and written as TOML that a person can edit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from olivevib.files.atomic import write_text_atomic
from olivevib.marker import MarkerLayout, MarkerLibrary, generate_library, library_text
from olivevib.progress import Tick, silent
from olivevib.values import counted

FEW = 24  # codes of a generated library: a tree with fewer markers is hardly measured


@dataclass(frozen=True)
class NewLibrary:
    """What is asked for: modules in which codes differ, mirror images told apart, code modules."""

    distance: int
    mirrors: bool = False
    seed: int = 1
    code: int = 7

    @property
    def command(self) -> str:
        """The command that draws the same library."""
        mirrors = " --mirrors" if self.mirrors else ""
        return (
            f"olivevib markers generate --distance {self.distance}{mirrors} "
            f"--seed {self.seed} --code {self.code}"
        )


def write_library(
    asked: NewLibrary, workspace: Path, output: str = "", tick: Tick = silent
) -> tuple[MarkerLibrary, Path]:
    """Draw it and write it: to ``output``, else into the workspace's ``markers`` folder."""
    layout = MarkerLayout(modules=asked.code + 4, code=asked.code, bar=asked.code)
    library = generate_library(asked.distance, asked.mirrors, asked.seed, layout, tick=tick)
    markers = workspace / "markers"
    folder = markers if markers.is_dir() else workspace
    path = workspace / Path(output).expanduser() if output else folder / f"{library.name}.toml"
    write_text_atomic(path, library_text(library, f"made by: {asked.command}"))
    return library, path


def drawn_words(library: MarkerLibrary, asked: NewLibrary) -> str:
    """How many codes came out, and what gives more where they are few."""
    count = counted(library.ids.size, "code")
    if library.ids.size >= FEW:
        return f"{count}."
    mirrors = ", do without mirror images" if asked.mirrors else ""
    return (
        f"{count}. That is few. For more, lower the distance (now {asked.distance}; 12 gives "
        f"many){mirrors}, try another seed, or take larger codes (now {asked.code} modules a "
        "side; then printed modules are smaller)."
    )
