"""At once after a recording: what is in it, and what it is good for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.calibration.guidance import Guidance
from olivevib.errors import Caution
from olivevib.pipeline.capture.looks import BLUR_PX, SATURATED_SHARE
from olivevib.planning import Setup, reach_words, step_words
from olivevib.signals import StampFit, fit_stamps

SLOW_SHARE = 0.95  # of the promised frame rate
SEEN_SHARE = 0.5  # of the looks in which a marker must have been seen by both cameras
LEAST_S = 8.0


@dataclass(frozen=True)
class CameraResult:
    """What one camera delivered.

    stamps_s (N,) of the recorded frames; promised_fps None: it promised nothing; seen: id to the
    share of looks that showed it; looks: how many frames were decoded; losses: how often it
    went away; ended: why it stopped; blur_px, saturated: medians over the looks, NaN without any.
    """

    side: str
    stamps_s: Floats
    promised_fps: float | None
    seen: Mapping[int, float]
    looks: int
    losses: int
    ended: str
    blur_px: float = math.nan
    saturated: float = math.nan


@dataclass(frozen=True)
class Verdict:
    """words: one sentence; fits: the clock of each camera's stamps, None for fewer than two frames;
    offset_s: right minus left, modulo a frame, NaN where unknown.
    """

    words: str
    offset_s: float
    fits: Mapping[str, StampFit | None]
    cautions: tuple[Caution, ...]


def judge(
    results: Sequence[CameraResult],
    band_hz: tuple[float, float] | None,
    wanted: Sequence[int],
    readout_s: float | None = None,
) -> Verdict:
    """The verdict on both cameras' recordings of a tree.

    wanted: the ids that hang on the tree, empty if nobody said so: then those that were seen.
    readout_s: from the first to the last row, None where nobody measured it.
    """
    fits = {r.side: _fit(r.stamps_s) for r in results}
    both = [fits.get(side) for side in ("left", "right")]
    offset = math.nan
    if both[0] is not None and both[1] is not None:
        offset = camera_offset_s(both[0], both[1])
    cautions = [c for r in results for c in _camera_cautions(r, fits[r.side])]
    known, seen = _markers(results, wanted)
    if any(r.looks for r in results):
        cautions += _marker_cautions(known, seen)
    dropped = sum(int(f.dropped.size) for f in fits.values() if f is not None)
    parts = [f"{len(seen)} of {len(known)} markers"] if any(r.looks for r in results) else []
    parts.append(f"{dropped} drops")
    setup = known_setup(tuple(fits.values()), offset, band_hz, readout_s)
    if setup is not None and setup.offset_s is not None:
        parts.append(step_words(setup))
    return Verdict(f"{', '.join(parts)}: {good_for(setup)}", offset, fits, tuple(cautions))


def judge_board(results: Sequence[CameraResult], coverage: Guidance | None) -> Verdict:
    """The verdict on a recording of the calibration board."""
    fits = {r.side: _fit(r.stamps_s) for r in results}
    cautions = [c for r in results for c in _camera_cautions(r, fits[r.side])]
    if coverage is None:
        return Verdict("the board was recorded, unwatched", math.nan, fits, tuple(cautions))
    shares = ", ".join(
        f"{share:.0%} of the {side} picture" for side, share in coverage.cells.items()
    )
    words = f"{coverage.pairs} views in both cameras, {shares}: "
    if not coverage.enough:
        cautions.append(
            Caution(
                "board-coverage-thin",
                "The board was not shown everywhere it should be.",
                f"Record it again, and {coverage.words}.",
            )
        )
    words += "enough for the calibration" if coverage.enough else coverage.words
    return Verdict(words, math.nan, fits, tuple(cautions))


def _fit(stamps_s: Floats) -> StampFit | None:
    return fit_stamps(stamps_s) if stamps_s.size > 1 else None


def camera_offset_s(left: StampFit, right: StampFit) -> float:
    """Right minus left, modulo a left frame, s: the middle of all frames, in -half … half."""
    period = 1.0 / left.rate_hz
    since = (right.t_s - left.t_s[0]) / period
    turn = np.angle(np.mean(np.exp(2j * np.pi * since)))
    return float(turn / (2 * np.pi) * period)


def good_for(setup: Setup | None) -> str:
    """What two cameras like these can measure: the words of ``olivevib plan`` for what is known.

    None: nothing was recorded.
    """
    return reach_words(setup) if setup is not None else "nothing was recorded"


def known_setup(
    fits: Sequence[StampFit | None],
    offset_s: float,
    band_hz: tuple[float, float] | None,
    readout_s: float | None,
) -> Setup | None:
    """The recording as a plan; offset NaN and readout None: unknown. None without two frames."""
    there = [fit for fit in fits if fit is not None]
    if not there:
        return None
    fps = round(min(fit.rate_hz for fit in there), 3)  # no clock of a computer tells more
    seconds = min(float(np.ptp(fit.t_s)) for fit in there)
    if not (fps > 0 and seconds > 0):
        return None
    offset = offset_s if math.isfinite(offset_s) else None
    longest = None if readout_s is None else min(abs(readout_s), 1 / fps)
    return Setup(fps=fps, readout_s=longest, offset_s=offset, band_hz=band_hz, seconds=seconds)


def _markers(results: Sequence[CameraResult], wanted: Sequence[int]) -> tuple[list[int], list[int]]:
    """The markers that should be seen, and those that both cameras saw often enough."""
    every = sorted({i for r in results for i in r.seen})
    known = list(wanted) or every
    looked = [r for r in results if r.looks]
    seen = [i for i in known if all(r.seen.get(i, 0.0) >= SEEN_SHARE for r in looked)]
    return known, seen if looked else []


def _camera_cautions(result: CameraResult, fit: StampFit | None) -> list[Caution]:
    side, out = result.side, []
    if fit is None:
        return [
            Caution(
                "camera-delivered-nothing",
                f"The {side} camera delivered {result.stamps_s.size} frames ({result.ended}).",
                "Check its cable and that no other program uses it; olivevib doctor lists cameras.",
            )
        ]
    if result.losses:
        out.append(
            Caution(
                "camera-vanished",
                f"The {side} camera went away {result.losses} time(s) ({result.ended}).",
                "What it delivered is recorded. Check plug and cable, or move nearer to the "
                "access point; record again if the shaking was lost.",
            )
        )
    if fit.dropped.size:
        out.append(
            Caution(
                "dropped-frames",
                f"The {side} camera skipped {fit.dropped.size} of {int(fit.sequence[-1]) + 1} "
                "frames.",
                "Use another USB port for each camera and close other programs.",
            )
        )
    promised = result.promised_fps
    if promised and fit.rate_hz < SLOW_SHARE * promised:
        out.append(
            Caution(
                "frame-rate-low",
                f"The {side} camera ran at {fit.rate_hz:.1f} instead of {promised:g} frames/s.",
                "Switch automatic exposure and its priority (dynamic frame rate) off; add light.",
            )
        )
    return out + _picture_cautions(result)


def _picture_cautions(result: CameraResult) -> list[Caution]:
    out = []
    if result.blur_px > BLUR_PX:
        out.append(
            Caution(
                "picture-blurred",
                f"Markers of the {result.side} camera are blurred by {result.blur_px:.1f} px.",
                "Focus by hand on the markers and shorten the exposure to 2 ms or less.",
            )
        )
    if result.saturated > SATURATED_SHARE:
        out.append(
            Caution(
                "picture-saturated",
                f"{result.saturated:.0%} of the {result.side} camera's markers are too bright.",
                "Halve the exposure, or shade the markers.",
            )
        )
    return out


def _marker_cautions(known: Sequence[int], seen: Sequence[int]) -> list[Caution]:
    if not known:
        return [
            Caution(
                "no-markers",
                "No marker of the library was seen by either camera.",
                "Check the library (--markers), and that prints are sharp, lit and in view.",
            )
        ]
    lost = [str(i) for i in known if i not in seen]
    if not lost:
        return []
    return [
        Caution(
            "markers-not-in-both",
            f"Not seen by both cameras most of the time: marker {', '.join(lost)}.",
            "Turn markers or cameras so that both see them, and clear leaves away.",
        )
    ]
