"""Quality warnings of an analysis; their codes stand in FORMAT.md."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from olivevib.errors import Caution
from olivevib.vibration.motion import MarkerMotion
from olivevib.vibration.phases import WHOLE
from olivevib.vibration.types import LineStatus
from olivevib.vibration.verdict import SamplingFacts

SHARP, BLURRED = 0.05, 0.25  # frequency times exposure: no correction needed; no amplitude left


def cautions(rows: Sequence[MarkerMotion], phase: str, facts: SamplingFacts) -> tuple[Caution, ...]:
    """What the rows of that phase must be read with."""
    shown = [r for r in rows if r.phase == phase]
    found = [*_frequency({r.line.status for r in shown}, facts), *_exposure(shown, facts)]
    if phase == WHOLE:
        found.append(
            Caution(
                "no-steady-phase",
                "No steady phase was found; the figures are of the whole record.",
                "Look at the paths, and set the phases by hand if the machine did run steadily.",
            )
        )
    return tuple(found)


def _frequency(statuses: set[LineStatus], facts: SamplingFacts) -> list[Caution]:
    low, high = facts.band_hz
    out = []
    if statuses & {LineStatus.AMBIGUOUS, LineStatus.ALIASED}:
        out.append(
            Caution(
                "frequency-undecided",
                f"At {facts.frame_rate_hz:.2f} frames/s several frequencies in the band of "
                f"{low:g}-{high:g} Hz look the same: no single frequency, velocity or "
                "acceleration is given.",
                f"Declare the band that the machine can reach (--band), or record above "
                f"{2 * high:.0f} frames/s.",
            )
        )
    if LineStatus.BLIND in statuses:
        out.append(
            Caution(
                "frequency-blind",
                "A line lies where this frame rate cannot tell it from sway or from its mirror.",
                "Change the machine's speed by 2 Hz or the cameras' frame rate.",
            )
        )
    if LineStatus.CHIRP in statuses:
        out.append(
            Caution(
                "frequency-chirp",
                "The machine's speed changes too fast for one line to describe it.",
                "Let the machine run at one speed for at least five seconds.",
            )
        )
    return out


def _exposure(shown: Sequence[MarkerMotion], facts: SamplingFacts) -> list[Caution]:
    """How much the exposure blurs the fastest frequency that a line may have.

    The mean over an exposure E keeps sinc(f E) of a line; what a localiser keeps lies between
    that and all of it, so nothing is corrected here (CONVENTIONS.md, exposure).
    """
    fastest = max((f for r in shown for f in r.line.candidates_hz), default=0.0)
    blur = fastest * facts.exposure_s
    if blur <= SHARP:
        return []
    lost = 100 * (1 - float(np.sinc(blur)))
    remedy = f"Expose at most {1e3 * SHARP / fastest:.1f} ms; bring lamps if that is too dark."
    words = f"{1e3 * facts.exposure_s:.1f} ms of exposure at {fastest:.1f} Hz"
    if blur > BLURRED:
        text = f"{words} blur the markers: amplitudes there mean little (up to {lost:.0f} % lost)."
        return [Caution("exposure-too-long", text, remedy)]
    text = f"{words} may make amplitudes up to {lost:.1f} % too small; they are not corrected."
    return [Caution("exposure-blur", text, remedy)]
