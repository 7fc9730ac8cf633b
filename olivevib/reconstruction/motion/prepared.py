"""Everything before the first frequency: pixels, poses, the linear problem, the candidates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from olivevib.arrays import Floats
from olivevib.geometry import StereoRig
from olivevib.reconstruction.motion import branches as br
from olivevib.reconstruction.motion.growth import Growth
from olivevib.reconstruction.motion.offset import with_offset
from olivevib.reconstruction.motion.pixels import Pixels, look
from olivevib.reconstruction.motion.prepare import (
    layout,
    model_of,
    offset_sigma,
    sway_precision,
)
from olivevib.reconstruction.motion.problem import Pose, Whitening
from olivevib.reconstruction.motion.sightings import Observations
from olivevib.reconstruction.motion.solve import Model
from olivevib.reconstruction.motion.start import about_sway
from olivevib.reconstruction.motion.types import (
    Anchor,
    MotionSettings,
)

SAME = 0.02  # of a cycle over the record: two candidates are one; alike ones of two kinds are not


@dataclass(frozen=True)
class Prepared:
    """Everything before the first frequency."""

    observations: Observations
    rig: StereoRig
    anchor: Anchor
    settings: MotionSettings
    pixels: Pixels
    poses: tuple[Pose, ...]
    whites: tuple[Whitening, ...]
    model: Model
    start_s: float
    end_s: float
    offset_sigma_s: float
    offset_found: bool


def prepare(
    observations: Observations,
    rig: StereoRig,
    anchor: Anchor,
    settings: MotionSettings,
    phase: Callable[[Floats], Floats] | None = None,
    size: Callable[[Floats], Floats] | None = None,
) -> Prepared:
    """Pixels, poses and the linear problem about the sway; phase, size: of an uneven line."""
    pixels = look(observations, settings.knot_s, settings.harmonics, phase, size)
    searched, found = with_offset(observations, rig, anchor, settings, pixels)
    clock, knots, start, end = layout(observations, searched, settings, pixels.knot_s)
    poses, problems, whites = about_sway(
        observations, rig, pixels, clock, knots, sway_precision(settings)
    )
    model = model_of(problems, observations, searched, settings, knots, clock.mid_s)
    sigma = offset_sigma(searched, settings)
    return Prepared(
        observations=observations,
        rig=rig,
        anchor=anchor,
        settings=settings,
        pixels=pixels,
        poses=poses,
        whites=whites,
        model=model,
        start_s=start,
        end_s=end,
        offset_sigma_s=sigma,
        offset_found=found,
    )


def growing(ready: Prepared, grown: Growth) -> Prepared:
    """Everything prepared again for an amplitude that grows evenly."""
    again = prepare(ready.observations, ready.rig, ready.anchor, ready.settings, None, grown.size)
    return replace(again, model=replace(again.model, growth=grown.share))


def candidate_frequencies(ready: Prepared) -> Floats:
    """All frequencies of the band, and a little beyond, that could show what was seen."""
    rate, span = ready.observations.frame_rate_hz, ready.end_s - ready.start_s
    low, high = ready.settings.band_hz
    band = band_of(ready)
    peaks = ready.pixels.peaks_hz + br.zone_peak(ready.model, rate, (low, high), span)
    found = br.families(peaks, rate, band)
    if not found.size:
        raise ValueError(f"nothing periodic appears in the band of {low:g}-{high:g} Hz")
    return br.merged(found, SAME / span)


def band_of(ready: Prepared) -> tuple[float, float]:
    """The band, and half a frame rate more where nobody declared it: rivals hide there."""
    low, high = ready.settings.band_hz
    more = 0.0 if ready.settings.band_declared else ready.observations.frame_rate_hz / 2
    return low, high + more
