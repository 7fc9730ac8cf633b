"""What the camera must have seen, predicted from the accelerometer: no Nyquist limit applies.

The sensor's acceleration becomes displacement (omega arithmetic), a spline carries it to any
instant, and the mean over the exposure is taken exactly. Slow motion is projected out of the
prediction and of the camera's paths alike. Source: CONVENTIONS.md, comparison (forward model).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from olivevib.arrays import Bools, Floats
from olivevib.signals import Samples, fit_stamps
from olivevib.vibration.clock import measured
from olivevib.vibration.kinematics import to_displacement
from olivevib.vibration.sway import sway_columns

_DENSE_HZ = 1000.0  # the spline's own rate: 40 samples in a cycle of 25 Hz
_GAP_PERIODS, _GAP_S = 2.5, 0.006  # a step longer than both is a gap: no spline bridges it
_BELOW = 2 / 3
_GAP_FADES = 2.0  # corner periods after which a bridged gap upsets no more than slow motion
_MOST_SLOW = 0.6  # of the frames that the slow part may take
_EVEN_PERIODS = 0.02


@dataclass(frozen=True)
class SensorMotion:
    """The sensor's displacement (mm, sensor axes) at any instant of its own clock.

    usable: limits of the part that ends do not disturb; gaps (G, 2): parts to keep away from.
    resampled: the sensor's stamps were uneven and a spline carried them to an even grid.
    share: of the mean over an exposure that the camera's localiser tells.
    """

    start_s: float
    end_s: float
    gaps: Floats
    resampled: bool
    spline: Any  # scipy CubicSpline of the displacement (3 axes)
    integral: Any
    share: float = 1.0

    def usable(self, q_s: Floats, exposure_s: float) -> Bools:
        """Which instants lie inside the undisturbed part and away from gaps."""
        half = exposure_s / 2
        good = (q_s - half >= self.start_s) & (q_s + half <= self.end_s)
        for low, high in self.gaps:
            good &= (q_s + half < low) | (q_s - half > high)
        return np.asarray(good)

    def seen(self, q_s: Floats, exposure_s: float) -> Floats:
        """Displacement (N, 3) as it is localised in an exposure about each instant."""
        return self._over(self.spline, self.integral, q_s, exposure_s)

    def speed(self, q_s: Floats, exposure_s: float) -> Floats:
        """Time derivative (N, 3) of ``seen``, mm/s."""
        return self._over(self.spline.derivative(), self.spline, q_s, exposure_s)

    def _over(self, value: Any, integral: Any, q_s: Floats, exposure_s: float) -> Floats:
        if exposure_s == 0:
            return np.asarray(value(q_s))
        mean = (integral(q_s + exposure_s / 2) - integral(q_s - exposure_s / 2)) / exposure_s
        return np.asarray(self.share * mean)


def sensor_motion(sensor: Samples, corner_hz: float) -> SensorMotion:
    """The sensor's displacement from its acceleration (m/s2, three axes), on its own clock.

    Raises ValueError for another unit or fewer than 16 samples.
    """
    if sensor.unit != "m/s2" or len(sensor.axes) != 3:
        raise ValueError(f"need three axes in m/s2, got {len(sensor.axes)} in {sensor.unit}")
    from scipy.interpolate import CubicSpline  # heavy: a report needs none

    t_s, a = measured(sensor)
    if t_s.size < 16:
        raise ValueError(f"need at least 16 samples, got {t_s.size}")
    even_t, even_a, resampled = even_acceleration(t_s, a)
    rate = 1.0 / float(even_t[1] - even_t[0])
    finer = max(1, int(np.ceil(_DENSE_HZ / rate)))
    corner_hz *= _BELOW  # its own loss must be gone where the slow part ends (1.5 corners)
    displacement = to_displacement(even_a, rate, corner_hz, finer)
    fine_t = even_t[0] + np.arange(displacement.shape[0]) / (rate * finer)
    spline = CubicSpline(fine_t, displacement)
    margin = 1.0 / corner_hz
    steps = np.diff(t_s)
    at = np.flatnonzero(steps > max(_GAP_PERIODS * float(np.median(steps)), _GAP_S))
    upset = _GAP_FADES * margin
    gaps = np.stack([t_s[at] - upset, t_s[at + 1] + upset], axis=1)
    return SensorMotion(
        start_s=float(t_s[0]) + margin,
        end_s=float(t_s[-1]) - margin,
        gaps=gaps,
        resampled=resampled,
        spline=spline,
        integral=spline.antiderivative(),
    )


def even_acceleration(t_s: Floats, a: Floats) -> tuple[Floats, Floats, bool]:
    """Even times, values on them, and whether a spline had to carry the values there.

    Stamps that scatter about an even clock are that clock (the scatter is the logger's, not the
    sensor's). Where samples are missing or the rate truly varies a spline bridges; gaps are
    reported by the caller, who keeps away from them.
    """
    fit = fit_stamps(t_s)
    if fit.method == "line" and not fit.dropped.size:
        return fit.t_s, a, False
    from scipy.interpolate import CubicSpline

    n = int(fit.sequence[-1]) + 1
    even_t = fit.t_s[0] + np.arange(n) * (fit.t_s[-1] - fit.t_s[0]) / (n - 1)
    return even_t, np.asarray(CubicSpline(fit.t_s, a)(even_t)), True


@dataclass(frozen=True)
class Nuisance:
    """Orthonormal slow columns (N, K) that are taken out of prediction and camera alike.

    limit_hz: they span motion slower than that; 0 where only the mean is taken out.
    """

    columns: Floats
    limit_hz: float

    @property
    def count(self) -> int:
        """How many degrees of freedom an axis loses."""
        return int(self.columns.shape[1])

    def out(self, values: Floats) -> Floats:
        """Values (..., N, C) without their slow part."""
        return np.asarray(values - self.columns @ (self.columns.T @ values))


def nuisance(t_s: Floats, limit_hz: float) -> Nuisance:
    """The slow columns below limit_hz on camera times t_s; at least the constant."""
    columns = sway_columns(t_s, limit_hz, _MOST_SLOW)
    if columns is None:
        return Nuisance(np.full((t_s.size, 1), 1.0 / np.sqrt(t_s.size)), 0.0)
    return Nuisance(columns, limit_hz)
