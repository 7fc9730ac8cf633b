"""Displacement, velocity, acceleration; spectra, lines with their alias status, phases, decay."""

from olivevib.vibration.analysis import VibrationSettings, analyse
from olivevib.vibration.body import Attitude, Turning, point_motion, relative_motion
from olivevib.vibration.figures import Figures
from olivevib.vibration.fixed import without_camera_motion
from olivevib.vibration.kinematics import to_displacement
from olivevib.vibration.line import LineSettings, dominant_line
from olivevib.vibration.modal import Decay, fit_decay
from olivevib.vibration.motion import CandidateMotion, MarkerMotion
from olivevib.vibration.orbit import Orbit, Precession, largest, orbit, precession
from olivevib.vibration.phases import Phase, PhaseSettings, find_phases, find_sensor_phases
from olivevib.vibration.response import MarkerResponse, marker_response
from olivevib.vibration.result import Vibration
from olivevib.vibration.ridge import Ridge, camera_ridge, sensor_ridge
from olivevib.vibration.sensor import SensorAnalysis, analyse_sensor
from olivevib.vibration.survey import (
    MarkerSurvey,
    NamedMotion,
    Survey,
    Transmission,
    survey,
)
from olivevib.vibration.transfer import (
    Deflection,
    LineRatio,
    Response,
    deflection_shape,
    frequency_response,
    line_ratio,
)
from olivevib.vibration.types import Line, LineStatus, Spectrum
from olivevib.vibration.verdict import SamplingFacts

__all__ = [
    "Attitude",
    "CandidateMotion",
    "Decay",
    "Deflection",
    "Figures",
    "Line",
    "LineRatio",
    "LineSettings",
    "LineStatus",
    "MarkerMotion",
    "MarkerResponse",
    "MarkerSurvey",
    "NamedMotion",
    "Orbit",
    "Phase",
    "PhaseSettings",
    "Precession",
    "Response",
    "Ridge",
    "SamplingFacts",
    "SensorAnalysis",
    "Spectrum",
    "Survey",
    "Transmission",
    "Turning",
    "Vibration",
    "VibrationSettings",
    "analyse",
    "analyse_sensor",
    "camera_ridge",
    "deflection_shape",
    "dominant_line",
    "find_phases",
    "find_sensor_phases",
    "fit_decay",
    "frequency_response",
    "largest",
    "line_ratio",
    "marker_response",
    "orbit",
    "point_motion",
    "precession",
    "relative_motion",
    "sensor_ridge",
    "survey",
    "to_displacement",
    "without_camera_motion",
]
