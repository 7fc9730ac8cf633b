"""Displacement, velocity, acceleration; spectra, lines with their alias status, phases, decay."""

from olivevib.vibration.types import Line, LineStatus, Spectrum

__all__ = ["Line", "LineStatus", "Spectrum"]
