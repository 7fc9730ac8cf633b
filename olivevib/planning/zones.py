"""Frequencies at which a frame rate shows one motion as another, whatever is done later.

Harmonics p f and q f (p, q up to 2 in size, 0: the sway) fall on each other where (p - q) f is a
multiple of the frame rate. Cameras out of step by 8–13 ms (at 30 frames/s) see them apart.
Source: knowledge of the field (sampling time, 5.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SWAY_HZ = 2.5  # around the frame rate: the sway follows a motion that slow
NARROW_HZ = 0.3  # around the others
BAND_HZ = (5.0, 45.0)


@dataclass(frozen=True)
class Zone:
    """A range of frequencies with the reason why it is avoided.

    blind: no amplitude at all there; doubtful: the branch is in doubt (else the second harmonic).
    """

    centre_hz: float
    half_hz: float
    blind: bool
    doubtful: bool
    why: str

    def holds(self, f_hz: float) -> bool:
        """Whether f_hz lies inside."""
        return abs(f_hz - self.centre_hz) <= self.half_hz + 1e-9


def zones(
    fps: float,
    apart: bool,
    seconds: float = math.inf,
    band_hz: tuple[float, float] = BAND_HZ,
    rolling: bool = True,
) -> tuple[Zone, ...]:
    """All zones whose centre lies in the band, ascending.

    apart: the cameras are out of step by a quarter to two fifths of a frame. Short records widen
    the narrow ones to 1/T. rolling: rows see different moments.
    """
    narrow = max(NARROW_HZ, 1.0 / seconds)
    found: dict[float, Zone] = {}
    for order in (1, 2, 3, 4):
        for k in range(1, math.ceil(order * (band_hz[1] + SWAY_HZ) / fps) + 1):
            centre = k * fps / order
            if centre not in found and band_hz[0] <= centre <= band_hz[1]:
                found[centre] = _zone(centre, order, fps, apart, (narrow, rolling))
    return tuple(found[c] for c in sorted(found))


def zone_of(f_hz: float, all_zones: tuple[Zone, ...]) -> Zone | None:
    """The zone that holds f_hz, the blind ones first; None outside of all."""
    inside = [z for z in all_zones if z.holds(f_hz)]
    return min(inside, key=lambda z: not z.blind, default=None)


def _zone(centre: float, order: int, fps: float, apart: bool, how: tuple[float, bool]) -> Zone:
    narrow, rolling = how
    if order == 1:
        width = narrow if apart else SWAY_HZ
        why = f"at {fps:g} frames/s it looks like the sway of the tree"
        return Zone(centre, width, True, True, why)
    if order == 2:
        why = "it is its own mirror at this frame rate"
        return Zone(centre, narrow, not apart and not rolling, not apart, why)
    if order == 3:
        why = "its second harmonic falls on the line itself"
        return Zone(centre, narrow, False, not apart, why)
    return Zone(centre, narrow, False, False, "its second harmonic is its own mirror")
