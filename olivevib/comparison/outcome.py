"""What a comparison comes out at: verdict, reason and remarks in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.fit import ClockFit, Seen
from olivevib.comparison.forward import SensorMotion
from olivevib.comparison.lag import CoarseLag
from olivevib.comparison.rival import CLOSE, Rival, angle_deg, coherence_of
from olivevib.comparison.types import Comparison, LineDifference, Verdict

_RESEMBLES = 0.8  # correlation below which the two motions are not called the same
_OPEN_DEG = 8.0  # sigma of the turn from which what is seen across may be noise
_OPEN_RAD = 1.0  # sigma of a turn that nothing fixes
_QUARTER = 0.25 / np.sqrt(3)  # of a period: sigma of a lag that may be off by a quarter


@dataclass(frozen=True)
class Told:
    """What a verdict rests on.

    line_hz: the sensor's dominant line, NaN for none. gain_tolerance: how far a gain may lie from 1
    and still agree.
    """

    lag: CoarseLag
    seen: Seen
    clock: ClockFit
    rival: Rival
    lines: tuple[LineDifference, ...]
    motion: SensorMotion
    missing_axes: int
    line_hz: float
    gain_tolerance: float


@dataclass(frozen=True)
class Outcome:
    """A comparison that says nothing yet."""

    marker: int
    sensor: str

    def undecided(self, reason: str) -> Comparison:
        """Nothing was found, and why."""
        return self.nothing(Verdict.UNDECIDED, reason)

    def no_overlap(self, camera_s: Floats, motion: SensorMotion) -> Comparison:
        """The two records have too little in common."""
        reason = (
            f"The accelerometer's usable part runs from {motion.start_s:.2f} to "
            f"{motion.end_s:.2f} s of its own clock, the camera's from {camera_s[0]:.2f} to "
            f"{camera_s[-1]:.2f} s: within the search there is no common half. Give the expected "
            "offset between the clocks, or let both run through the whole trial."
        )
        return self.nothing(Verdict.NO_OVERLAP, reason)

    def nothing(self, verdict: Verdict, reason: str) -> Comparison:
        """A comparison without numbers."""
        nan = float("nan")
        return Comparison(
            marker=self.marker,
            sensor=self.sensor,
            clock_offset_s=nan,
            clock_offset_sigma_s=nan,
            clock_drift_ppm=nan,
            clock_drift_sigma_ppm=nan,
            gain=nan,
            gain_sigma=nan,
            R_camera_sensor=np.full((3, 3), nan),
            rotation_deg=nan,
            rotation_sigma_deg=nan,
            coherence=nan,
            peak=nan,
            second_peak=nan,
            lines=(),
            overlay_t_s=np.empty(0),
            optical_mm=np.empty((0, 3)),
            sensor_mm=np.empty((0, 3)),
            verdict=verdict,
            reason=reason,
        )

    def decided(self, told: Told) -> Comparison:
        """The comparison with its verdict in words."""
        clock, rival = told.clock, told.rival
        sigma = clock.sigma
        offset_sigma = float(np.hypot(sigma[0], 0.0 if rival.excluded else rival.scatter_s))
        if told.missing_axes:
            offset_sigma = float(np.hypot(offset_sigma, _QUARTER / told.line_hz))
        straight = _is_straight(told.seen.mm, clock)
        worst_deg = float(np.degrees(_OPEN_RAD if straight else clock.turn_sigma_rad))
        angle = angle_deg(clock.R_camera_sensor)
        coherence = coherence_of(told.seen.mm, clock.residual_mm)
        verdict, reason = _verdict(told, coherence)
        if rival.open and verdict is Verdict.AGREES:
            verdict, reason = Verdict.UNDECIDED, f"Amplitudes only: {reason[0].lower()}{reason[1:]}"
        reasons = [reason, *_remarks(told, worst_deg)]
        return Comparison(
            marker=self.marker,
            sensor=self.sensor,
            clock_offset_s=clock.offset_s,
            clock_offset_sigma_s=offset_sigma,
            clock_drift_ppm=1e6 * clock.drift,
            clock_drift_sigma_ppm=1e6 * float(sigma[1]),
            gain=clock.gain,
            gain_sigma=float(sigma[2]),
            R_camera_sensor=clock.R_camera_sensor,
            rotation_deg=angle if worst_deg < _OPEN_DEG else np.nan,
            rotation_sigma_deg=worst_deg,
            coherence=coherence,
            peak=told.lag.peak,
            second_peak=told.lag.second_peak,
            lines=told.lines,
            overlay_t_s=told.seen.t_s,
            optical_mm=told.seen.mm,
            sensor_mm=clock.predicted_mm,
            verdict=verdict,
            reason=" ".join(reasons),
            ambiguous=rival.open,
            rival_offset_s=rival.offset_s if rival.open else np.nan,
            rival_turn_deg=rival.turn_deg if rival.open else np.nan,
        )


def _is_straight(optical: Floats, clock: ClockFit) -> bool:
    """True where the motion across its main direction is not the sensor's own: no turn from it.

    What the sensor predicts across may be its noise alone; the camera then sees none of it. Taken
    as real where the camera sees at least half of it.
    """
    main = np.linalg.eigh(clock.predicted_mm.T @ clock.predicted_mm)[1][:, -1]
    across = clock.predicted_mm - np.outer(clock.predicted_mm @ main, main)
    size = float(np.sum(across**2))
    seen = float(np.sum(across * optical)) / size if size > 0 else 0.0
    return seen < 0.5 * clock.gain


def _verdict(told: Told, coherence: float) -> tuple[Verdict, str]:
    lag, clock, tolerance = told.lag, told.clock, told.gain_tolerance
    r = float(np.sqrt(coherence)) if np.isfinite(coherence) else 0.0
    if told.missing_axes and r > 0.5:
        return Verdict.UNDECIDED, (
            f"The accelerometer has {3 - told.missing_axes} of three axes: the clocks are "
            f"compared (correlation {r:.2f}), but a gain of {clock.gain:.3f} may be the angle "
            "between its axes and the motion, and the clock offset is open by up to a quarter "
            "period: without all axes, the phase of an orbit looks like a lag."
        )
    if r < _RESEMBLES:
        if lag.peak - lag.second_peak < CLOSE or r < 0.5:
            return Verdict.UNDECIDED, (
                f"No lag was found at which the two motions resemble one another (correlation "
                f"{r:.2f}). Check that both belong to this trial and that the sensor sat at the "
                "marker."
            )
        return Verdict.DIFFERS, (
            f"At the best lag the two motions correlate by {r:.2f} only: the sensor and the "
            "marker did not move as one body."
        )
    off, sigma = clock.gain - 1, float(clock.sigma[2])
    size = f"{100 * off:+.2f} ± {100 * sigma:.2f} %"
    if abs(off) <= max(tolerance, 3 * sigma):
        if sigma > tolerance:
            return Verdict.UNDECIDED, f"The gain is known to {100 * sigma:.0f} % only."
        return Verdict.AGREES, f"Camera and accelerometer agree: gain {size}, correlation {r:.4f}."
    return Verdict.DIFFERS, (
        f"The camera's amplitude differs from the accelerometer's by {size} (correlation {r:.4f}): "
        "check the sensor's scale, the marker's size and the calibration."
    )


def _remarks(told: Told, worst_deg: float) -> list[str]:
    rival, motion, out = told.rival, told.motion, []
    if rival.open:
        out.append(
            f"The lag is ambiguous: {1e3 * rival.distance_s:.1f} ms away the two fit as well with "
            f"the sensor turned by {rival.turn_deg:.0f}° against this (a steady motion repeats "
            "itself, and half a period is half a turn). Let both record the start of the machine."
        )
    elif rival.near:
        out.append(
            f"A lag {1e3 * rival.distance_s:.1f} ms away fits almost as well, but is excluded by "
            + (
                "what each camera saw of the whole trial."
                if rival.by_views
                else "the whole record."
            )
        )
    if worst_deg >= _OPEN_DEG:
        out.append("The motion is straight: the turn about it is left open.")
    if motion.gaps.size:
        out.append(f"{len(motion.gaps)} gaps in the accelerometer's record were left out.")
    if motion.resampled:
        out.append("The accelerometer's stamps are uneven; a spline carried it to an even grid.")
    return out
