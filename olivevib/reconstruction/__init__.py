"""Tracks of two cameras and a rig to 3-D trajectories on the trial clock."""

from olivevib.reconstruction.clock import TrialClock
from olivevib.reconstruction.reconstruct import (
    Reconstruction,
    ReconstructionSettings,
    reconstruct,
)
from olivevib.reconstruction.trajectory import ContinuousFit, Trajectory
from olivevib.reconstruction.trial_offset import clock_from_motion
from olivevib.reconstruction.triangulation import linear_eigen, triangulate

__all__ = [
    "ContinuousFit",
    "Reconstruction",
    "ReconstructionSettings",
    "Trajectory",
    "TrialClock",
    "clock_from_motion",
    "linear_eigen",
    "reconstruct",
    "triangulate",
]
