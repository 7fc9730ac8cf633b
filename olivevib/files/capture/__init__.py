"""Cameras and recording: pictures are copied as the camera coded them, with every stamp kept."""

from olivevib.files.capture.beat import Beat
from olivevib.files.capture.camera import (
    RAW_LUMA,
    Camera,
    CameraFacts,
    Controls,
    Mode,
    Shot,
)
from olivevib.files.capture.door import open_camera
from olivevib.files.capture.listing import Listed, find_camera, list_cameras
from olivevib.files.capture.parts import join_parts
from olivevib.files.capture.recording import DiskFull, Recording
from olivevib.files.capture.runner import CameraRunner, RunnerState
from olivevib.files.capture.sidecar import SideCar, read_sidecar, sidecar_of
from olivevib.files.capture.verify import Verified, frame_list, verify

__all__ = [
    "RAW_LUMA",
    "Beat",
    "Camera",
    "CameraFacts",
    "CameraRunner",
    "Controls",
    "DiskFull",
    "Listed",
    "Mode",
    "Recording",
    "RunnerState",
    "Shot",
    "SideCar",
    "Verified",
    "find_camera",
    "frame_list",
    "join_parts",
    "list_cameras",
    "open_camera",
    "read_sidecar",
    "sidecar_of",
    "verify",
]
