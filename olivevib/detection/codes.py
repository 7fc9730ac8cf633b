"""Reading codes: modules sampled through homographies and matched with a library's rotations."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats, Grey, Ints
from olivevib.marker import MarkerLayout, MarkerLibrary

TOGETHER = 1024  # readings at a time: memory stays small whatever an image holds


@dataclass(frozen=True)
class Match:
    """The best code for each of N readings.

    row (N,): index in the library; turn (N,): how often np.rot90 turns the reading back to the
    code as printed; mismatches (N,): unmatched modules of the area code.
    """

    row: Ints
    turn: Ints
    mismatches: Ints


class CodeBook:
    """The codes of a library as they may appear: four turns each, as signs for one product."""

    def __init__(self, codes: Bools) -> None:
        self.count, self.side = len(codes), codes.shape[1]
        views = np.stack([np.rot90(codes, -k, axes=(1, 2)) for k in range(4)], axis=1)
        signs = np.where(views, 1.0, -1.0).reshape(4 * self.count, -1)
        self._signs: NDArray[np.float32] = signs.astype(np.float32)

    def match(self, dark: Bools) -> Match:
        """The nearest code of readings (N, c, c), True where dark."""
        bits = self.side**2
        read = np.where(dark, 1.0, -1.0).reshape(-1, bits).astype(np.float32)
        best, agreement = self._best(read)
        return Match(best // 4, best % 4, ((bits - agreement) / 2).round().astype(np.int64))

    def _best(self, read: NDArray[np.float32]) -> tuple[Ints, NDArray[np.float32]]:
        score = read @ self._signs.T
        best = score.argmax(axis=1)
        return best, np.take_along_axis(score, best[:, None], axis=1)[:, 0]


def library_book(library: MarkerLibrary) -> CodeBook:
    """The codes of a library."""
    return CodeBook(library.codes)


def mirrored_book(library: MarkerLibrary) -> CodeBook:
    """The codes of a library as a mirror shows them."""
    return CodeBook(library.codes[:, :, ::-1])


def square_homographies(corners: Floats, half: float) -> Floats:
    """H (N, 3, 3), H33 = 1, from the square (+-half, +-half), P1…P4, to corners (N, 4, 2).

    A square with three corners in line gives a singular or non-finite H. Closed form: Heckbert,
    Fundamentals of texture mapping (1989), section 2.2.3.
    """
    p1, p2, p3, p4 = np.moveaxis(corners, 1, 0)
    d1, d2, s = p2 - p3, p4 - p3, p1 - p2 + p3 - p4
    with np.errstate(divide="ignore", invalid="ignore"):
        det = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
        g = (s[:, 0] * d2[:, 1] - s[:, 1] * d2[:, 0]) / det
        h = (d1[:, 0] * s[:, 1] - d1[:, 1] * s[:, 0]) / det
    unit = np.empty((len(corners), 3, 3))
    unit[:, :2, 0] = p2 - p1 + g[:, None] * p2
    unit[:, :2, 1] = p4 - p1 + h[:, None] * p4
    unit[:, :2, 2] = p1
    unit[:, 2] = np.column_stack([g, h, np.ones_like(g)])
    shrink = np.array([[0.5 / half, 0, 0.5], [0, 0.5 / half, 0.5], [0, 0, 1.0]])
    H = unit @ shrink
    out: Floats = H / H[:, 2:, 2:]
    return out


def sample_points(layout: MarkerLayout, spread: float) -> Floats:
    """Centred module coordinates (modules², 9, 2) of a 3 x 3 mask in each module, row by row.

    ``spread``: distance of the mask's points, modules.
    """
    at = np.arange(layout.modules) - (layout.modules - 1) / 2
    v, u = np.meshgrid(at, at, indexing="ij")
    dv, du = np.meshgrid([-spread, 0.0, spread], [-spread, 0.0, spread], indexing="ij")
    return np.stack([u.ravel()[:, None] + du.ravel(), v.ravel()[:, None] + dv.ravel()], axis=-1)


def read_modules(grey: Grey, H: Floats, points: Floats) -> Floats:
    """Mean grey level (N, S) at the sample points (S, k, 2) seen through H (N, 3, 3); bilinear.

    Samples outside the image take the nearest pixel.
    """
    samples, mask, _ = points.shape
    p = np.column_stack([points.reshape(-1, 2), np.ones(samples * mask)]).T
    levels = np.empty((len(H), samples), dtype=np.float64)
    for first in range(0, len(H), TOGETHER):
        part = slice(first, first + TOGETHER)
        w = H[part] @ p
        maps = (w[:, :2] / w[:, 2:]).astype(np.float32)
        read = cv2.remap(
            grey, maps[:, 0], maps[:, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        levels[part] = read.reshape(-1, samples, mask).mean(axis=2)
    return levels
