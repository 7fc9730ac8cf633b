"""Figures of the reports: each a pure function from frozen values to an SVG string."""

from __future__ import annotations

from olivevib.report.figures.boxes import boxes
from olivevib.report.figures.canvas import style
from olivevib.report.figures.decays import decays
from olivevib.report.figures.distances import Distance, distances, pair_distances
from olivevib.report.figures.frequency import frequencies
from olivevib.report.figures.line_response import at_lines, line_responses
from olivevib.report.figures.motion import Window, close_window, time_series, whole
from olivevib.report.figures.orbits import MOST_ACROSS, orbit_reach_mm, orbits
from olivevib.report.figures.residuals import holdout, residual_map
from olivevib.report.figures.scene import scene
from olivevib.report.figures.sensor import overlay
from olivevib.report.figures.sigma import sigmas
from olivevib.report.figures.sigma_map import SigmaMap, sigma_map, sigma_maps
from olivevib.report.figures.spectra import (
    Band,
    amplitude_spectra,
    power_spectra,
    total_spectra,
)
from olivevib.report.figures.spectrogram import Spectrogram, spectrogram, spectrograms
from olivevib.report.figures.together import (
    deflection,
    responses,
    rotations,
    shown_responses,
    turns_of,
)
from olivevib.report.figures.transmissibility import transmissibilities
from olivevib.report.figures.visibility import strips, visibility

__all__ = [
    "MOST_ACROSS",
    "Band",
    "Distance",
    "SigmaMap",
    "Spectrogram",
    "Window",
    "amplitude_spectra",
    "at_lines",
    "boxes",
    "close_window",
    "decays",
    "deflection",
    "distances",
    "frequencies",
    "holdout",
    "line_responses",
    "orbit_reach_mm",
    "orbits",
    "overlay",
    "pair_distances",
    "power_spectra",
    "residual_map",
    "responses",
    "rotations",
    "scene",
    "shown_responses",
    "sigma_map",
    "sigma_maps",
    "sigmas",
    "spectrogram",
    "spectrograms",
    "strips",
    "style",
    "time_series",
    "total_spectra",
    "transmissibilities",
    "turns_of",
    "visibility",
    "whole",
]
