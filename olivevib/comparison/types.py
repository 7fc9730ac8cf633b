"""Optical against accelerometer: clocks, axes, gain, coherence."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

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

    def __post_init__(self) -> None:
        t_s = floats("overlay_t_s", self.overlay_t_s, (None,))
        object.__setattr__(self, "overlay_t_s", t_s)
        for name in ("optical_mm", "sensor_mm"):
            value = floats(name, getattr(self, name), (t_s.size, 3), nan=True)
            object.__setattr__(self, name, value)
        R = floats("R_camera_sensor", self.R_camera_sensor, (3, 3), nan=True)
        object.__setattr__(self, "R_camera_sensor", R)
