"""The offset between the cameras from markers that move slowly, in the trial itself.

Both cameras must see a marker on one epipolar line at one instant. Out of step, a marker that moves
across these lines misses them; the offset that makes all of them meet is that of the cameras. It
needs motion that two cameras can follow from frame to frame: where the motion between the frames
is not followed, nothing is said. Source: knowledge of the field (sampling time, 6.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig, skew
from olivevib.reconstruction.clock import TrialClock
from olivevib.reconstruction.pairing import at_times
from olivevib.tracking import Track

WIDEST_S = 0.25
STARTS_S = (-0.12, -0.06, -0.03, 0.0, 0.03, 0.06, 0.12)
STEPS = 8
BY_S = 0.5e-3  # for differences
FOLLOWED_PX = 1.0  # rms by which every second frame may miss the frame between
FEWEST = 40  # samples
MISSED = 5.0  # times the sigma of a centre by which the lines may be missed, rms
LEAST_PX = 0.01  # what lens and interpolation may add to any sigma
SURE_S = 1.0e-3  # a larger sigma tells nothing that is worth using
CORRELATED = 2.0  # neighbouring frames share their errors: sigma counts every fourth


def clock_from_motion(
    left: Sequence[Track], right: Sequence[Track], rig: StereoRig, clock: TrialClock
) -> TrialClock:
    """The clock with the offset that slow motion shows; unchanged where it shows none.

    Looks within 0.25 s. Unchanged where the motion is too fast for the frame rate, too small, along
    the epipolar lines only, or where two offsets fit equally well (a motion that repeats itself).
    A motion above half the frame rate looks slow, too; it gives itself away, since no offset makes
    its cameras meet as closely as they see: then nothing is said either.
    """
    pairs = _pairs(left, right)
    if not pairs or not all(followed(t) for pair in pairs for t in pair):
        return clock
    lines = _Lines(rig)
    found = [f for f in (_refined(pairs, lines, clock, s) for s in STARTS_S) if f is not None]
    if not found:
        return clock
    best = min(found, key=lambda f: f[2])
    rivals = [f for f in found if abs(f[0] - best[0]) > 5 * best[1] + 1e-3]
    if best[1] > SURE_S or any(f[2] < 1.5 * best[2] for f in rivals):
        return clock
    if best[2] > max(MISSED * _noise_px(pairs), LEAST_PX):
        return clock
    return replace(
        clock, right_offset_s=best[0], right_offset_sigma_s=best[1], source="slow motion"
    )


def followed(track: Track) -> bool:
    """Whether the frames follow the motion: every second one predicts those between."""
    seen = np.isfinite(track.centre_px[:, 0])
    runs = np.convolve(seen, np.ones(7), "valid") == 7
    at = np.flatnonzero(runs)
    if at.size < FEWEST // 2:
        return False
    p = track.centre_px
    guess = (-p[at] + 9 * p[at + 2] + 9 * p[at + 4] - p[at + 6]) / 16
    miss = guess - p[at + 3]
    return bool(np.sqrt(np.mean(miss**2)) < FOLLOWED_PX)


def _pairs(left: Sequence[Track], right: Sequence[Track]) -> list[tuple[Track, Track]]:
    by_right = {t.id: t for t in right}
    both = [(t, by_right[t.id]) for t in left if t.id in by_right]
    return [p for p in both if min(p[0].seen, p[1].seen) >= FEWEST]


def _noise_px(pairs: list[tuple[Track, Track]]) -> float:
    """Sigma of a centre in one direction, median over all sightings."""
    variances = [np.trace(t.centre_cov_px2, axis1=1, axis2=2) / 2 for p in pairs for t in p]
    return float(np.sqrt(np.nanmedian(np.concatenate(variances))))


class _Lines:
    """Signed distances of pairs of pixels from epipolar consistency, px (Sampson)."""

    def __init__(self, rig: StereoRig) -> None:
        self.rig = rig
        self.E = skew(rig.t_right_left_mm / rig.baseline_mm) @ rig.R_right_left
        self.f_px = float(np.mean([*rig.left.lens[:2], *rig.right.lens[:2]]))

    def distance(self, left_px: Floats, right_px: Floats) -> Floats:
        """(N,) of pixels (N, 2); NaN where either was not seen."""
        a, b = self.rig.left.ray(left_px), self.rig.right.ray(right_px)
        Ea, Eb = a @ self.E.T, b @ self.E
        size = np.sqrt(Ea[:, 0] ** 2 + Ea[:, 1] ** 2 + Eb[:, 0] ** 2 + Eb[:, 1] ** 2)
        return np.asarray(self.f_px * np.sum(b * Ea, axis=1) / size)


def _residuals(
    pairs: list[tuple[Track, Track]], lines: _Lines, clock: TrialClock, offset_s: float
) -> Floats:
    moved = replace(clock, right_offset_s=offset_s)
    out = []
    for one, two in pairs:
        seen = at_times(two, moved.right_times(two.t_s), one.t_s)
        out.append(lines.distance(one.centre_px, seen.centre_px))
    return np.concatenate(out)


def _refined(
    pairs: list[tuple[Track, Track]], lines: _Lines, clock: TrialClock, start_s: float
) -> tuple[float, float, float] | None:
    """Offset, sigma and robust rms of Gauss-Newton from one start; None where it leads nowhere.

    A common distance from the lines (the calibration's own) is fitted with the offset.
    """
    offset = start_s
    for _ in range(STEPS):
        r = [_residuals(pairs, lines, clock, offset + d) for d in (-BY_S, 0.0, BY_S)]
        slope = (r[2] - r[0]) / (2 * BY_S)
        good = np.isfinite(slope) & np.isfinite(r[1])
        if good.sum() < FEWEST:
            return None
        y, x = r[1][good], slope[good] - slope[good].mean()
        y = y - np.median(y)
        scale = max(1.4826 * float(np.median(np.abs(y))), 1e-6)
        w = 1.0 / np.maximum(1.0, np.abs(y) / (2 * scale))
        strength = float(np.sum(w * x * x))
        if strength < 1e-12:
            return None
        step = -float(np.sum(w * x * y)) / strength
        offset += float(np.clip(step, -0.05, 0.05))
        if abs(offset) > WIDEST_S:
            return None
        if abs(step) < 1e-6:
            break
    return offset, CORRELATED * scale / float(np.sqrt(strength)), scale
