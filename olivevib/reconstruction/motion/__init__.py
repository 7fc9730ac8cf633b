"""The continuous-time motion of markers, seen row by row, and its true frequency."""

from olivevib.reconstruction.motion.drawing import Pattern
from olivevib.reconstruction.motion.ends import steady_ends
from olivevib.reconstruction.motion.evaluate import uneven_words
from olivevib.reconstruction.motion.fit import fit_motion
from olivevib.reconstruction.motion.observe import observe
from olivevib.reconstruction.motion.ratio import FittedRatio, fitted_ratio
from olivevib.reconstruction.motion.sightings import MarkerSightings, Observations, Sightings
from olivevib.reconstruction.motion.types import (
    Anchor,
    BranchTable,
    MarkerMotion,
    Motion,
    MotionFit,
    MotionSettings,
    Timing,
)

__all__ = [
    "Anchor",
    "BranchTable",
    "FittedRatio",
    "MarkerMotion",
    "MarkerSightings",
    "Motion",
    "MotionFit",
    "MotionSettings",
    "Observations",
    "Pattern",
    "Sightings",
    "Timing",
    "fit_motion",
    "fitted_ratio",
    "observe",
    "steady_ends",
    "uneven_words",
]
