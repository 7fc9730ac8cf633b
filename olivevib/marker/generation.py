"""Drawing a library of codes at random, each far enough from all the others (random lexicode)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from olivevib.arrays import Bools
from olivevib.errors import UsageError
from olivevib.marker.distances import Words, distance, images
from olivevib.marker.layout import MarkerLayout, MarkerLibrary
from olivevib.progress import Tick, silent

BATCH = 1 << 16  # candidates drawn at a time; part of what a seed means
DARK = (18 / 49, 31 / 49)  # share of dark modules: no plain codes
TRANSITIONS = 30 / 84  # share of neighbours that differ: edges to measure on


def generate_library(
    distance: int,
    mirrors: bool,
    seed: int,
    layout: MarkerLayout | None = None,
    budget: int = 20_000_000,
    name: str = "",
    tick: Tick = silent,
) -> MarkerLibrary:
    """Draw codes until ``budget`` candidates are used up; the same seed gives the same codes.

    Each code keeps ``distance`` to its own rotations, to all rotations of the codes accepted
    before and, with ``mirrors``, to all mirror images, its own included. A smaller budget gives
    the first codes of a larger one. ids count from 1. Raises UsageError when no code fits.
    """
    layout = layout or MarkerLayout()
    if not 1 <= distance <= layout.code**2:
        raise UsageError(
            f"A distance of {distance} modules is not possible",
            f"The code area has {layout.code**2} modules.",
            "Ask for --distance 18 (safe) down to 12 (many codes).",
        )
    codes: list[Bools] = []
    views: list[Words] = []  # (R, W) of every accepted code
    for drawn, batch in _batches(seed, layout.code, budget):
        _accept(batch, distance, mirrors, codes, views)
        tick(drawn, budget, f"{len(codes)} codes")
    if not codes:
        raise UsageError(
            f"No code of {layout.code} x {layout.code} modules keeps a distance of {distance}",
            f"{budget} patterns were tried.",
            "Ask for a smaller --distance, or a larger code area.",
        )
    return MarkerLibrary(
        name or f"olive{layout.code**2}d{distance}{'m' if mirrors else ''}s{seed}",
        np.arange(1, len(codes) + 1),
        np.stack(codes),
        layout,
        distance,
        mirrors=mirrors,
    )


def _batches(seed: int, side: int, budget: int) -> Iterator[tuple[int, Bools]]:
    """Random patterns (B, c, c) that are worth a look, with the number drawn so far."""
    rng = np.random.default_rng(seed)
    low, high = (round(share * side * side) for share in DARK)
    least = math.ceil(TRANSITIONS * 2 * side * (side - 1))
    for drawn in range(0, budget, BATCH):
        patterns = rng.integers(0, 2, (BATCH, side, side), dtype=np.uint8).astype(np.bool_)
        patterns = patterns[: budget - drawn]
        dark = patterns.sum(axis=(1, 2))
        changes = (patterns[:, 1:] != patterns[:, :-1]).sum(axis=(1, 2))
        changes += (patterns[:, :, 1:] != patterns[:, :, :-1]).sum(axis=(1, 2))
        good = (dark >= low) & (dark <= high) & (changes >= least)
        yield min(drawn + BATCH, budget), patterns[good]


def _accept(
    patterns: Bools, least: int, mirrors: bool, codes: list[Bools], views: list[Words]
) -> None:
    """Append to ``codes`` and ``views`` what keeps the distance to itself and all before it."""
    seen = images(patterns, mirrors)
    alone = (distance(seen[1:], seen[:1]) >= least).all(axis=0)
    patterns, seen = patterns[alone], seen[:, alone]
    for other in views:
        patterns, seen = _far(patterns, seen, other, least)
    while len(patterns):
        codes.append(patterns[0])
        views.append(seen[:, 0])
        patterns, seen = _far(patterns, seen, seen[:, 0], least)


def _far(patterns: Bools, seen: Words, other: Words, least: int) -> tuple[Bools, Words]:
    """What of ``patterns`` keeps the distance to every view (R, W) of one accepted code."""
    keep = (distance(seen[0][:, None], other[None]) >= least).all(axis=1)
    return patterns[keep], seen[:, keep]
