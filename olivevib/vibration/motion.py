"""What is known of each marker's motion in each phase."""

from __future__ import annotations

from dataclasses import dataclass

from olivevib.arrays import Floats, floats
from olivevib.vibration.figures import Figures
from olivevib.vibration.types import Line


@dataclass(frozen=True)
class CandidateMotion:
    """What one candidate frequency would mean: peak amplitudes (3,) and total RMS."""

    f_hz: float
    displacement_mm: Floats
    velocity_mm_s: Floats
    acceleration_m_s2: Floats
    acceleration_rms_m_s2: float

    def __post_init__(self) -> None:
        for name in ("displacement_mm", "velocity_mm_s", "acceleration_m_s2"):
            object.__setattr__(self, name, floats(name, getattr(self, name), (3,), nan=True))


@dataclass(frozen=True)
class MarkerMotion:
    """One marker in one phase: line with its status, figures of the three quantities.

    velocity and acceleration are NaN where the true frequency is not known; then ``candidates``
    says what each would mean. samples: how many went in.
    """

    id: int
    phase: str
    start_s: float
    end_s: float
    samples: int
    line: Line
    displacement: Figures
    velocity: Figures
    acceleration: Figures
    candidates: tuple[CandidateMotion, ...] = ()

    @property
    def acceleration_rms_m_s2(self) -> float:
        """Total RMS of the acceleration (three axes); NaN where it is not known."""
        return self.acceleration.resultant_rms

    @property
    def displacement_pp_mm(self) -> float:
        """Peak-to-peak displacement along the direction of largest motion."""
        return self.displacement.extent

    @property
    def displacement_pp_sigma_mm(self) -> float:
        """Its standard deviation from the noise of two single samples (an upper bound)."""
        return self.displacement.extent_sigma
