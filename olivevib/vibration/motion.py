"""What is known of each marker's motion in each phase, and of a whole trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from olivevib.arrays import Floats, floats
from olivevib.errors import Caution
from olivevib.vibration.figures import Figures
from olivevib.vibration.phases import Phase
from olivevib.vibration.types import Line, Spectrum


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


@dataclass(frozen=True)
class Vibration:
    """The analysis of a trial: phases, spectra by quantity, one row a marker and phase.

    The spectra and headline lines are those of ``spectrum_phase`` ("steady", or "whole").
    """

    phases: tuple[Phase, ...]
    spectra: Mapping[str, Spectrum]
    table: tuple[MarkerMotion, ...]
    spectrum_phase: str
    cautions: tuple[Caution, ...] = ()

    def row(self, marker_id: int, phase: str | None = None) -> MarkerMotion | None:
        """The row of a marker in a phase (the spectrum's where none is named), or None."""
        wanted = self.spectrum_phase if phase is None else phase
        rows = [r for r in self.table if r.id == marker_id and r.phase == wanted]
        return rows[0] if rows else None
