"""Tracks of two cameras and a rig to 3-D trajectories on the trial clock."""

from olivevib.reconstruction.trajectory import ContinuousFit, Trajectory

__all__ = ["ContinuousFit", "Trajectory"]
