"""How far the frequency of a line is known: aliases, blind zones, status and reasons in words.

A camera at rate F shows a motion at f and at k F +- f alike. What may decide between them is time:
rows read one after another, cameras out of step. This module knows only *whether* such evidence
exists; weighing it takes the continuous-time fit, so nothing here ever says "confirmed".

Decisions, in this order (CONVENTIONS.md, status of a line):

- *direct*: the rate exceeds twice the upper end of the band. Then no alias lies in the band.
- *blind*: the line lies where sway, or its own mirror, looks the same at this rate.
- *supported*: exactly one candidate lies in a band that the user declared for this trial. The
  operator's word is evidence, but no measurement: the line is as sure as the band.
- *aliased*: several candidates, and nothing in the recording can ever decide between them.
- *ambiguous*: candidates remain and the recording holds evidence that has not been weighed. One
  candidate in a band that nobody declared is ambiguous too, with the nearest rival outside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.vibration.types import LineStatus

SWAY_HZ = 2.5  # slower than this at the frame rate, a line looks like sway
MIRROR_HZ = 0.3  # nearer than this to half the rate, a line is its own mirror


def sway_below(band_hz: tuple[float, float] | None) -> float:
    """Below this, Hz, a motion counts as sway: half the band's lower end, at most 2.5 Hz."""
    return SWAY_HZ if band_hz is None else min(SWAY_HZ, 0.5 * band_hz[0])


@dataclass(frozen=True)
class SamplingFacts:
    """What is known of when and how often the markers were seen.

    frame_rate_hz: rate of the stamps. row_time_known with row_time_s (0: global shutter, the rows
    carry no evidence); right_offset_known with right_offset_s between the cameras; stamps_true:
    stamps belong to exposures (not made up from a rate). band_hz: where the machine can be;
    band_declared: a person said so for this trial. exposure_s: 0 where unknown.
    """

    frame_rate_hz: float
    row_time_known: bool = False
    right_offset_known: bool = False
    stamps_true: bool = False
    band_hz: tuple[float, float] = (5.0, 45.0)
    band_declared: bool = False
    row_time_s: float | None = None
    right_offset_s: float | None = None
    exposure_s: float = 0.0

    def __post_init__(self) -> None:
        low, high = self.band_hz
        if not 0 <= low < high or not np.isfinite(high):
            raise ValueError(f"band_hz must be 0 <= low < high, got {self.band_hz}")
        if not (np.isfinite(self.frame_rate_hz) and self.frame_rate_hz > 0):
            raise ValueError(f"frame_rate_hz must be positive, got {self.frame_rate_hz}")
        if not 0 <= self.exposure_s < 1:
            raise ValueError(f"exposure_s must be in 0 ... 1 s, got {self.exposure_s}")

    @property
    def direct(self) -> bool:
        """The rate exceeds twice the upper end of the band: no alias lies in the band."""
        return self.frame_rate_hz > 2 * self.band_hz[1]

    @property
    def sway_hz(self) -> float:
        """Below this a motion counts as sway."""
        return sway_below(self.band_hz)

    def evidence(self) -> tuple[str, ...]:
        """What in the recording could tell aliases apart, in words; empty: nothing."""
        if not self.stamps_true:
            return ()
        found = []
        if self.row_time_known and self.row_time_s != 0:
            found.append("the row times of the rolling shutters")
        if self.right_offset_known and self._out_of_step():
            found.append("the cameras out of step")
        return tuple(found)

    def _out_of_step(self) -> bool:
        if self.right_offset_s is None:
            return True
        frames = self.right_offset_s * self.frame_rate_hz
        return abs(frames - round(frames)) > 0.05


@dataclass(frozen=True)
class Finding:
    """Status, candidates (ascending, Hz) and reasons of one line."""

    status: LineStatus
    candidates_hz: tuple[float, ...]
    reasons: tuple[str, ...]


def fold(f_hz: float, rate_hz: float) -> float:
    """Where f_hz is seen at that frame rate: its distance to the nearest multiple of the rate."""
    return abs(f_hz - rate_hz * round(f_hz / rate_hz))


def candidates(seen_hz: float, rate_hz: float, band_hz: tuple[float, float]) -> tuple[float, ...]:
    """Every k rate +- seen inside the band, ascending; ``seen_hz`` up to half the rate."""
    low, high = band_hz
    top = int(np.ceil(high / rate_hz)) + 1
    found = {k * rate_hz + sign * seen_hz for k in range(top + 1) for sign in (-1, 1)}
    margin = 1e-9 * rate_hz
    inside = sorted(f for f in found if low - margin <= f <= high + margin and f > 0)
    return tuple(f for i, f in enumerate(inside) if i == 0 or f - inside[i - 1] > 1e-9 * rate_hz)


def judge(
    seen_hz: float, facts: SamplingFacts, amplitude_mm: float = np.nan, span_s: float = np.inf
) -> Finding:
    """The status of a line seen at ``seen_hz`` (below half the rate, or in the band if direct).

    amplitude_mm: of the largest axis, to say in words what each candidate would mean; span_s:
    length of the record, which limits how close to a blind zone a line may lie.
    """
    if facts.direct:
        return _direct(seen_hz, facts)
    inside = candidates(seen_hz, facts.frame_rate_hz, facts.band_hz)
    zone = _blind_zone(seen_hz, facts, span_s)
    if zone:
        return Finding(LineStatus.BLIND, inside, (zone, _what_next(facts)))
    if len(inside) == 1:
        return _single(seen_hz, inside[0], facts)
    words = _meaning(inside, facts, amplitude_mm)
    evidence = facts.evidence()
    if evidence:
        why = f"{_and(evidence).capitalize()} could decide, but no fit has weighed them."
        return Finding(LineStatus.AMBIGUOUS, inside, (words, why, _what_next(facts)))
    return Finding(LineStatus.ALIASED, inside, (words, _nothing_decides(facts), _what_next(facts)))


def _direct(seen_hz: float, facts: SamplingFacts) -> Finding:
    low, high = facts.band_hz
    reasons = [
        f"{facts.frame_rate_hz:.2f} frames/s exceed twice the band of {low:g}-{high:g} Hz: "
        "no alias lies in it."
    ]
    if not facts.stamps_true:
        reasons.append(
            "The time stamps come from the frame rate alone; the frequency is as right as that "
            "rate. Record with time stamps next time."
        )
    return Finding(LineStatus.DIRECT, (float(seen_hz),), tuple(reasons))


def _single(seen_hz: float, f_hz: float, facts: SamplingFacts) -> Finding:
    low, high = facts.band_hz
    rivals = candidates(seen_hz, facts.frame_rate_hz, (0.0, high + facts.frame_rate_hz))
    rival = min((f for f in rivals if abs(f - f_hz) > 1e-6), key=lambda f: abs(f - f_hz))
    if facts.band_declared:
        why = (
            f"Probably {f_hz:.2f} Hz, by the declared band of {low:g}-{high:g} Hz only: "
            f"{rival:.2f} Hz would look the same and is excluded by nothing that was measured."
        )
        return Finding(LineStatus.SUPPORTED, (f_hz,), (why, _what_next(facts)))
    both = tuple(sorted((f_hz, rival)))
    why = (
        f"{_or(both)} Hz look the same at {facts.frame_rate_hz:.2f} frames/s. Only {f_hz:.2f} Hz "
        f"lies in the default band of {low:g}-{high:g} Hz, which nobody declared for this trial."
    )
    return Finding(LineStatus.AMBIGUOUS, both, (why, _what_next(facts)))


def _blind_zone(seen_hz: float, facts: SamplingFacts, span_s: float) -> str:
    """Why a line at seen_hz cannot be told from something else, or nothing."""
    rate = facts.frame_rate_hz
    narrow = max(MIRROR_HZ, 1.0 / span_s)
    if seen_hz < facts.sway_hz:
        return (
            f"Seen at {seen_hz:.2f} Hz, where at {rate:.2f} frames/s it looks like the slow sway "
            "of the tree; no amplitude is given."
        )
    if rate / 2 - seen_hz < narrow:
        return (
            f"Seen at {seen_hz:.2f} Hz, next to half the frame rate, where a line is its own "
            "mirror image; no amplitude is given."
        )
    if abs(seen_hz - rate / 3) < narrow:
        return (
            f"Seen at {seen_hz:.2f} Hz, a third of the frame rate, where the second harmonic "
            "falls on the line itself; no amplitude is given."
        )
    return ""


def _meaning(inside: tuple[float, ...], facts: SamplingFacts, amplitude_mm: float) -> str:
    if not inside:
        low, high = facts.band_hz
        return f"No frequency in the band of {low:g}-{high:g} Hz looks like this line."
    words = f"{_or(inside)} Hz look the same at {facts.frame_rate_hz:.2f} frames/s"
    if not np.isfinite(amplitude_mm):
        return words + "."
    accelerations = [(2 * np.pi * f) ** 2 * amplitude_mm * 1e-3 for f in inside]
    sizes = ", ".join(f"{a:.3g}" for a in accelerations[:-1])
    sizes = f"{sizes} or {accelerations[-1]:.3g}" if sizes else f"{accelerations[-1]:.3g}"
    return f"{words}: the same {amplitude_mm:.3g} mm would be {sizes} m/s²."


def _nothing_decides(facts: SamplingFacts) -> str:
    if not facts.stamps_true:
        return "The frames carry no true time stamps, so nothing in this recording can decide."
    if facts.row_time_known and facts.row_time_s == 0:
        return "The cameras see all rows at once and in step, so nothing here can decide."
    return "The cameras' row times are not known, so nothing in this recording can decide."


def _what_next(facts: SamplingFacts) -> str:
    high = facts.band_hz[1]
    advice = [f"record above {2 * high:.0f} frames/s"]
    if not facts.stamps_true:
        advice.append("keep the time stamps of the frames")
    if not facts.row_time_known:
        advice.append("measure the cameras' row time (olivevib rowtime)")
    if not facts.band_declared:
        advice.append("declare the band that the machine can reach (--band)")
    return f"Next time: {_or_words(advice)}."


def _or(values: tuple[float, ...]) -> str:
    return _or_words([f"{f:.2f}" for f in values])


def _or_words(words: list[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1]


def _and(words: tuple[str, ...]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
