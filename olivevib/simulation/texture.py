"""A print as an image that can be sampled anywhere: area-averaged, blurred just enough.

The texel is chosen for the view at hand: about a sixth of a pixel, across the edges, so that what
the texture blurs is a small, known part of the lens's blur (``Texture.variance_mm2``).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats
from olivevib.simulation.planar import Planar

TEXEL_PX = 0.16  # largest texel, in px across an edge
MOST_VARIANCE_PX2 = 0.045  # that a texture may blur, in its worst direction
STEPS_PER_OCTAVE = 4  # of texel sizes, so that few textures serve many views
BLUR_TEXELS = 1.2
RIM = 6  # empty texels around the card
KEPT = 12  # textures of one print that stay in memory

# Variance in texels²: area average, Gaussian, and the mean effect of linear interpolation.
VARIANCE_TEXELS2 = 1 / 12 + BLUR_TEXELS**2 + 1 / 6


@dataclass(frozen=True)
class Texture:
    """Card and white of a print: ``white`` (0…card) and ``card`` (0…1), both (H, W) float32.

    Texel (i, j) is centred at origin_mm + (j, i) * texel_mm.
    """

    white: NDArray[np.float32]
    card: NDArray[np.float32]
    origin_mm: Floats
    texel_mm: Floats  # (2,) along x and y

    @property
    def variance_mm2(self) -> Floats:
        """What sampling this texture blurs along the print's x and y (2,)."""
        return VARIANCE_TEXELS2 * self.texel_mm**2


class Textures:
    """The textures of one print, drawn when first needed; the result depends on the view alone."""

    def __init__(self, planar: Planar) -> None:
        self._planar = planar
        self._drawn: dict[tuple[int, int], Texture] = {}

    def at(self, px_per_mm: Floats) -> Texture:
        """The texture for a view with ``px_per_mm`` (2 px, 2 mm) around the print's centre.

        Seen steeply along a diagonal the print's axes nearly coincide and its square texels would
        blur along them: they are then made finer.
        """
        texel = TEXEL_PX * np.linalg.norm(np.linalg.inv(px_per_mm), axis=1)
        blur = px_per_mm * texel  # px (2) by texel (2)
        worst = VARIANCE_TEXELS2 * np.linalg.norm(blur, ord=2) ** 2
        texel = texel * float(np.sqrt(min(1.0, MOST_VARIANCE_PX2 / float(worst))))
        steps = np.floor(np.log2(texel) * STEPS_PER_OCTAVE)
        key = (int(steps[0]), int(steps[1]))
        if key not in self._drawn:
            if len(self._drawn) >= KEPT:
                self._drawn.pop(next(iter(self._drawn)))
            self._drawn[key] = draw(self._planar, 2.0 ** (np.array(key) / STEPS_PER_OCTAVE))
        return self._drawn[key]


def draw(planar: Planar, texel_mm: Floats) -> Texture:
    """The print with texels of (2,) mm: exact area averages, then the blur."""
    x0, y0, x1, y1 = planar.card_mm
    count = np.ceil(np.array([x1 - x0, y1 - y0]) / texel_mm).astype(int) + 2 * RIM
    edge = np.array([x0, y0]) - RIM * texel_mm
    across = [edge[i] + texel_mm[i] * np.arange(count[i] + 1) for i in (0, 1)]
    dark = _cover(planar.dark_mm, across[0], across[1])
    card = _cover(planar.card_mm[None], across[0], across[1])
    white = dark if planar.inverted else card - dark
    return Texture(_blurred(white), _blurred(card), edge + texel_mm / 2, texel_mm)


def _blurred(image: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), BLUR_TEXELS), dtype=np.float32)


def _cover(boxes_mm: Floats, x_mm: Floats, y_mm: Floats) -> NDArray[np.float32]:
    """Share of each cell between the lines x (W + 1,) and y (H + 1,) that the boxes cover."""
    along = [_share(boxes_mm[:, [i, i + 2]], line) for i, line in ((0, x_mm), (1, y_mm))]
    out: NDArray[np.float32] = (along[1].T @ along[0]).astype(np.float32)
    return out


def _share(spans: Floats, lines: Floats) -> Floats:
    low, high = lines[:-1], lines[1:]
    shared = np.minimum(spans[:, 1:], high) - np.maximum(spans[:, :1], low)
    out: Floats = np.maximum(shared, 0.0) / (high - low)
    return out
