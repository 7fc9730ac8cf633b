"""One grey image to Detections: the paper's markers and foreign families behind one door."""

from olivevib.detection.bend import Wrapped
from olivevib.detection.blur import Blur
from olivevib.detection.detection import Detection, Reader
from olivevib.detection.detector import Detector
from olivevib.detection.follow import Known
from olivevib.detection.settings import DetectionSettings

__all__ = ["Blur", "Detection", "DetectionSettings", "Detector", "Known", "Reader", "Wrapped"]
