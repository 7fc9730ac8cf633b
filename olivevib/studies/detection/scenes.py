"""Pictures of many markers, or one marker with fresh noise, read by a detector and scored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from olivevib.arrays import Bools, Floats, Grey
from olivevib.studies.detection.canvas import (
    CLEAR,
    MIDDLE,
    Hardship,
    Look,
    centre_of,
    ground,
    lay,
    moved,
    photo,
    pose,
)
from olivevib.studies.detection.readers import Peer, Seen

HIT_PX = 3.0
WITHIN_95 = 5.991  # chi-squared of two degrees of freedom
WIDE_PX = 70.0  # frontal size above which fewer markers share a picture
PLAIN = Look()
PHOTO_NOISES = 25  # fresh noises of one pose

Weather: TypeAlias = Callable[[np.random.Generator], Callable[[Floats, float], Hardship]]
Develop: TypeAlias = Callable[[Floats, float, np.random.Generator], Grey]


@dataclass(frozen=True)
class Cell:
    """What one cell of a table holds still: frontal size px, tilt (low, high) deg, look, what lies
    on the markers (drawn anew for each picture), and how light becomes a picture.
    """

    size_px: float
    tilt_deg: tuple[float, float]
    look: Look = PLAIN
    weather: Weather | None = None
    develop: Develop = photo

    def modules_px(self, modules: int) -> float:
        """Length of a module at the mean tilt, px, where it is shortest."""
        tilt = np.radians(sum(self.tilt_deg) / 2)
        return float(self.size_px * np.cos(tilt) / modules)


@dataclass(frozen=True)
class Score:
    """Of N markers drawn: error (N, 2) px, NaN where missed; flagged (N,); normalised squared error
    (N,) by the stated covariance; and how many wrong ids were reported besides.
    """

    error: Floats
    flagged: Bools
    normalised: Floats
    wrong: int = 0

    @property
    def drawn(self) -> int:
        """Markers drawn."""
        return len(self.error)

    @property
    def found(self) -> Bools:
        """Which were found (N,)."""
        out: Bools = np.isfinite(self.error[:, 0])
        return out

    @property
    def share(self) -> float:
        """Share found."""
        return float(self.found.mean())

    @property
    def lower(self) -> float:
        """Lower 95 % limit of the share found."""
        return lower_limit(int(self.found.sum()), self.drawn)

    @property
    def rmse_px(self) -> float:
        """Root mean square error per axis of those found, px; NaN for none."""
        found = self.error[self.found]
        return float(np.sqrt((found**2).mean())) if len(found) else float("nan")

    @property
    def distance(self) -> Floats:
        """How far off each marker that was found is, px."""
        out: Floats = np.linalg.norm(self.error[self.found], axis=1)
        return out

    @property
    def worst_px(self) -> float:
        """Largest distance, px."""
        return float(self.distance.max(initial=0.0))

    @property
    def silent(self) -> int:
        """Markers more than 0.1 px off without a flag."""
        return int(((self.distance > 0.1) & ~self.flagged[self.found]).sum())

    @property
    def silent_px(self) -> float:
        """Largest distance of those without a flag, px."""
        return float(self.distance[~self.flagged[self.found]].max(initial=0.0))

    @property
    def inside(self) -> float:
        """Share of the centres found that lie inside their own 95 % ellipse; NaN without one."""
        known = self.normalised[self.found]
        return float((known < WITHIN_95).mean()) if np.isfinite(known).any() else float("nan")


def lower_limit(hits: int, of: int) -> float:
    """The share that 95 % of such samples would lie above (Clopper and Pearson, one-sided)."""
    from scipy.special import betaincinv

    return float(betaincinv(hits, of - hits + 1, 0.05)) if hits else 0.0


def pooled(scores: list[Score]) -> Score:
    """Several cells as one."""
    return Score(
        np.concatenate([s.error for s in scores]),
        np.concatenate([s.flagged for s in scores]),
        np.concatenate([s.normalised for s in scores]),
        sum(s.wrong for s in scores),
    )


def score(seen: list[Seen], truth: dict[int, Floats]) -> Score:
    """Reports against the true poses by id."""
    error = {i: np.full(2, np.nan) for i in truth}
    flagged, normalised = dict.fromkeys(truth, False), dict.fromkeys(truth, np.nan)
    wrong = 0
    for one in seen:
        off = one.centre - centre_of(truth[one.id]) if one.id in truth else np.full(2, np.inf)
        if not np.linalg.norm(off) < HIT_PX:
            wrong += 1
            continue
        error[one.id], flagged[one.id] = off, bool(one.flags)
        if one.covariance is not None:
            normalised[one.id] = float(off @ np.linalg.solve(one.covariance, off))
    return Score(
        np.array(list(error.values())).reshape(-1, 2),
        np.array(list(flagged.values()), dtype=np.bool_),
        np.array(list(normalised.values())),
        wrong,
    )


def places(size_px: float) -> Floats:
    """Where the markers of one picture stand, px."""
    across, down, x, y = (6, 4, 212, 174) if size_px <= WIDE_PX else (5, 3, 250, 232)
    left, top = MIDDLE[0] - x * (across - 1) / 2, MIDDLE[1] - y * (down - 1) / 2
    return np.array([[left + x * i, top + y * j] for j in range(down) for i in range(across)])


def picture(
    peer: Peer, cell: Cell, rng: np.random.Generator, light: Floats | None = None
) -> tuple[Grey, dict[int, Floats]]:
    """A picture full of markers and their poses by id."""
    light = ground(rng) if light is None else light
    hard = cell.weather(rng) if cell.weather else None
    truth = {}
    at = places(cell.size_px)
    ids = rng.permutation(list(peer.prints))[: len(at)]
    for marker, place in zip(ids.tolist(), at, strict=True):
        what = peer.prints[marker]
        angles = (rng.uniform(*cell.tilt_deg), rng.uniform(0, 360), rng.uniform(0, 360))
        H = pose(what.modules, cell.size_px, angles, place + rng.uniform(-5, 5, 2))
        lay(light, what, H, _turned(cell.look, rng), hard(H, what.modules / 2) if hard else CLEAR)
        truth[marker] = H
    return cell.develop(light, cell.look.noise, rng), truth


def full_pictures(
    peer: Peer, cell: Cell, markers: int, draws: Callable[[int], np.random.Generator]
) -> Score:
    """At least ``markers`` markers on pictures full of them; draws(k): the k-th picture's."""
    pictures = -(-markers // len(places(cell.size_px)))
    parts = []
    for k in range(pictures):
        grey, truth = picture(peer, cell, draws(k))
        parts.append(score(peer.read(grey), truth))
    return pooled(parts)


def fresh_noise(
    peer: Peer, cell: Cell, fits: int, draws: Callable[[int], np.random.Generator]
) -> Score:
    """At least ``fits`` readings of single markers, every one with noise of its own."""
    noises = min(PHOTO_NOISES, max(4, fits // 8))
    parts = []
    for k in range(-(-fits // noises)):
        rng = draws(k)
        light, marker, H = single(peer, cell, rng)
        for _ in range(noises):
            seen = peer.read(cell.develop(light, cell.look.noise, rng))
            parts.append(score(seen, {marker: H}))
    return pooled(parts)


def single(peer: Peer, cell: Cell, rng: np.random.Generator) -> tuple[Floats, int, Floats]:
    """The light of one marker in a small picture, its id and its pose."""
    side = window_px(cell)
    marker = int(rng.choice(list(peer.prints)))
    what = peer.prints[marker]
    angles = (rng.uniform(*cell.tilt_deg), rng.uniform(0, 360), rng.uniform(0, 360))
    at = np.array(MIDDLE) + rng.uniform(-0.5, 0.5, 2)
    corner = np.floor(np.array(MIDDLE)) - side // 2
    H = moved(pose(what.modules, cell.size_px, angles, at), -corner)
    light = ground(rng, (side, side))
    hard = cell.weather(rng) if cell.weather else None
    lay(light, what, H, _turned(cell.look, rng), hard(H, what.modules / 2) if hard else CLEAR)
    return light, marker, H


def window_px(cell: Cell) -> int:
    """Side of the small picture about one marker."""
    return int(2 * np.ceil(1.1 * cell.size_px + 14 + 0.5 * np.hypot(*cell.look.motion_px)))


def _turned(look: Look, rng: np.random.Generator) -> Look:
    """The look with its motion in a direction of chance."""
    path = float(np.hypot(*look.motion_px))
    if path == 0:
        return look
    a = rng.uniform(0, np.pi)
    return replace(look, motion_px=(path * float(np.cos(a)), path * float(np.sin(a))))
