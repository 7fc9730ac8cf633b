"""Is the calibration good enough, and if not, what is wrong and what to do: cautions in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.calibration.bundle import BOW, LAG, LENS_OF, RIGHT
from olivevib.calibration.coverage import Coverage
from olivevib.calibration.holdout import HoldOut
from olivevib.calibration.joint import JointFit
from olivevib.calibration.outliers import Cleaned, solve_part
from olivevib.calibration.result import HalfTest
from olivevib.calibration.uncertainty import Uncertainty, uncertainty
from olivevib.errors import Caution
from olivevib.geometry import LENS

FEW_COMMON = 10
LEAST_HALF = 5  # common views that a half needs to tell a rig
SIDES = ("left", "right")


def halves_test(fit: JointFit) -> tuple[HalfTest, ...]:
    """First against second half, and even against odd views: whether they tell the same lens.

    Where neighbouring views err alike, even and odd stretches of so many.
    """
    obs = fit.problem.observations
    seen, shared = np.unique(obs.pose), np.unique(obs.pose[obs.chain == RIGHT])
    order = np.arange(seen.size)
    alike = uncertainty(fit.problem, fit.solution).alike
    even = "even and odd views" if alike == 1 else f"even and odd stretches of {alike} views"
    splits = {"first and second half": order < seen.size // 2, even: order // alike % 2 == 0}
    out = []
    for name, first in splits.items():
        if min(np.isin(seen[part], shared).sum() for part in (first, ~first)) < LEAST_HALF:
            continue
        both = [_half(fit, seen[part]) for part in (first, ~first)]
        (a, cov_a), (b, cov_b) = both
        at = np.r_[0:4, 6:10]  # focal lengths and principal points of both cameras
        z = (a - b)[at] / np.sqrt(np.diag(cov_a)[at] + np.diag(cov_b)[at])
        worst = int(np.abs(z).argmax())
        focal = np.abs(a - b)[[0, 1, 6, 7]] / a[[0, 1, 6, 7]]
        side, parameter = divmod(worst, 4)
        label = f"{LENS[parameter]} of the {SIDES[side]} camera"
        rms = float(np.sqrt((z * z).mean()))
        largest = float(np.abs(z).max())
        out.append(HalfTest(name, largest, label, 100 * float(focal.max()), rms))
    return tuple(out)


def _half(fit: JointFit, poses: Floats) -> tuple[Floats, Floats]:
    pick = np.zeros(fit.problem.observations.poses, dtype=np.bool_)
    pick[poses] = True
    problem, solution = solve_part(fit.problem, fit.solution, pick)
    lens = np.concatenate([solution.state.left.lens, solution.state.right.lens])
    return lens, uncertainty(problem, solution).published


@dataclass(frozen=True)
class Evidence:
    """Everything that a caution may be drawn from."""

    cleaned: Cleaned
    sure: Uncertainty
    coverage: tuple[Coverage, Coverage]
    both: Bools
    holdout: HoldOut | None
    halves: tuple[HalfTest, ...]
    rms_px: tuple[float, float]
    alone_rms_px: tuple[float, float]

    @property
    def fit(self) -> JointFit:
        """The joint fit."""
        return self.cleaned.fit


def cautions(evidence: Evidence) -> tuple[Caution, ...]:
    """All that a person should know before trusting this calibration, most serious first."""
    checks = (_disagree, _residual, _holdout, _few, _focal, _halves, _frontal, _lag, _bow, _place)
    return tuple(caution for check in checks for caution in check(evidence))


def _disagree(e: Evidence) -> Iterator[Caution]:
    together, alone = max(e.rms_px), max(*e.alone_rms_px, 0.2)
    if together > 4 * alone or e.fit.agreement < 0.5:
        yield Caution(
            "cameras-disagree",
            f"The two cameras tell different stories: alone each fits to {alone:.2f} px, but only "
            f"{100 * e.fit.agreement:.0f} % of the common views give the same position of one "
            f"camera to the other, and together they fit to {together:.2f} px.",
            "Check that both recordings show the same board at the same time, that neither is "
            "mirrored, and that no camera moved; then record again.",
        )


def _residual(e: Evidence) -> Iterator[Caution]:
    for side, rms in zip(SIDES, e.alone_rms_px, strict=True):
        if rms > 1.0:
            yield Caution(
                "residual-large",
                f"The {side} camera misses its board points by {rms:.2f} px rms.",
                "Look for motion blur, a wrong board description, or a board that bends; hold the "
                "board still for a second in each place.",
            )
    if e.cleaned.too_many:
        yield Caution(
            "many-views-dropped",
            f"More than a fifth of the views do not fit the others; {len(e.cleaned.dropped)} were "
            "dropped.",
            "Record again: board flat and stiff, cameras fixed, autofocus off, better light.",
        )


def _holdout(e: Evidence) -> Iterator[Caution]:
    h = e.holdout
    if h is None:
        yield Caution(
            "holdout-missing",
            "Too few common frames to keep some for a test: nothing proves this calibration.",
            "Show the board to both cameras at once in at least 10 places.",
        )
    elif h.rms_percent > 1.0:
        yield Caution(
            "holdout-large",
            f"On frames that the fit did not use, distances on the board are wrong by "
            f"{h.rms_percent:.1f} % rms.",
            "Show the board nearer, larger and slower, in more places seen by both cameras.",
        )
    elif h.usable < 0.9:
        yield Caution(
            "holdout-partial",
            f"Only {100 * h.usable:.0f} % of the test points could be compared: the board jerked.",
            "Move the board slowly, with stops.",
        )


def _few(e: Evidence) -> Iterator[Caution]:
    count = int(e.both.sum())
    if count < FEW_COMMON:
        yield Caution(
            "few-common-views",
            f"Both cameras see the board together in {count} views only.",
            f"Show it to both at once in at least {FEW_COMMON} places, tilted and at several "
            "distances.",
        )


def focal_percent(e: Evidence, camera: int) -> float:
    """Sigma of the worse focal length of a camera, %."""
    at = LENS_OF[camera].start
    lens = (e.fit.state.left, e.fit.state.right)[camera].lens
    sd = np.sqrt(np.diag(e.sure.published)[at : at + 2])
    return 100 * float((sd / lens[:2]).max())


def _focal(e: Evidence) -> Iterator[Caution]:
    for camera, side in enumerate(SIDES):
        percent, cover = focal_percent(e, camera), e.coverage[camera]
        if percent > 1.0:
            flat = "always at the same distance" if cover.far_to_near < 1.5 else "too rarely tilted"
            yield Caution(
                "focal-uncertain",
                f"The focal length of the {side} camera is known to {percent:.1f} % only: the "
                f"board was {flat}.",
                "Tilt the board by 30 to 45 degrees to all sides, near and far.",
            )


def _halves(e: Evidence) -> Iterator[Caution]:
    for half in e.halves:
        if half.largest_z > 3 or (half.largest_z > 2 and half.focal_percent > 2):
            yield Caution(
                "halves-contradict",
                f"The {half.name} tell different lenses: {half.parameter} differs by "
                f"{half.largest_z:.1f} sigma, focal lengths by up to {half.focal_percent:.1f} %.",
                "Switch autofocus and zoom off, fix the cameras, and record again.",
            )


def _frontal(e: Evidence) -> Iterator[Caution]:
    for side, cover in zip(SIDES, e.coverage, strict=True):
        if cover.frontal > 0.8:
            yield Caution(
                "frontal-views",
                f"The {side} camera sees the board almost frontally in {100 * cover.frontal:.0f} % "
                "of its views.",
                "Tilt the board by 30 to 45 degrees to all four sides.",
            )


def _lag(e: Evidence) -> Iterator[Caution]:
    if not e.fit.lag_free:
        return
    lag, sd = e.fit.state.lag_s, float(np.sqrt(e.sure.published[LAG, LAG]))
    if sd > 0.010:
        yield Caution(
            "lag-uncertain",
            f"How late the right camera is could only be told to {1e3 * sd:.0f} ms.",
            "Move the board up and down between the stops, so that both cameras see it move.",
        )
    if abs(lag) > max(3 * sd, 0.001):
        word = "late" if lag > 0 else "early"
        yield Caution(
            "late-camera" if lag > 0 else "early-camera",
            f"The right camera is {1e3 * abs(lag):.1f} ± {1e3 * sd:.1f} ms {word}; this is "
            "corrected in the calibration.",
            "It holds for this recording only; let trial and board be one recording, or wave the "
            "board again after each restart.",
        )
    if e.fit.jitter_sd_s > max(0.003, 0.03 * e.fit.pair.right.samples().period_s):
        yield Caution(
            "uneven-stamps",
            f"The time between the two cameras scatters by {1e3 * e.fit.jitter_sd_s:.0f} ms from "
            "frame to frame.",
            "Record with stamps from the cameras themselves (olivevib capture), both at the same "
            "rate, without a virtual camera in between.",
        )


def _bow(e: Evidence) -> Iterator[Caution]:
    bow, cov = e.fit.state.bow_mm, e.sure.published[BOW, BOW]
    worst = int(np.abs(bow).argmax())
    if abs(bow[worst]) > max(3 * np.sqrt(cov[worst, worst]), 0.2):
        yield Caution(
            "bent-board",
            f"The board is bent by about {abs(bow[worst]):.1f} mm at its edge; this is modelled.",
            "Glue it to something stiff.",
        )


def _place(e: Evidence) -> Iterator[Caution]:
    t, R = e.fit.state.t_mm, e.fit.state.R
    roll = float(np.degrees(np.arctan2(R[1, 0], R[0, 0])))
    if abs(roll) > 45:
        yield Caution(
            "camera-turned",
            f"One camera is turned by {abs(roll):.0f} degrees about its axis against the other.",
            "If it was not mounted so, turn its recording the right way up.",
        )
    elif (-R.T @ t)[0] < 0:
        yield Caution(
            "cameras-swapped",
            "The camera called left stands to the right of the other.",
            "If that is not so on the tripods, swap --left and --right; otherwise nothing to do.",
        )
