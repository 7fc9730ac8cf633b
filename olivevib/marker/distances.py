"""How many modules two codes differ in, over rotations and mirror images: the proof of a library.

A code of c x c modules is packed into W = ceil(c * c / 64) unsigned words; the Hamming distance is
the population count of the exclusive or.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Ints
from olivevib.marker.layout import MarkerLibrary

Words = NDArray[np.uint64]  # (..., W)

TURNS = ("as printed", "turned by 90°", "turned by 180°", "turned by 270°")


def pack(codes: Bools) -> Words:
    """Codes (M, c, c) as words (M, W)."""
    packed = np.packbits(codes.reshape(len(codes), -1), axis=1)
    padded = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8)))
    return np.ascontiguousarray(padded).view(np.uint64)


def rotations(codes: Bools) -> Bools:
    """The four rotations (4, M, c, c) of codes (M, c, c), counter-clockwise by 0, 90, 180, 270°."""
    return np.stack([np.rot90(codes, k, axes=(1, 2)) for k in range(4)])


def mirrored(codes: Bools) -> Bools:
    """Codes (M, c, c) as a mirror shows them, left and right exchanged."""
    out: Bools = codes[:, :, ::-1]
    return out


def images(codes: Bools, mirrors: bool) -> Words:
    """Every view of every code as words (R, M, W): four rotations, then those of the mirror."""
    views = [rotations(codes)] + ([rotations(mirrored(codes))] if mirrors else [])
    return np.stack([pack(view) for view in np.concatenate(views)])


def distance(a: Words, b: Words) -> Ints:
    """Modules in which words (..., W) differ, with broadcasting."""
    out: Ints = np.bitwise_count(a ^ b).sum(axis=-1, dtype=np.int64)
    return out


@dataclass(frozen=True)
class CloseCodes:
    """Two codes, or two views of one, and the number of modules in which they differ."""

    id: int
    other: int
    view: str  # how the other one is seen: "turned by 90°", "mirrored, as printed", …
    distance: int

    def __str__(self) -> str:
        return f"code {self.id} and code {self.other} {self.view} differ in {self.distance} modules"


@dataclass(frozen=True)
class LibraryCheck:
    """What the codes of a library really keep of distance; None where there is nothing to compare.

    rotation: each code to its own rotations; pair: between codes over rotations; mirror: to every
    mirror image, its own included. ``too_close`` lists what falls below the library's promise
    (mirror images count only where the library promises them).
    """

    name: str
    codes: int
    promised: int
    rotation: int | None
    pair: int | None
    mirror: int | None
    too_close: tuple[CloseCodes, ...]

    @property
    def sound(self) -> bool:
        """Whether every code keeps the promised distance."""
        return not self.too_close

    def lines(self) -> list[str]:
        """The proof in words, a line a distance, the verdict last."""
        kinds = (
            ("to its own rotations", self.rotation),
            ("between codes, over rotations", self.pair),
            ("to mirror images", self.mirror),
        )
        return [
            f"{self.name}: {self.codes} codes, promised distance {self.promised}",
            *(f"  smallest distance {k:30} {'–' if v is None else v}" for k, v in kinds),
            *(f"  TOO CLOSE: {close}" for close in self.too_close),
            "sound" if self.sound else f"{len(self.too_close)} pairs are too close",
        ]


def check_library(library: MarkerLibrary) -> LibraryCheck:
    """Prove the distances of a library: own rotations, pairs over rotations, mirror images.

    A foreign family (codes not held here) gives None for all three and nothing too close.
    """
    if library.codes.size == 0:
        count = len(library.ids)
        return LibraryCheck(library.name, count, library.distance, None, None, None, ())
    table = distance_table(library.codes)
    same = np.eye(len(library.ids), dtype=np.bool_)
    return LibraryCheck(
        library.name,
        len(library.ids),
        library.distance,
        rotation=int(table[1:4][:, same].min()),
        pair=int(table[:4][:, ~same].min()) if len(same) > 1 else None,
        mirror=int(table[4:].min()),
        too_close=_too_close(library, table),
    )


def distance_table(codes: Bools) -> Ints:
    """Distances (8, M, M): code m as printed to view r of code n (rotations, then mirrors)."""
    views = images(codes, mirrors=True)
    return np.stack([distance(views[0][:, None], view[None]) for view in views])


def _too_close(library: MarkerLibrary, table: Ints) -> tuple[CloseCodes, ...]:
    """Every unordered pair of views below the promise, once, at its nearest view."""
    views = table.copy()
    views[0][np.diag_indices(len(library.ids))] = np.iinfo(np.int64).max
    if not library.mirrors:
        views = views[:4]
    nearest, turn = views.min(axis=0), views.argmin(axis=0)
    rows, columns = np.nonzero(np.triu(nearest < library.distance))
    found = []
    for m, n in zip(rows, columns, strict=True):
        mirror, k = divmod(int(turn[m, n]), 4)
        view = ("mirrored, " if mirror else "") + TURNS[k]
        pair = (int(library.ids[m]), int(library.ids[n]))
        found.append(CloseCodes(*pair, view, int(nearest[m, n])))
    return tuple(found)


def false_match_probability(library: MarkerLibrary, wrong: int) -> float:
    """Upper limit of the chance that a random code area passes for one of the library's.

    ``wrong``: unmatched modules that are accepted. A random pattern is within that distance of one
    of 4 M turned codes with at most 4 M Σ C(c², k) / 2^(c²), k = 0…wrong.
    """
    bits = library.layout.code**2
    near = sum(math.comb(bits, k) for k in range(wrong + 1))
    return float(min(1.0, 4 * len(library.ids) * near / 2**bits))
