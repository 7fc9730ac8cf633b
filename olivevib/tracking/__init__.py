"""Frames of one camera to tracks: following, re-initialisation, states."""

from olivevib.tracking.track import LOST_AFTER_S, FrameTimes, Track, assemble
from olivevib.tracking.tracker import Tracker

__all__ = ["LOST_AFTER_S", "FrameTimes", "Track", "Tracker", "assemble"]
