"""Looking for a marker by its own drawing, several pixels off, sharp or smeared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey
from olivevib.detection.blur import Blur
from olivevib.detection.pixels import Singles
from olivevib.detection.template import COARSE, Template, draw_template, module_stretches_px
from olivevib.marker import MarkerLayout

STEEP = 0.57  # share of its box that a marker fills, below which a search needs a mask
WHITE_MODULES = 0.9  # around the dark square that a search sees
LEAST_MATCH = 0.5  # correlation of the best place below which nothing is there
PATHS_PX = (8.0, 14.0, 20.0)  # of a motion that a smeared marker may have
DIRECTIONS = 6
SMEARED_REACH_PX = 10
HALVED_PX = 2.8  # narrowest module from which half the pixels are enough to search with


@dataclass(frozen=True)
class Patch:
    """A drawing at whole pixels: levels (h, w) uint8 from ``corner`` (2,); mask (h, w) or None.

    halved: each level is the mean of 2 x 2 pixels, and corner counts these.
    """

    levels: Grey
    corner: NDArray[np.intp]
    mask: Singles | None
    halved: bool = False


class Scene:
    """A frame, and the same at half the size, made once it is asked for."""

    def __init__(self, grey: Grey) -> None:
        self.grey = grey
        self._half: Grey | None = None

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.grey.shape[1], self.grey.shape[0]

    def at(self, halved: bool) -> Grey:
        """The frame in whole or halved pixels."""
        if not halved:
            return self.grey
        if self._half is None:
            height, width = (n // 2 for n in self.grey.shape)
            even = self.grey[: 2 * height, : 2 * width]
            self._half = np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA))
        return self._half


@dataclass(frozen=True)
class Place:
    """Where a drawing agrees best: moved_px (2,) from where it was drawn, and the correlation."""

    moved_px: Floats
    score: float


def patch_of(template: Template, layout: MarkerLayout) -> Patch:
    """The drawing of a template, cut to the marker's box, with a mask where it is turned in it."""
    at_px = template.texture[:: template.samples, :: template.samples, 0]
    reach = layout.modules / 2 + WHITE_MODULES
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]) * reach + [0, 0, 1]
    corners = square @ template.H.T
    corners = corners[:, :2] / corners[:, 2:]
    origin = template.origin_px.astype(int)
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - origin, 0)
    high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) - origin + 1, at_px.shape[1::-1])
    halved = narrowest_module_px(template.H) >= HALVED_PX
    if halved:  # whole pairs of pixels of the image
        low += (low + origin) % 2
        high -= (high - low) % 2
    level = 40 + 170 * np.clip(at_px[low[1] : high[1], low[0] : high[0]], 0, 1)
    corner, inside = origin + low, corners - origin - low
    if halved:
        level = np.asarray(cv2.resize(level, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))
        corner, inside = corner // 2, (inside - 0.5) / 2
    mask: Singles | None = None
    d, e = inside[1] - inside[0], inside[3] - inside[0]
    if abs(float(d[0] * e[1] - d[1] * e[0])) < STEEP * level.size:
        covered = np.zeros(level.shape, np.uint8)
        cv2.fillConvexPoly(covered, np.rint(inside).astype(np.int32), 1)
        mask = covered.astype(np.float32)
    return Patch(np.rint(level).astype(np.uint8), corner.astype(np.intp), mask, halved)


def narrowest_module_px(H: Floats) -> float:
    """The shorter stretch of a module at the centre, px."""
    return float(module_stretches_px(H)[1])


def search(scene: Scene, patch: Patch, around: NDArray[np.intp], reach: int) -> Place | None:
    """The place within ``reach`` px of a move ``around`` (2,) px where a drawing agrees best.

    By normalised correlation and a parabola; None where nothing agrees or the image ends.
    """
    grey, every = scene.at(patch.halved), 2 if patch.halved else 1
    height, width = grey.shape
    h, w = patch.levels.shape
    reach = -(-reach // every)
    left, top = (int(v) for v in patch.corner + np.rint(around / every).astype(int) - reach)
    a, b = max(left, 0), max(top, 0)
    c, d = min(left + w + 2 * reach, width), min(top + h + 2 * reach, height)
    if c - a < w or d - b < h:
        return None
    window = grey[b:d, a:c]
    if patch.mask is None:
        score = cv2.matchTemplate(window, patch.levels, cv2.TM_CCOEFF_NORMED)
    else:
        score = cv2.matchTemplate(window, patch.levels, cv2.TM_CCOEFF_NORMED, mask=patch.mask)
        score[~(np.abs(score) <= 1.01)] = -1  # flat places divide by nothing
    j, i = divmod(int(score.argmax()), score.shape[1])
    if score[j, i] < LEAST_MATCH:
        return None
    at = np.array([i + _vertex(score[j], i), j + _vertex(score[:, i], j)])
    return Place(every * (at + np.array([a, b]) - patch.corner), float(score[j, i]))


def _vertex(line: NDArray[Any], k: int) -> float:
    """Offset of a parabola's top through the peak and its neighbours."""
    if not 0 < k < line.size - 1:
        return 0.0
    before, peak, after = (float(v) for v in line[k - 1 : k + 2])
    bend = before - 2 * peak + after
    return 0.5 * (before - after) / bend if bend < 0 else 0.0


def smeared_start(
    grey: Grey, white: Singles, H: Floats, layout: MarkerLayout
) -> tuple[Floats, Blur] | None:
    """Pose (3, 3) and motion of a marker that moved during the exposure, near pose H.

    The drawing is smeared along several paths and looked for; the best agreement is the start.
    """
    scene = Scene(grey)
    best: tuple[Place, Blur] | None = None
    for length in PATHS_PX:
        for angle in np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
            blur = Blur(motion_px=(length * float(np.cos(angle)), length * float(np.sin(angle))))
            patch = patch_of(draw_template(white, H, blur, layout.quiet, COARSE), layout)
            place = search(scene, patch, np.zeros(2, np.intp), SMEARED_REACH_PX)
            if place is not None and (best is None or place.score > best[0].score):
                best = (place, blur)
    if best is None:
        return None
    move = np.eye(3)
    move[:2, 2] = best[0].moved_px
    out: Floats = move @ H
    return out, best[1]
