"""Optical against accelerometer: clocks, axes, gain, coherence."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import nan

import numpy as np

from olivevib.arrays import Floats, floats


class Verdict(StrEnum):
    """What the comparison says; the reason stands beside it in words."""

    AGREES = "agrees"
    DIFFERS = "differs"
    UNDECIDED = "undecided"
    NO_OVERLAP = "no overlap"


@dataclass(frozen=True)
class LineDifference:
    """One spectral line as the camera and as the sensor saw it (peak amplitudes, m/s²)."""

    f_hz: float
    optical_m_s2: float
    optical_sigma_m_s2: float
    sensor_m_s2: float
    sensor_sigma_m_s2: float
    phase_deg: float
    phase_sigma_deg: float


@dataclass(frozen=True)
class Comparison:
    """One marker against one sensor; NaN where a quantity is not known, each with its sigma.

    clock_offset_s: the accelerometer's stamp minus the trial clock. gain: optical / sensor.
    R_camera_sensor (3, 3) turns sensor axes into the trajectory's frame. coherence: share of the
    motion that both see, 0…1. second_peak: correlation at the best rival lag, beside ``peak``.
    overlay: t_s (N,), optical and sensor (N, 3) displacement in mm, on the trial clock.
    ambiguous: another lag, rival_offset_s, fits as well, with the sensor turned by
    rival_turn_deg against this one (180: half a period is half a turn).
    """

    marker: int
    sensor: str
    clock_offset_s: float
    clock_offset_sigma_s: float
    clock_drift_ppm: float
    clock_drift_sigma_ppm: float
    gain: float
    gain_sigma: float
    R_camera_sensor: Floats
    rotation_deg: float
    rotation_sigma_deg: float
    coherence: float
    peak: float
    second_peak: float
    lines: tuple[LineDifference, ...]
    overlay_t_s: Floats
    optical_mm: Floats
    sensor_mm: Floats
    verdict: Verdict
    reason: str
    ambiguous: bool = False
    rival_offset_s: float = nan
    rival_turn_deg: float = nan

    @property
    def bias_mm(self) -> Floats:
        """(3,) mean of camera less sensor; NaN without an overlay."""
        return self._difference()[0]

    @property
    def limits_mm(self) -> Floats:
        """(3,) half width of the 95 % limits of agreement, 1.96 SD of camera less sensor.

        Single positions, axis by axis: Bland, Altman, Lancet 327 (1986) 307,
        doi 10.1016/S0140-6736(86)90837-8. Slow motion is out of both.
        """
        return np.asarray(1.96 * self._difference()[1])

    @property
    def limits_sigma_mm(self) -> Floats:
        """(3,) standard deviation of each limit, sqrt(3/N) SD (the same source)."""
        count = max(1, self.overlay_t_s.size)
        return np.asarray(np.sqrt(3.0 / count) * self._difference()[1])

    def _difference(self) -> tuple[Floats, Floats]:
        away = self.optical_mm - self.sensor_mm
        if len(away) < 2:
            return np.full(3, np.nan), np.full(3, np.nan)
        return np.asarray(away.mean(axis=0)), np.asarray(away.std(axis=0, ddof=1))

    def __post_init__(self) -> None:
        t_s = floats("overlay_t_s", self.overlay_t_s, (None,))
        object.__setattr__(self, "overlay_t_s", t_s)
        for name in ("optical_mm", "sensor_mm"):
            value = floats(name, getattr(self, name), (t_s.size, 3), nan=True)
            object.__setattr__(self, name, value)
        R = floats("R_camera_sensor", self.R_camera_sensor, (3, 3), nan=True)
        object.__setattr__(self, "R_camera_sensor", R)
