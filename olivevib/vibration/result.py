"""What the analysis of a whole trial found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from olivevib.errors import Caution
from olivevib.vibration.motion import MarkerMotion
from olivevib.vibration.phases import Phase
from olivevib.vibration.survey import Survey
from olivevib.vibration.types import Spectrum


@dataclass(frozen=True)
class Vibration:
    """The analysis of a trial: phases, spectra by quantity, one row a marker and phase.

    The spectra and headline lines are those of ``spectrum_phase`` ("steady", or "whole"), and so is
    the survey: orbits, rotation, decay, transmissibility, deflection shape.
    """

    phases: tuple[Phase, ...]
    spectra: Mapping[str, Spectrum]
    table: tuple[MarkerMotion, ...]
    spectrum_phase: str
    cautions: tuple[Caution, ...] = ()
    survey: Survey | None = None

    def row(self, marker_id: int, phase: str | None = None) -> MarkerMotion | None:
        """The row of a marker in a phase (the spectrum's where none is named), or None."""
        wanted = self.spectrum_phase if phase is None else phase
        rows = [r for r in self.table if r.id == marker_id and r.phase == wanted]
        return rows[0] if rows else None
