"""One grey image to Detections: the paper's markers and foreign families behind one door."""

from olivevib.detection.detection import Detection, Reader
from olivevib.detection.detector import Detector
from olivevib.detection.settings import DetectionSettings

__all__ = ["Detection", "DetectionSettings", "Detector", "Reader"]
