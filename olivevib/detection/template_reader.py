"""The fine detector: bars, hypotheses, soft code, and the whole marker fitted to the image.

Every marker is fitted by a drawing of itself, so that its centre is as good as the noise of the
image allows; what is covered, shadowed or doubtful is flagged rather than quietly wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Grey, Ints
from olivevib.detection.bend import Wrapped
from olivevib.detection.blur import Blur
from olivevib.detection.candidates import dark_passes, fine_bars
from olivevib.detection.card_fit import EVEN, CardFit, fit_card
from olivevib.detection.covers import without_cover
from olivevib.detection.detection import Detection
from olivevib.detection.fitted_points import fitted_points
from olivevib.detection.hypotheses import Frames, frame_hypotheses, joined
from olivevib.detection.refine import Fit
from olivevib.detection.settings import DetectionSettings
from olivevib.detection.softcode import SoftMatch, SoftReader
from olivevib.detection.template import card
from olivevib.detection.wrapped import fit_wrapped
from olivevib.geometry import apply_homography
from olivevib.marker import MarkerLibrary

TRIED_WRONG = (8, 12)  # of 49 modules that a hypothesis may have wrong: two bars, three or four
FRAME_WRONG = 0.3  # share of the frame's modules that may look wrong (half do by chance)
SURE = 0.92  # correlation on the whole marker; a wrong code reaches .81 (rendered, to 12 px blur)
WRONG = (4, 6)  # after the fit: clear, and where a part is covered
NCC = (0.75, 0.6)
RMS = (0.16, 0.2)  # of the gain
COVERED = 0.9  # mean weight below which a part is covered
CELL = 0.7  # weight of a ninth of the marker below which it is called occluded
SMALLEST_PX2 = 60.0
BENT_SIGMA_PX = (0.015, 0.05)  # left on rendered cylinders: radius known, radius estimated
NEAR_SIZES = 0.25  # of a marker: no second one is looked for so close to one that was found
READ_AT_ONCE = 2  # of 49 modules that the first frame of a place may have wrong
MANY_FRAMES = 64
PLACE_PX = 12.0  # side of a place in which frames are of one marker
FAR_CODES = 12 / 49  # distance of codes from which the whole drawing tells them apart


@dataclass(frozen=True)
class Found:
    """One fitted marker: its row in the library, pose as printed, fit, wrong modules, polarity."""

    row: int
    H: Floats
    card: CardFit
    wrong: int
    inverted: bool = False


class TemplateReader:
    """Reads the markers of one library with the accuracy that the image's noise allows.

    The paper's parameters do not apply. Each frame is read by itself. Not to be shared between
    threads.
    """

    def __init__(
        self,
        library: MarkerLibrary,
        settings: DetectionSettings | None = None,
        wrapped: Sequence[Wrapped] = (),
    ) -> None:
        self.library = library
        self.settings = settings or DetectionSettings()
        self._wrapped = {one.id: one for one in wrapped}
        self._soft = SoftReader(library)
        mirrored = replace(library, codes=library.codes[:, :, ::-1])
        self._mirrored = SoftReader(mirrored)
        bits, apart = library.layout.code**2, library.distance
        self._wrong = [min(round(most * bits / 49), (apart - 1) // 2) for most in WRONG]
        self.far = apart >= FAR_CODES * bits
        self.cards = [
            card(library.layout.pattern(code), library.layout.quiet) for code in library.codes
        ]

    def detect(self, grey: Grey) -> list[Detection]:
        """All markers in ``grey`` (H, W) uint8, sorted by id.

        Flags: "occluded" (a ninth of the marker is covered by 30 % or more), "shadowed" (the light
        on it had to be evened out), "duplicate" (the id was seen at several places; the largest is
        reported), "misfit" (it is bent otherwise than a cylinder that touches it in its middle).
        """
        found: dict[int, Detection] = {}
        for one in self._fitted(grey, self._hypotheses(grey)):
            new = self.detection(one)
            kept = found.get(new.id)
            if kept is None or new.size_px > kept.size_px:
                found[new.id] = new
            if kept is not None:
                found[new.id] = replace(
                    found[new.id], flags=_with(found[new.id].flags, "duplicate")
                )
        return [found[i] for i in sorted(found)]

    def mirrored_ids(self, grey: Grey) -> tuple[int, ...]:
        """Ids whose mirror image is in ``grey``: the recording is mirrored. Sorted."""
        frames = self._hypotheses(grey)
        if not len(frames):
            return ()
        match = self._mirrored.match(grey, frames.homographies())
        sure = (match.wrong <= 2) & (frames.support >= 3)
        return tuple(sorted({int(self.library.ids[row]) for row in match.row[sure]}))

    def _hypotheses(self, grey: Grey) -> Frames:
        layout = self.library.layout
        bars = [fine_bars(dark, scale) for dark, scale in dark_passes(grey)]
        return joined([frame_hypotheses(some, layout) for some in bars])

    def _fitted(self, grey: Grey, frames: Frames) -> list[Found]:
        """Accepted markers; of several fits of one code at one place the first stands.

        Of many one frame a place is read first; the others where that one did not read at once.
        """
        found: list[Found] = []
        if len(frames) > MANY_FRAMES:
            self._read(grey, frames.only(_firsts(frames)), READ_AT_ONCE, found)
        if found:
            places = np.array([_place(one) for one in found]).reshape(-1, 2)
            far = np.linalg.norm(frames.centre[:, None] - places, axis=2) >= self._near(frames)
            frames = frames.only(far.all(axis=1))
        self._read(grey, frames, None, found)
        return found

    def _near(self, frames: Frames) -> Floats:
        """How close (F, 1) px to each frame no second marker is looked for."""
        sizes = self.library.layout.modules * np.linalg.norm(frames.a, axis=1)
        out: Floats = np.maximum(3.0, NEAR_SIZES * sizes)[:, None]
        return out

    def _read(self, grey: Grey, frames: Frames, most: int | None, found: list[Found]) -> None:
        """Add to ``found`` what frames show, the surest first, up to ``most`` wrong modules."""
        if not len(frames):
            return
        H, near = frames.homographies(), self._near(frames)
        match = self._soft.match(grey, H)
        for k in _order(frames, match, self.library.layout.code):
            if most is not None and match.wrong[k] > most:
                break
            if any(np.linalg.norm(_place(one) - frames.centre[k]) < near[k] for one in found):
                continue
            code = (int(match.row[k]), int(match.turn[k]), int(match.wrong[k]))
            one = self.fit(grey, H[k], code)
            if one is not None:
                found.append(one)

    def fit(
        self, grey: Grey, H: Floats, code: tuple[int, int, int], blur: Blur | None = None
    ) -> Found | None:
        """Fit the drawing of a code (row, turn, wrong modules) from pose H; accept or refuse it.

        It is accepted where it reads as itself again, or, blurred beyond reading, where the whole
        drawing agrees with the image as no other code's could.
        """
        row, turn, first_wrong = code
        start = _turned(H, turn)
        wrapped = self._wrapped.get(int(self.library.ids[row]))
        if wrapped is not None:
            return self._fit_bent(grey, start, (row, first_wrong), wrapped)
        card_fit = fit_card(grey, self.cards[row], start, self.library.layout, blur or Blur())
        if card_fit is None:
            return None
        fit = card_fit.fit
        if not sound(fit, start, self.library.layout.cornerstones):
            return None
        again = self._soft.match(grey, fit.H[None])
        wrong = int(again.wrong[0])
        read = int(again.row[0]) == row and int(again.turn[0]) == 0
        clear = read and wrong <= self._wrong[fit.weight < COVERED]
        if not clear and not (self.far and fit.whole_ncc >= SURE):
            return None
        card_fit = without_cover(grey, self.cards[row], card_fit, self.library.layout)
        return Found(row, card_fit.fit.H, card_fit, wrong if read else first_wrong)

    def _fit_bent(
        self, grey: Grey, H: Floats, code: tuple[int, int], wrapped: Wrapped
    ) -> Found | None:
        """Fit a marker that is wrapped round a branch; the whole drawing must agree."""
        layout = self.library.layout
        bent = fit_wrapped(grey, self.cards[code[0]], H, layout, wrapped)
        if bent is None or not sound(bent.fit, H, layout.cornerstones):
            return None
        if not (self.far and bent.fit.whole_ncc >= SURE):
            return None
        return Found(code[0], bent.fit.H, bent, code[1])

    def detection(self, one: Found) -> Detection:
        """What is said of a fitted marker."""
        return fitted_detection(self.library, one)


def fitted_detection(library: MarkerLibrary, one: Found) -> Detection:
    """What is said of a fitted marker: centre and cornerstones with covariance, and flags."""
    fit = one.card.fit
    points = np.vstack([np.zeros((1, 2)), library.layout.cornerstones])
    px, covariance = fitted_points(fit, points)
    if one.card.bend is not None:
        sigma = BENT_SIGMA_PX[one.card.bend.estimated]
        covariance = covariance + sigma**2 * np.eye(len(covariance))
    flags = ["occluded"] if fit.cells.min() < CELL else []
    if one.card.uneven:
        flags.append("shadowed")
    if one.card.bend is not None and fit.rms > EVEN * fit.gain:
        flags.append("misfit")
    return Detection(
        id=int(library.ids[one.row]),
        corners_px=px[1:],
        corners_cov_px2=covariance[2:, 2:],
        centre_px=px[0],
        centre_cov_px2=covariance[:2, :2],
        raw_row=px[:, 1],
        localiser="template",
        bit_errors=one.wrong,
        flags=tuple(flags),
    )


def sound(fit: Fit, start: Floats, stones: Floats) -> bool:
    """Whether a fit may be a marker: it converged near its start, and looks like its drawing."""
    robust = fit.weight < COVERED
    moved = float(np.linalg.norm(fit.H[:2, 2] - start[:2, 2] / start[2, 2]))
    module = float(np.linalg.norm(start[:2, 0])) + float(np.linalg.norm(start[:2, 1]))
    d, e = np.diff(apply_homography(fit.H, stones)[[0, 2, 1, 3]].reshape(2, 2, 2), axis=1)[:, 0]
    area = 0.5 * float(d[0] * e[1] - d[1] * e[0])
    good = fit.converged and fit.ncc >= NCC[robust] and moved < 2.75 * module + 2
    quiet = fit.rms <= RMS[robust] * fit.gain or fit.ncc >= 0.9
    return bool(good and quiet and area >= SMALLEST_PX2)


def _order(frames: Frames, match: SoftMatch, side: int) -> Ints:
    """Hypotheses worth a fit, the surest first."""
    most = np.where(frames.support >= 3, TRIED_WRONG[1], TRIED_WRONG[0])
    worth: Bools = (match.wrong * 49 <= most * side * side) & (match.frame <= FRAME_WRONG)
    order = np.lexsort((-match.score, -frames.support, match.wrong))
    out: Ints = order[worth[order]]
    return out


def _firsts(frames: Frames) -> Ints:
    """The best supported frame of each place in the image."""
    order = np.argsort(-frames.support, kind="stable")
    cell = np.floor(frames.centre[order] / PLACE_PX)
    return order[np.unique(cell, axis=0, return_index=True)[1]]


def _place(one: Found) -> Floats:
    """Image (2,) of a marker's centre."""
    out: Floats = one.H[:2, 2] / one.H[2, 2]
    return out


def _turned(H: Floats, turn: int) -> Floats:
    """The pose as printed of a marker that was read ``turn`` quarter turns off."""
    quarter = np.linalg.matrix_power(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), turn)
    out: Floats = H @ quarter
    return out


def _with(flags: tuple[str, ...], word: str) -> tuple[str, ...]:
    return flags if word in flags else (*flags, word)
