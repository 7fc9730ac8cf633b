"""The paper's detector: location bars, closed loops, cornerstones, area code (paper, 3.1 to 3.3).

Where its text slips we correct it: U belongs to the largest eigenvalue, and a match counts when
the confidence number lies below Δconf. What it leaves open: the local threshold is the
Gaussian-weighted mean over 41 px less 8 levels (its own smoothing; none before), the cornerstones
are turned with the decoded rotation, and the centre is the homography's image of module (6,6).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats, Grey, Ints
from olivevib.detection.axes import cornerstone_covariances
from olivevib.detection.codes import (
    CodeBook,
    Match,
    library_book,
    mirrored_book,
    read_modules,
    sample_points,
    square_homographies,
)
from olivevib.detection.detection import Detection
from olivevib.detection.domains import Bars, dark_domains, rectangles
from olivevib.detection.loops import Candidates, candidate_loops
from olivevib.detection.settings import DetectionSettings
from olivevib.geometry import diagonal_crossing, diagonal_crossing_jacobian
from olivevib.marker import MarkerLibrary

WINDOW_PX = 41  # of the local threshold
BELOW = 8  # grey levels that dark lies below the local mean
SMALLEST = 6  # px² of a domain
MASK = 1 / 9  # modules between the samples of the 3 x 3 mask (9 px a module)
SIGMA_MODULES = 5.0  # of the local threshold among the sampled modules
NEAR_PX = 5.0  # of several candidates so close the best is kept
MISPLACED = 0.12  # bar lengths by which a covered bar's centroid is off its place


@dataclass(frozen=True)
class _Reading:
    """Candidates whose code matched, best first."""

    candidates: Candidates
    match: Match
    H: Floats

    def only(self, keep: Bools | Ints) -> _Reading:
        m, c = self.match, self.candidates
        return _Reading(
            Candidates(c.bars[keep], c.corners[keep]),
            Match(m.row[keep], m.turn[keep], m.mismatches[keep]),
            self.H[keep],
        )


class PaperReader:
    """Reads the markers of one library of the paper's layout in any grey image.

    ``settings`` holds the paper's six parameters; ``paper_centre`` takes the mean of the
    cornerstones as the centre. Not to be shared between threads.
    """

    def __init__(self, library: MarkerLibrary, settings: DetectionSettings | None = None) -> None:
        self.library = library
        self.settings = settings or DetectionSettings()
        self._book = library_book(library)
        self._mirrored = mirrored_book(library)
        self._points = sample_points(library.layout, MASK)
        self._mean = _local_mean(library.layout.modules)

    def detect(self, grey: Grey) -> list[Detection]:
        """All markers in ``grey`` (H, W) uint8, sorted by id.

        One id is reported once: fewest unmatched modules, then the largest; flag "duplicate" says
        that it was seen at several places, "occluded" that a bar is not where it should be.
        """
        bars = self._bars(grey)
        reading = self._read(grey, bars, self._book)
        found: dict[int, Detection] = {}
        for one in self._measured(bars, reading):
            kept = found.get(one.id)
            if kept is None:
                found[one.id] = one
            elif "duplicate" not in kept.flags:
                found[one.id] = _flagged(kept, "duplicate")
        return [found[i] for i in sorted(found)]

    def mirrored_ids(self, grey: Grey) -> tuple[int, ...]:
        """Ids whose mirror image is in ``grey``: the recording is mirrored. Sorted.

        Only a library whose distances hold for mirror images can tell (``library.mirrors``).
        """
        reading = self._read(grey, self._bars(grey), self._mirrored)
        return tuple(sorted({int(self.library.ids[row]) for row in reading.match.row}))

    def _bars(self, grey: Grey) -> Bars:
        """Domains that fulfil the rectangle shape criterion Ω / (W H) > Δfill."""
        dark = cv2.adaptiveThreshold(
            grey, 1, cv2.ADAPTIVE_THRESH_GAUSSIAN_C, cv2.THRESH_BINARY_INV, WINDOW_PX, BELOW
        )
        domains = dark_domains(np.asarray(dark, dtype=np.uint8))
        bars = rectangles(domains, np.flatnonzero(domains.area >= SMALLEST))
        return bars.only(bars.area > self.settings.fill * bars.length * bars.width)

    def _read(self, grey: Grey, bars: Bars, book: CodeBook) -> _Reading:
        """Loops whose area code matches within Δconf, the best within each NEAR_PX."""
        candidates = candidate_loops(bars, self.settings, grey.shape)
        half = float(self.library.layout.cornerstones[2, 0])
        H = square_homographies(candidates.corners, half)
        match = book.match(self._dark_modules(grey, H))
        reading = _Reading(candidates, match, H)
        allowed = self.settings.conf * book.side**2 + 1e-9
        reading = reading.only(match.mismatches <= allowed)
        misfit = _misplacement(bars, reading, half).max(axis=1, initial=0.0)
        reading = reading.only(np.lexsort((misfit, reading.match.mismatches)))
        return reading.only(_apart(diagonal_crossing(reading.candidates.corners)))

    def _dark_modules(self, grey: Grey, H: Floats) -> Bools:
        """The area code (N, c, c) through each homography, by the local mean of the samples."""
        n, c = self.library.layout.modules, self.library.layout.code
        levels = read_modules(grey, H, self._points).reshape(-1, n, n)
        above = levels - self._mean @ levels @ self._mean.T
        area = slice((n - c) // 2, (n + c) // 2)
        dark: Bools = above[:, area, area] < 0
        return dark

    def _measured(self, bars: Bars, reading: _Reading) -> Iterator[Detection]:
        """A Detection for each match, corners in the layout's order; best match, largest first."""
        corners, match = reading.candidates.corners, reading.match
        half = float(self.library.layout.cornerstones[2, 0])
        covered = _misplacement(bars, reading, half).max(axis=1, initial=0.0) > MISPLACED
        covariance = cornerstone_covariances(
            bars, reading.candidates, reading.H, self.library.layout
        )
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).sum(axis=1)
        for k in np.lexsort((-sides, match.mismatches)):
            turn = (np.arange(4) + match.turn[k]) % 4
            points = corners[k, turn]
            coordinates = (2 * turn[:, None] + [0, 1]).ravel()
            cov = covariance[k][np.ix_(coordinates, coordinates)]
            centre, by_corners = self._centre(points)
            yield Detection(
                id=int(self.library.ids[match.row[k]]),
                corners_px=points,
                corners_cov_px2=cov,
                centre_px=centre,
                centre_cov_px2=by_corners @ cov @ by_corners.T,
                raw_row=np.concatenate([centre[1:], points[:, 1]]),
                localiser="paper",
                bit_errors=int(match.mismatches[k]),
                flags=("occluded",) if covered[k] else (),
            )

    def _centre(self, corners: Floats) -> tuple[Floats, Floats]:
        """The centre (2,) and its derivative (2, 8) by the corners."""
        if self.settings.paper_centre:
            return corners.mean(axis=0), np.tile(np.eye(2) / 4, 4)
        return diagonal_crossing(corners), diagonal_crossing_jacobian(corners)


def _local_mean(modules: int) -> Floats:
    """Weights M (n, n) of the Gaussian mean about each module: M V Mᵀ is the local mean."""
    at = np.arange(modules)
    weight = np.exp(-0.5 * ((at[:, None] - at) / SIGMA_MODULES) ** 2)
    out: Floats = weight / weight.sum(axis=1, keepdims=True)
    return out


def _misplacement(bars: Bars, reading: _Reading, half: float) -> Floats:
    """How far each bar's centroid (M, 4) is from its place under H, in bar lengths.

    Bar k of a loop runs from cornerstone k to k + 1: its middle is the image of that side's.
    """
    middles = np.array([[0.0, -half], [half, 0.0], [0.0, half], [-half, 0.0]])
    w = reading.H @ np.vstack([middles.T, np.ones(4)])
    places = np.swapaxes(w[:, :2] / w[:, 2:], 1, 2)
    mine = reading.candidates.bars
    off = np.linalg.norm(bars.centre[mine] - places, axis=2)
    out: Floats = off / bars.length[mine]
    return out


def _apart(centres: Floats) -> Ints:
    """Indices that remain when, in order, nothing closer than NEAR_PX to a kept one is kept."""
    kept: list[int] = []
    for k, centre in enumerate(centres):
        near = kept and (np.linalg.norm(centres[kept] - centre, axis=1) < NEAR_PX).any()
        if not near:
            kept.append(k)
    return np.array(kept, dtype=np.int64)


def _flagged(one: Detection, word: str) -> Detection:
    return replace(one, flags=(*one.flags, word))
