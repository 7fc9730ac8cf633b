"""Following markers from frame to frame: each is looked for where it was, and fitted at once.

A search with its own drawing finds it several pixels off; all keys are then fitted together. What
is covered, smeared, in uneven light or turned away from its key is fitted by itself. A marker is
only ever reported under its own code: the whole drawing must agree, or the code must read.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Floats, Grey
from olivevib.detection.blur import LEAST_PATH_PX, Blur
from olivevib.detection.card_fit import EVEN, REDRAWN_PX2, SHARP, plausible
from olivevib.detection.detection import Detection
from olivevib.detection.fitted_points import image_homography, point_images
from olivevib.detection.key import Key, change_of_shape, inside_image, make_key
from olivevib.detection.key_fit import KeyBatch, KeyFits, batches_of, fit_keys
from olivevib.detection.pixels import Singles
from olivevib.detection.search import Scene, patch_of, search, smeared_start
from olivevib.detection.template import COARSE, draw_template
from olivevib.detection.template_reader import SURE, Found
from olivevib.geometry import homography
from olivevib.marker import MarkerLibrary

SEARCH_PX = 8  # to either side of where a marker was; twice as far after a miss
CLEAR, CLEAR_CELL = 0.95, 0.85  # mean weight of a marker, and of its ninths, that is not covered
NEW_KEY, FAR_KEY = 0.03, 0.06  # change of shape (log of a stretch): draw anew, do not believe
MISSES = 3  # frames in which a marker is looked for near where it was


@dataclass(frozen=True)
class Known:
    """What is remembered of one marker.

    H (3, 3): its last pose, centred modules to px; blur it had; noise (5, 5): autocorrelation,
    variance 1, None before it was measured; drawn_at (3, 3), drawn_blur: those of its key, None
    where it has none; shift (2,) px and W (3, 3): where that key was last; misses: frames since;
    excess: of the covariance by noise along edges, times.
    """

    H: Floats
    blur: Blur = SHARP
    noise: Singles | None = None
    drawn_at: Floats | None = None
    drawn_blur: Blur = SHARP
    shift: tuple[int, int] = (0, 0)
    W: Floats | None = None
    misses: int = 0
    excess: float = 1.0


class FittingReader(Protocol):
    """A reader whose markers are fitted drawings; ``far``: the drawing alone tells its codes."""

    library: MarkerLibrary
    cards: list[Singles]
    far: bool

    def fit(
        self, grey: Grey, H: Floats, code: tuple[int, int, int], blur: Blur | None = None
    ) -> Found | None:
        """Fit the marker of a code (row, turn, wrong modules) from pose H; None if it is not it."""
        ...

    def detection(self, one: Found) -> Detection:
        """What is said of a fitted marker."""
        ...


class Follower:
    """Follows markers of one library; it depends on the frames and on ``known`` alone."""

    def __init__(self, reader: FittingReader) -> None:
        self._reader = reader
        self._row = {int(i): k for k, i in enumerate(reader.library.ids)}
        self._keys: dict[int, Key] = {}
        self._batch: tuple[tuple[int, ...], list[KeyBatch]] | None = None
        self.known: dict[int, Known] = {}

    def learn(self, found: Iterable[Detection]) -> None:
        """Begin with markers that a scan found."""
        stones = self._reader.library.layout.cornerstones
        for one in found:
            self.known[one.id] = Known(homography(stones, one.corners_px))
            self._drop_key(one.id)

    def recall(self, known: dict[int, Known]) -> None:
        """Go on from what was ``known`` after another frame."""
        self.known, self._keys, self._batch = known, {}, None

    def follow(self, grey: Grey) -> dict[int, Detection]:
        """The known markers that are seen in the next frame (H, W) uint8."""
        scene = Scene(grey)
        self._draw_keys(scene.size_px)
        starts = {i: s for i, key in self._keys.items() if (s := self._start(scene, i, key))}
        found = self._fit_keys(grey, starts) if starts else {}
        for marker in [i for i in self.known if i not in found]:
            one = self._by_itself(scene, marker)
            if one is not None:
                found[marker] = one
        missed = [i for i in self.known if i not in found]
        for marker in missed:
            self._miss(marker)
        return found

    def _miss(self, marker: int) -> None:
        known = self.known[marker]
        if known.misses >= MISSES:
            del self.known[marker]
            self._drop_key(marker)
        else:
            self.known[marker] = replace(known, misses=known.misses + 1)

    def _drop_key(self, marker: int) -> None:
        self._keys.pop(marker, None)
        self._batch = None

    def _draw_keys(self, size_px: tuple[int, int]) -> None:
        """Keys of all that are known with a pose to draw at and have none yet."""
        for marker, known in self.known.items():
            if marker in self._keys or known.drawn_at is None or known.noise is None:
                continue
            key = make_key(
                self._reader.cards[self._row[marker]], known.drawn_at, known.drawn_blur,
                self._reader.library.layout, known.noise, size_px,
            )  # fmt: skip
            if key is not None:
                self._keys[marker] = key
                self._batch = None

    def _start(self, scene: Scene, marker: int, key: Key) -> tuple[NDArray[np.intp], Floats] | None:
        """Shift (2,) and W (3, 3) where the key's drawing agrees best with the frame."""
        known = self.known[marker]
        W = np.eye(3) if known.W is None else known.W
        at = np.linalg.solve(W, [0.0, 0.0, 1.0])
        there = np.array(known.shift) + key.scale * at[:2] / at[2]
        place = search(
            scene, key.patch, np.rint(there).astype(np.intp), SEARCH_PX * (1 + known.misses)
        )
        if place is None:
            return None
        shift = np.rint(place.moved_px).astype(np.intp)
        if not inside_image(key, shift, scene.size_px):
            return None
        x, y = (place.moved_px - shift) / key.scale - at[:2] / at[2]
        return shift, W @ np.array([[1, 0, -x], [0, 1, -y], [0, 0, 1.0]])

    def _fit_keys(
        self, grey: Grey, starts: dict[int, tuple[NDArray[np.intp], Floats]]
    ) -> dict[int, Detection]:
        markers = tuple(sorted(starts))
        if self._batch is None or self._batch[0] != markers:
            self._batch = (markers, batches_of([self._keys[i] for i in markers]))
        shifts = np.array([starts[i][0] for i in markers])
        fits = fit_keys(grey, self._batch[1], shifts, np.array([starts[i][1] for i in markers]))
        found: dict[int, Detection] = {}
        for k, marker in enumerate(markers):
            key = self._keys[marker]
            H = _pose(key, shifts[k], fits.W[k]) if fits.converged[k] else None
            if H is not None and self._believed(grey, key, fits, k, H):
                found[marker] = self._detection(marker, key, fits, k, H, shifts[k])
                self._remember(marker, key, fits, k, H, shifts[k])
            elif H is not None and plausible(H, self._reader.library.layout, grey.shape):
                self.known[marker] = replace(self.known[marker], H=H)
            else:
                move = np.eye(3)
                move[:2, 2] = shifts[k]
                self.known[marker] = replace(self.known[marker], H=move @ key.H)
        return found

    def _believed(self, grey: Grey, key: Key, fits: KeyFits, k: int, H: Floats) -> bool:
        """Whether a fit is a clear marker in even light, near its key: nothing else to ask for."""
        return bool(
            self._reader.far
            and fits.ncc[k] >= SURE
            and fits.rms[k] <= EVEN * fits.gain[k]
            and fits.weight[k] >= CLEAR
            and fits.cell[k] >= CLEAR_CELL
            and abs(fits.further[k]) < REDRAWN_PX2
            and change_of_shape(fits.W[k]) < FAR_KEY
            and plausible(H, self._reader.library.layout, grey.shape)
        )

    def _detection(
        self, marker: int, key: Key, fits: KeyFits, k: int, H: Floats, shift: NDArray[np.intp]
    ) -> Detection:
        points = np.vstack([np.zeros((1, 2)), self._reader.library.layout.cornerstones])
        px, covariance = point_images(
            H, fits.W[k], fits.covariance[k], points, (key.centre + shift, key.scale)
        )
        covariance = self.known[marker].excess * covariance
        return Detection(
            id=marker,
            corners_px=px[1:],
            corners_cov_px2=covariance[2:, 2:],
            centre_px=px[0],
            centre_cov_px2=covariance[:2, :2],
            raw_row=px[:, 1],
            localiser="template",
        )

    def _remember(
        self, marker: int, key: Key, fits: KeyFits, k: int, H: Floats, shift: NDArray[np.intp]
    ) -> None:
        known = replace(
            self.known[marker], H=H, W=fits.W[k], shift=(int(shift[0]), int(shift[1])), misses=0
        )
        if change_of_shape(fits.W[k]) > NEW_KEY:
            known = replace(known, drawn_at=H, shift=(0, 0), W=None)
            self._drop_key(marker)
        self.known[marker] = known

    def _by_itself(self, scene: Scene, marker: int) -> Detection | None:
        """One marker by all that a scan can do, from its last pose; if need be smeared."""
        known, row, grey = self.known[marker], self._row[marker], scene.grey
        if not plausible(known.H, self._reader.library.layout, grey.shape):
            return None
        pose = known.H if marker in self._keys else self._searched(scene, known, row)
        one = self._reader.fit(grey, pose, (row, 0, 0), known.blur)
        if not known.misses and (one is None or _smeared(one)):
            start = smeared_start(
                grey, self._reader.cards[row], known.H, self._reader.library.layout
            )
            again = start and self._reader.fit(grey, start[0], (row, 0, 0), start[1])
            if again and (one is None or again.card.noise < one.card.noise):
                one = again
        if one is None:
            return None
        self._drop_key(marker)
        self.known[marker] = _after(one)
        return self._reader.detection(one)

    def _searched(self, scene: Scene, known: Known, row: int) -> Floats:
        """The pose of a marker without a key, moved to where its drawing agrees best."""
        layout = self._reader.library.layout
        drawn = draw_template(self._reader.cards[row], known.H, known.blur, layout.quiet, COARSE)
        reach = SEARCH_PX * (1 + known.misses)
        place = search(scene, patch_of(drawn, layout), np.zeros(2, np.intp), reach)
        if place is None:
            return known.H
        move = np.eye(3)
        move[:2, 2] = place.moved_px
        out: Floats = move @ known.H
        return out


def _smeared(one: Found) -> bool:
    """Whether a fit left so much that a longer motion may be behind it."""
    return one.card.noise > EVEN and not one.card.uneven


def _after(one: Found) -> Known:
    """What to remember of a marker that was fitted by itself; a key only where that is enough."""
    fit, blur = one.card.fit, one.card.blur
    noise = np.asarray(fit.noise / max(float(fit.noise.max()), 1e-9), dtype=np.float32)
    smeared = blur.path_px > LEAST_PATH_PX
    alone = smeared or one.card.uneven or one.inverted or one.card.bend is not None
    drawn_at = None if alone else one.H
    return Known(one.H, blur, noise, drawn_at, blur, excess=max(fit.excess, 1.0))


def _pose(key: Key, shift: NDArray[np.intp], W: Floats) -> Floats | None:
    """Pose (3, 3) of a key moved by ``shift`` and seen through W; None where W folds over."""
    if not np.isfinite(W).all() or abs(np.linalg.det(W)) < 1e-6:
        return None
    move = np.array([[1, 0, shift[0]], [0, 1, shift[1]], [0, 0, 1.0]])
    H = move @ image_homography(W, (key.centre, key.scale)) @ key.H
    out: Floats = H / H[2, 2]
    return out
