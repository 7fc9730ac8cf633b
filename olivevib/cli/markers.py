"""Verbs on marker libraries and prints: list, show, draw, sheet, board, check, generate."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib import values
from olivevib.cli.console import Console

if TYPE_CHECKING:
    from olivevib.marker import MarkerLibrary
    from olivevib.pipeline.prints import Prints

FEW = 24  # codes of a generated library: a tree with fewer markers is hardly measured


def _library(name: str) -> MarkerLibrary:
    from olivevib.marker import load_library
    from olivevib.trial.workspace import find_library

    return load_library(find_library(name, Path()))


def list_(arguments: argparse.Namespace, console: Console) -> int:
    """Print every library that can be named, with its number of markers and its distance."""
    from olivevib.marker import load_library, shipped_libraries

    for name in shipped_libraries():
        print(_line(name, load_library(name)))
    for path in sorted(Path("markers").glob("*.toml")):
        print(_line(path.name, load_library(str(path))))
    console.say("Foreign families are named as aruco:DICT_4X4_1000, apriltag:36h11.")
    return 0


def _line(name: str, library: MarkerLibrary) -> str:
    layout = library.layout
    mirrors = ", mirror images told apart" if library.mirrors else ""
    return (
        f"{name:20} {library.ids.size:5d} markers, {layout.modules} x {layout.modules} modules, "
        f"distance {library.distance}{mirrors}"
    )


def show(arguments: argparse.Namespace, console: Console) -> int:
    """Print markers as they look, dark modules as blocks."""
    library = _library(arguments.library)
    asked = ",".join([*arguments.id, *([arguments.ids] if arguments.ids else [])])
    ids = values.id_list(asked) or tuple(int(i) for i in library.ids)
    from olivevib.pipeline.libraries import only_known

    for marker in only_known(library, ids).ids.tolist():
        print(f"{library.name} {marker}")
        print(_blocks(library, marker))
    return 0


def _blocks(library: MarkerLibrary, marker: int) -> str:
    from olivevib.files.prints import marker_modules

    return "\n".join(
        "  " + "".join("██" if dark else "  " for dark in row)
        for row in marker_modules(library, marker)
    )


def draw(arguments: argparse.Namespace, console: Console) -> int:
    """Draw one marker with its quiet zone as PNG."""
    from olivevib.files.prints import marker_picture, write_picture

    picture = marker_picture(_library(arguments.library), arguments.id, arguments.module_px)
    print(write_picture(Path(arguments.output), picture))
    return 0


def sheet(arguments: argparse.Namespace, console: Console) -> int:
    """Print markers at exact size on sheets."""
    from olivevib.pipeline.prints import marker_sheets

    library, ids = _library(arguments.library), values.id_list(arguments.ids)
    prints = marker_sheets(library, ids, arguments.size, arguments.paper)
    return _write(prints, arguments.output, console)


def board(arguments: argparse.Namespace, console: Console) -> int:
    """Print a calibration board at exact size."""
    from olivevib.pipeline.prints import board_sheet

    prints = board_sheet(arguments.board, _library(arguments.library), arguments.paper)
    return _write(prints, arguments.output, console)


def _write(prints: Prints, output: str, console: Console) -> int:
    from olivevib.pipeline.prints import ADVICE, write_prints

    for path in write_prints(prints, Path(output)):
        print(path)
    console.say(ADVICE)
    return 0


def check(arguments: argparse.Namespace, console: Console) -> int:
    """Prove the distances of a library; exit 1 where a code is too close to another."""
    from olivevib.marker import check_library

    found = check_library(_library(arguments.library))
    print(f"{found.name}: {found.codes} codes, promised distance {found.promised}")
    for words, value in (
        ("to its own rotations", found.rotation),
        ("between codes, over rotations", found.pair),
        ("to mirror images", found.mirror),
    ):
        print(f"  smallest distance {words:30} {'–' if value is None else value}")
    for close in found.too_close:
        print(f"  TOO CLOSE: {close}")
    print("sound" if found.sound else f"{len(found.too_close)} pairs are too close")
    return 0 if found.sound else 1


def generate(arguments: argparse.Namespace, console: Console) -> int:
    """Draw a new library and write it as TOML that a person can edit."""
    from olivevib.files.atomic import write_text_atomic
    from olivevib.marker import MarkerLayout, generate_library, library_text

    layout = MarkerLayout(modules=arguments.code + 4, code=arguments.code, bar=arguments.code)
    library = generate_library(
        arguments.distance, arguments.mirrors, arguments.seed, layout, tick=console.tick
    )
    folder = Path("markers") if Path("markers").is_dir() else Path()
    path = Path(arguments.output) if arguments.output else folder / f"{library.name}.toml"
    mirrors = " --mirrors" if arguments.mirrors else ""
    made = (
        f"made by: olivevib markers generate --distance {arguments.distance}{mirrors} "
        f"--seed {arguments.seed} --code {arguments.code}"
    )
    write_text_atomic(path, library_text(library, made))
    console.say(f"{library.ids.size} code{'s' * (library.ids.size != 1)}")
    if library.ids.size < FEW:
        mirrors = ", leave --mirrors out" if arguments.mirrors else ""
        console.say(
            f"That is few. For more, lower --distance (now {arguments.distance}; 12 gives many)"
            f"{mirrors}, try another --seed, or take larger codes with --code "
            f"(now {arguments.code}; then printed modules are smaller)."
        )
    print(path)
    return 0
