"""One grey image to Detections: the paper's markers and foreign families behind one door."""

from olivevib.detection.detection import Detection, Reader

__all__ = ["Detection", "Reader"]
