"""Compare a marker's path with an accelerometer: clock, drift, axes, gain, verdict in words."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison.fit import ClockFit, Seen, evaluated, fit_clock
from olivevib.comparison.forward import Nuisance, SensorMotion, nuisance, sensor_motion
from olivevib.comparison.lag import CoarseLag, envelope_offset, fine_lag, offsets_that_overlap
from olivevib.comparison.lines import line_differences, sensor_lines, steady_limits
from olivevib.comparison.noise import with_local_noise
from olivevib.comparison.outcome import Outcome, Told
from olivevib.comparison.rival import borne_out_by, rival_of
from olivevib.comparison.settings import DEFAULTS, ComparisonSettings
from olivevib.comparison.types import Comparison, LineDifference
from olivevib.comparison.views import View, fit_views
from olivevib.progress import Tick, silent
from olivevib.signals import Samples
from olivevib.vibration.clock import between, measured
from olivevib.vibration.line import LineFit
from olivevib.vibration.verdict import fold

_FEWEST = 30
_NARROWEST_HZ = 0.3
_LEAST_LEFT = 0.005  # of the motion's power that taking out the slow part must leave
_NO_COLUMNS = Nuisance(np.empty((0, 0)), 0.0)


def compare(
    optical: Samples,
    sensor: Samples,
    marker: int,
    sensor_name: str,
    settings: ComparisonSettings = DEFAULTS,
    tick: Tick = silent,
    views: tuple[View, ...] | None = None,
) -> Comparison:
    """Compare the displacement (mm, at mid-exposure) of a marker with a sensor (m/s2).

    The sensor's acceleration predicts what the camera must have seen at each of its own instants,
    so lines above half the frame rate compare as well; nothing is claimed about aliases of the
    camera alone. clock_offset_s is the sensor's stamp minus the trial clock, at the middle of the
    common record. views: where the path is one that was fitted at one frequency, the marker in each
    camera at the times of its own rows; lag, clock, gain and turn are then told by these. Raises
    ValueError for other units.
    """
    if optical.unit != "mm" or len(optical.axes) != 3:
        raise ValueError(f"marker {marker}: need three axes in mm, got {optical.unit}")
    camera_s, camera_mm = measured(optical)
    sensor, missing = _axes_that_are(sensor)
    tick(0, 4, "displacement from the accelerometer")
    motion = sensor_motion(sensor, settings.corner_hz)
    outcome = Outcome(marker, sensor_name)
    if camera_s.size < _FEWEST:
        return outcome.undecided(f"The marker was seen in {camera_s.size} frames only.")
    limits = offsets_that_overlap(camera_s, motion, settings)
    if limits is None:
        return outcome.no_overlap(camera_s, motion)
    tick(1, 4, "lines of the accelerometer")
    lines = sensor_lines(sensor, 1.5 * settings.corner_hz)
    motion, share_sigma = _localised(motion, lines, settings)
    tick(2, 4, "lag between the clocks")
    work = _Work(camera_s, camera_mm, motion, lines, settings, missing, views)
    lag = work.coarse(limits)
    lag, borne_out = work.borne_out(lag)
    tick(3, 4, "clock, gain and rotation")
    seen, clock = work.refined(lag.offset_s)
    if seen.t_s.size < _FEWEST:
        return outcome.undecided("Too few frames lie inside the accelerometer's record.")
    if views:
        clock = work.by_views(seen, clock)
    elif lines.fit is not None:
        clock = with_local_noise(seen, clock, work.line_hz)
    clock = _with_gain_sigma(clock, share_sigma)
    rival = rival_of(work.refined, lag, clock, seen.mm, borne_out)
    told = Told(
        lag=lag,
        seen=seen,
        clock=clock,
        rival=rival,
        lines=work.differences(sensor, clock),
        motion=motion,
        missing_axes=missing,
        line_hz=work.line_hz,
        gain_tolerance=settings.gain_tolerance,
    )
    return outcome.decided(told)


def _axes_that_are(sensor: Samples) -> tuple[Samples, int]:
    """The sensor with axes that it does not have (NaN throughout) taken as still, and how many."""
    missing = np.isnan(sensor.values).all(axis=0) if sensor.t_s.size else np.zeros(3, bool)
    if not missing.any() or missing.all():
        return sensor, 0
    values = np.where(missing, 0.0, sensor.values)
    whole = Samples(sensor.t_s, values, sensor.quantity, sensor.unit, sensor.axes)
    return whole, int(missing.sum())


def _localised(
    motion: SensorMotion, lines: LineFit, settings: ComparisonSettings
) -> tuple[SensorMotion, float]:
    """The motion as the camera's localiser tells it at the sensor's line, and sigma of the share.

    Source: the table of detection/exposure_gain.
    """
    if settings.localised is None or lines.fit is None:
        return motion, 0.0
    share, sigma = settings.localised(float(lines.fit.f_hz[0]))
    return replace(motion, share=share), sigma


def _with_gain_sigma(clock: ClockFit, share_sigma: float) -> ClockFit:
    """What the localiser leaves open of an amplitude, the gain leaves open too."""
    more = np.zeros((6, 6))
    more[2, 2] = (clock.gain * share_sigma) ** 2
    return replace(clock, covariance=clock.covariance + more)


@dataclass(frozen=True)
class _Work:
    camera_s: Floats
    camera_mm: Floats
    motion: SensorMotion
    lines: LineFit
    settings: ComparisonSettings
    missing_axes: int
    views: tuple[View, ...] | None  # of a fitted path

    @property
    def rate_hz(self) -> float:
        return 1.0 / float(np.median(np.diff(self.camera_s)))

    def slow_hz(self, offset_s: float) -> float:
        """Width of the slow part: 1.5 corners, unless that would take the motion itself.

        A line next to a multiple of the frame rate is seen slow. Its start-up still tells the
        clocks apart; only where next to nothing would be left is the slow part narrowed.
        """
        wide = 1.5 * self.settings.corner_hz
        if self.lines.fit is None:
            return wide
        seen = fold(float(self.lines.fit.f_hz[0]), self.rate_hz)
        narrow = max(_NARROWEST_HZ, 0.6 * seen)
        if narrow >= wide or self._left(offset_s, wide) > _LEAST_LEFT:
            return wide
        return narrow

    def _left(self, offset_s: float, limit_hz: float) -> float:
        """Share of the predicted motion's power that survives taking out the slow part."""
        good = self.motion.usable(self.camera_s + offset_s, self.settings.exposure_s)
        t_s = self.camera_s[good]
        if t_s.size < _FEWEST:
            return 0.0
        seen = self.motion.seen(t_s + offset_s, self.settings.exposure_s)
        kept = nuisance(t_s, limit_hz).out(seen)
        total = float(np.sum((seen - seen.mean(axis=0)) ** 2))
        return float(np.sum(kept**2)) / total if total > 0 else 0.0

    @property
    def apart_s(self) -> float:
        """How far a lag must lie from another to be a rival: a third of a period."""
        return 0.02 if self.lines.fit is None else 0.35 / float(self.lines.fit.f_hz[0])

    def coarse(self, limits: tuple[float, float]) -> CoarseLag:
        """The best lag: envelopes where they are lively, else about the expected offset."""
        s = self.settings
        wide = 1.5 * s.corner_hz
        seen_s, moved = self.camera_s, self.camera_mm
        if self.views:  # they saw the start of the machine, too
            seen_s, moved = self.views[0].t_s, self.views[0].px
        middle = envelope_offset(seen_s, moved, self.motion, limits, wide)
        level = middle is None
        if middle is None:
            middle = float(np.clip(s.expected_offset_s, *limits))
        half = int(np.ceil(s.fine_half_s / s.fine_step_s))
        offsets = np.asarray(middle + np.arange(-half, half + 1) * s.fine_step_s, np.float64)
        slow = nuisance(self.camera_s, self.slow_hz(middle))
        seen = Seen(self.camera_s, slow.out(self.camera_mm), slow, s.exposure_s)
        return fine_lag(seen, self.motion, offsets, self.apart_s, level)

    @property
    def line_hz(self) -> float:
        """The sensor's dominant line; NaN: none."""
        return np.nan if self.lines.fit is None else float(self.lines.fit.f_hz[0])

    def borne_out(self, lag: CoarseLag) -> tuple[CoarseLag, bool | None]:
        """The lag that the cameras' own rows bear out, and whether they exclude all others.

        None: the path is no fitted one and tells by itself.
        """
        if self.views is None:
            return lag, None
        slow_hz = 1.5 * self.settings.corner_hz
        return borne_out_by(self.views, self.motion, lag, self.refined, slow_hz, self.line_hz)

    def by_views(self, seen: Seen, clock: ClockFit) -> ClockFit:
        """The clock that the cameras' own rows tell, and what it leaves of the path."""
        slow_hz = 1.5 * self.settings.corner_hz
        told = fit_views(self.views or (), self.motion, clock, slow_hz, self.line_hz)
        if told is None:
            return clock
        path = evaluated(
            seen, self.motion, told.offset_s, told.drift, told.gain, told.R_camera_sensor
        )
        noise = np.sqrt(np.mean(path.residual_mm**2, axis=0))
        return replace(path, covariance=told.covariance, noise_mm=noise)

    def differences(self, sensor: Samples, clock: ClockFit) -> tuple[LineDifference, ...]:
        """Line by line over the steady phase, or over all that both saw."""
        start, end = steady_limits(sensor, self.camera_s, clock.offset_s)
        seen = self.seen(clock.offset_s, start, end)
        if seen.t_s.size < _FEWEST:
            return ()
        part = between(sensor, start + clock.offset_s, end + clock.offset_s)
        lines = sensor_lines(part, 1.5 * self.settings.corner_hz)
        return line_differences(seen, self.motion, clock, lines)

    def seen(self, offset_s: float, start_s: float = -np.inf, end_s: float = np.inf) -> Seen:
        """What the camera saw from start to end while the sensor's record is usable."""
        margin = 2 * self.settings.fine_step_s
        q = self.camera_s + offset_s
        good = self.motion.usable(q, self.settings.exposure_s + margin)
        good &= (self.camera_s >= start_s) & (self.camera_s <= end_s)
        t_s = self.camera_s[good]
        slow = nuisance(t_s, self.slow_hz(offset_s)) if t_s.size > 1 else _NO_COLUMNS
        return Seen(t_s, slow.out(self.camera_mm[good]), slow, self.settings.exposure_s)

    def refined(self, offset_s: float) -> tuple[Seen, ClockFit]:
        """Gauss-Newton from a coarse lag, on the frames that the sensor covers."""
        seen = self.seen(offset_s)
        if seen.t_s.size < _FEWEST:
            return seen, _no_clock()
        return seen, fit_clock(seen, self.motion, offset_s)


def _no_clock() -> ClockFit:
    none = np.full((0, 3), np.nan)
    nan3 = np.full((3, 3), np.nan)
    return ClockFit(
        np.nan, np.nan, np.nan, nan3, np.full((6, 6), np.nan), none, none, nan3[0], np.nan
    )
