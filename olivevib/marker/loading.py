"""Getting a marker library by name: shipped, from a TOML file, or a foreign family of OpenCV."""

from __future__ import annotations

import difflib
from importlib import resources

import numpy as np

from olivevib.errors import InputError, UsageError
from olivevib.marker.layout import MarkerLayout, MarkerLibrary
from olivevib.marker.text import parse_library

LARGEST_FILE = 4_000_000  # bytes; 20 000 codes of 49 modules are 1.3 MB


def shipped_libraries() -> tuple[str, ...]:
    """Names of the libraries that come with the program."""
    folder = resources.files("olivevib") / "markers"
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def shipped_text(name: str) -> str:
    """The TOML text of a shipped library, to copy into a workspace's folder ``markers``."""
    return (resources.files("olivevib") / "markers" / f"{name}.toml").read_text(encoding="utf-8")


def load_library(name: str = "olive49") -> MarkerLibrary:
    """A library by its name, by its TOML file, or as ``aruco:DICT_4X4_1000``, ``apriltag:36h11``.

    Raises InputError for a file with faults (all of them at once), UsageError for an unknown name.
    """
    name = str(name)
    family, colon, dictionary = name.partition(":")
    if colon and family in ("aruco", "apriltag"):
        return _foreign(family, dictionary)
    if name.endswith(".toml"):
        return parse_library(_read(name), name)
    if name in shipped_libraries():
        return parse_library(shipped_text(name), name)
    near = difflib.get_close_matches(name, shipped_libraries(), 1)
    raise UsageError(
        f"There is no marker library {name}",
        f"Shipped are: {', '.join(shipped_libraries())}.",
        (f"Did you mean {near[0]}? " if near else "")
        + "Name a shipped library, a file ending in .toml, aruco:DICT_4X4_1000 or apriltag:36h11.",
    )


def _read(path: str) -> str:
    try:
        with open(path, encoding="utf-8") as file:  # noqa: PTH123 (a numeric room has no pathlib)
            text = file.read(LARGEST_FILE + 1)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not a UTF-8 text"
        raise InputError(
            f"The marker library {path} cannot be read",
            str(reason),
            "Check the path; `olivevib markers list` shows the libraries that are shipped.",
        ) from None
    if len(text) > LARGEST_FILE:
        raise InputError(
            f"The marker library {path} is too large",
            f"It has more than {LARGEST_FILE} characters.",
            "Split it, or name the right file.",
        )
    return text


def _foreign(family: str, dictionary: str) -> MarkerLibrary:
    """Ids of an OpenCV dictionary; its codes stay with OpenCV."""
    from cv2 import aruco

    full = dictionary if family == "aruco" else f"DICT_APRILTAG_{dictionary}"
    known = [key for key in dir(aruco) if key.startswith("DICT_")]
    match = {key.upper(): key for key in known}.get(full.upper())
    tags = match is not None and "APRILTAG" in match.upper()
    if match is None or tags != (family == "apriltag"):
        raise UsageError(
            f"There is no family {family}:{dictionary}",
            "OpenCV knows: " + ", ".join(_families(known, family)) + ".",
            "Use one of these names.",
        )
    found = aruco.getPredefinedDictionary(getattr(aruco, match))
    count, side = found.bytesList.shape[0], int(found.markerSize)
    return MarkerLibrary(
        f"{family}:{dictionary}",
        np.arange(count),
        np.zeros((count, 0, 0), dtype=np.bool_),
        MarkerLayout(modules=side + 2, code=side, bar=side + 2, quiet=1),
        distance=2 * int(found.maxCorrectionBits) + 1,
        family=family,
        dictionary=match,
    )


def _families(known: list[str], family: str) -> list[str]:
    tags = "DICT_APRILTAG_"
    if family == "apriltag":
        return sorted(key.removeprefix(tags) for key in known if key.startswith(tags))
    return sorted(key for key in known if "APRILTAG" not in key.upper())
