"""Displacement, velocity, acceleration; spectra, lines with their alias status, phases, decay."""

from olivevib.vibration.analysis import VibrationSettings, analyse
from olivevib.vibration.figures import Figures
from olivevib.vibration.line import LineSettings, dominant_line
from olivevib.vibration.motion import CandidateMotion, MarkerMotion, Vibration
from olivevib.vibration.phases import Phase, PhaseSettings, find_phases, find_sensor_phases
from olivevib.vibration.types import Line, LineStatus, Spectrum
from olivevib.vibration.verdict import SamplingFacts

__all__ = [
    "CandidateMotion",
    "Figures",
    "Line",
    "LineSettings",
    "LineStatus",
    "MarkerMotion",
    "Phase",
    "PhaseSettings",
    "SamplingFacts",
    "Spectrum",
    "Vibration",
    "VibrationSettings",
    "analyse",
    "dominant_line",
    "find_phases",
    "find_sensor_phases",
]
