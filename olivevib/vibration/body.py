"""Six degrees of freedom: how a marker turns, and how any point of its body moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from olivevib.arrays import Floats, floats
from olivevib.signals import Samples
from olivevib.vibration.clock import between, measured
from olivevib.vibration.line import LineSettings, fit_line
from olivevib.vibration.phases import Phase
from olivevib.vibration.types import Line, LineStatus
from olivevib.vibration.verdict import SamplingFacts

_FEWEST = 12
_DECIDED = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)


@dataclass(frozen=True)
class Attitude:
    """How one marker was turned: t_s (N,), rotation_rad (N, 3) rotation vectors, marker to camera.

    NaN where it was not known. Used as turns about the mean attitude, in camera axes.
    """

    t_s: Floats
    rotation_rad: Floats

    def __post_init__(self) -> None:
        t_s = floats("t_s", self.t_s, (None,))
        object.__setattr__(self, "t_s", t_s)
        value = floats("rotation_rad", self.rotation_rad, (t_s.size, 3), nan=True)
        object.__setattr__(self, "rotation_rad", value)

    @property
    def known(self) -> bool:
        """Whether there are enough attitudes to say anything of its turning."""
        return int(np.isfinite(self.rotation_rad).all(axis=1).sum()) >= _FEWEST

    def turns(self) -> Samples:
        """Small turns about the mean attitude, mrad, in camera axes, where they are known."""
        good = np.isfinite(self.rotation_rad).all(axis=1)
        each = Rotation.from_rotvec(self.rotation_rad[good])
        away = (each * each.mean().inv()).as_rotvec()
        return Samples(self.t_s[good], 1e3 * away, "rotation", "mrad", ("x", "y", "z"))


@dataclass(frozen=True)
class Turning:
    """A marker's rotation in one phase, in camera axes: rms and the dominant line, peak, per axis.

    velocity_rad_s, acceleration_rad_s2 of that line; NaN where its true frequency is not known.
    """

    line: Line
    rms_mrad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats

    def __post_init__(self) -> None:
        for name in ("rms_mrad", "velocity_rad_s", "acceleration_rad_s2"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (3,), nan=True))


def turning(attitude: Attitude, phase: Phase, facts: SamplingFacts) -> Turning | None:
    """The rotation of a marker in a phase; None where its attitude is not known there."""
    if not attitude.known:
        return None
    part = between(attitude.turns(), phase.start_s, phase.end_s)
    if part.t_s.size < _FEWEST:
        return None
    line = fit_line(part, facts, LineSettings(harmonics=1, neighbours=1)).line
    omega = 2 * np.pi * line.f_hz if line.status in _DECIDED else np.nan
    return Turning(
        line=line,
        rms_mrad=part.values.std(axis=0),
        velocity_rad_s=1e-3 * omega * line.amplitude,
        acceleration_rad_s2=1e-3 * omega**2 * line.amplitude,
    )


def point_motion(centre: Samples, attitude: Attitude, at_mm: Floats) -> Samples:
    """Displacement of a point of the marker's body, mm: at_mm (3,) from its centre, in its axes.

    centre: the marker's displacement; attitude: its rotation at the same instants. Marker axes: x
    to the right, y down as printed, z into the surface. A sample whose attitude is not known is
    left out. Rotations that are uncertain by s add s |at_mm| of noise. Raises ValueError where the
    two have other times.
    """
    if not np.any(at_mm):
        return centre
    if attitude.t_s.shape != centre.t_s.shape or np.abs(attitude.t_s - centre.t_s).max() > 1e-9:
        raise ValueError("centre and attitude have different times")
    good = np.isfinite(attitude.rotation_rad).all(axis=1) & np.isfinite(centre.values).all(axis=1)
    arm = Rotation.from_rotvec(attitude.rotation_rad[good]).apply(np.asarray(at_mm, np.float64))
    arm = arm - arm.mean(axis=0) if len(arm) else arm
    return Samples(
        centre.t_s[good], centre.values[good] + arm, centre.quantity, centre.unit, centre.axes
    )


def relative_motion(
    motion: Samples, reference: Samples, facts: SamplingFacts, settings: LineSettings
) -> Samples:
    """Displacement of one marker less that of another, at the first one's own instants, mm.

    Two markers of a frame are seen at different rows, hence instants. The reference's waves are
    evaluated at the first one's instant exactly; what they leave is taken from its own sample of
    that frame (nearest, within half a frame: nothing is interpolated). Samples without one are
    left out. Above half the frame rate this is right for the line's own frequency only.
    """
    t_s, values = measured(motion)
    other_s, other = measured(reference)
    if t_s.size == 0 or other_s.size < _FEWEST:
        return Samples(t_s[:0], values[:0], motion.quantity, motion.unit, motion.axes)
    found = fit_line(reference, facts, settings)
    nearest = np.clip(np.searchsorted(other_s, t_s), 1, other_s.size - 1)
    nearest -= t_s - other_s[nearest - 1] < other_s[nearest] - t_s
    near = np.abs(other_s[nearest] - t_s) <= 0.5 / facts.frame_rate_hz
    taken = other[nearest]
    if found.fit is not None:
        taken = taken - found.fit.motion(other_s)[nearest] + found.fit.motion(t_s)
    left = (values - taken)[near]
    left = left - left.mean(axis=0) if len(left) else left
    return Samples(t_s[near], left, motion.quantity, motion.unit, motion.axes)
