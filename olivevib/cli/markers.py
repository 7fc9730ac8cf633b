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
    from olivevib.files.prints import marker_text
    from olivevib.pipeline.libraries import only_known

    for marker in only_known(library, ids).ids.tolist():
        print(f"{library.name} {marker}")
        print(marker_text(library, marker))
    return 0


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
    print("\n".join(found.lines()))
    return 0 if found.sound else 1


def generate(arguments: argparse.Namespace, console: Console) -> int:
    """Draw a new library and write it as TOML that a person can edit."""
    from olivevib.pipeline.new_library import NewLibrary, drawn_words, write_library

    asked = NewLibrary(arguments.distance, arguments.mirrors, arguments.seed, arguments.code)
    library, path = write_library(asked, Path(), arguments.output or "", console.tick)
    console.say(drawn_words(library, asked))
    print(path)
    return 0
