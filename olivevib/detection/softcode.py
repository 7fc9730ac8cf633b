"""Reading a code from grey levels: each module speaks as loudly as it is clear.

The levels of dark and white are taken from the marker itself in four ways; the library's code with
the best agreement wins. Source: knowledge, soft decoding.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats, Grey, Ints
from olivevib.detection.codes import read_modules, sample_points
from olivevib.marker import MarkerLibrary

MASK = 0.22  # modules between the 3 x 3 reads of a module
LOUDEST = 1.3  # agreement of one module, at most
CLOSING = np.ones((3, 3), dtype=np.uint8)  # modules
CHANNELS = 128  # readings that OpenCV takes side by side


@dataclass(frozen=True)
class SoftMatch:
    """The best code of each of N readings: row in the library, turn (np.rot90 back to the print),
    Hamming distance, score: mean agreement of the modules, 1 for a perfect one, and frame: share of
    the bars' modules that are not dark and of the white ring's that are not white.
    """

    row: Ints
    turn: Ints
    wrong: Ints
    score: Floats
    frame: Floats


class SoftReader:
    """Reads codes of one library through homographies."""

    def __init__(self, library: MarkerLibrary) -> None:
        layout = library.layout
        n, c = layout.modules, layout.code
        self.side = c
        views = np.stack([np.rot90(library.codes, -k, axes=(1, 2)) for k in range(4)], axis=1)
        self._signs = np.where(views, -1, 1).reshape(-1, c * c).astype(np.float32)  # white +1
        self._points = sample_points(layout, MASK)
        frame = layout.pattern(np.zeros((c, c), np.bool_))
        area = np.zeros((n, n), np.bool_)
        area[(n - c) // 2 : (n + c) // 2, (n - c) // 2 : (n + c) // 2] = True
        self._bars = np.flatnonzero(frame)
        self._white = np.flatnonzero(~frame & ~area)
        self._area = np.flatnonzero(area)
        at = np.arange(n) - (n - 1) / 2
        v, u = np.meshgrid(at, at, indexing="ij")
        plane = np.column_stack([np.ones(n * n), u.ravel(), v.ravel()])
        self._planes = [
            (np.linalg.pinv(plane[at]).T @ plane.T, at) for at in (self._bars, self._white)
        ]

    def match(self, grey: Grey, H: Floats) -> SoftMatch:
        """The nearest code through each of H (N, 3, 3); white must be lighter than dark."""
        levels = read_modules(grey, H, self._points)
        best: SoftMatch | None = None
        for dark, white in self._references(levels):
            clear = (levels - (white + dark) / 2) / np.maximum((white - dark) / 2, 1.0)
            area = np.clip(clear[:, self._area], -LOUDEST, LOUDEST).astype(np.float32)
            wrong = (clear[:, self._bars] > 0).sum(axis=1) + (clear[:, self._white] < 0).sum(axis=1)
            one = self._nearest(area, wrong / (len(self._bars) + len(self._white)))
            best = one if best is None else _better(best, one)
            if not best.wrong.any():
                break  # nothing can read better
        assert best is not None
        return best

    def _references(self, levels: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Dark and white level of each module (N, n²) or (N, 1), in four ways."""
        bars, white = levels[:, self._bars], levels[:, self._white]
        yield np.median(bars, axis=1, keepdims=True), np.median(white, axis=1, keepdims=True)
        dark, bright = (levels[:, at] @ through for through, at in self._planes)
        yield dark, bright
        area = levels[:, self._area]
        yield area.min(axis=1, keepdims=True), area.max(axis=1, keepdims=True)
        yield self._local(levels)

    def _local(self, levels: Floats) -> tuple[Floats, Floats]:
        """White as a closing over the modules shows it: it follows the edge of a shadow."""
        n = round(np.sqrt(levels.shape[1]))
        modules = np.ascontiguousarray(
            levels.reshape(-1, n, n).transpose(1, 2, 0), dtype=np.float32
        )
        parts = [
            cv2.morphologyEx(modules[:, :, k : k + CHANNELS], cv2.MORPH_CLOSE, CLOSING)
            for k in range(0, modules.shape[2], CHANNELS)
        ]
        closed = np.concatenate([np.atleast_3d(part) for part in parts], axis=2)
        white = np.maximum(closed.transpose(2, 0, 1).reshape(len(levels), -1), 1.0).astype(
            np.float64
        )
        share = np.median(levels[:, self._bars] / white[:, self._bars], axis=1, keepdims=True)
        return share * white, white

    def _nearest(self, clear: NDArray[np.float32], frame: Floats) -> SoftMatch:
        score = clear @ self._signs.T
        best = score.argmax(axis=1)
        top = np.take_along_axis(score, best[:, None], axis=1)[:, 0]
        wrong = ((clear > 0) != (self._signs[best] > 0)).sum(axis=1)
        return SoftMatch(best // 4, best % 4, wrong, top.astype(np.float64) / self.side**2, frame)


def _better(a: SoftMatch, b: SoftMatch) -> SoftMatch:
    take: Bools = (b.wrong < a.wrong) | ((b.wrong == a.wrong) & (b.score > a.score))
    return SoftMatch(
        np.where(take, b.row, a.row),
        np.where(take, b.turn, a.turn),
        np.where(take, b.wrong, a.wrong),
        np.where(take, b.score, a.score),
        np.where(take, b.frame, a.frame),
    )
