"""One door for every camera: a name in, an open camera out."""

from __future__ import annotations

import functools
from contextlib import suppress
from pathlib import Path

from olivevib.errors import InputError, UsageError
from olivevib.files.capture.camera import Camera, Controls, Mode
from olivevib.files.capture.device import DeviceCamera
from olivevib.files.capture.http_stream import HttpCamera
from olivevib.files.capture.listing import Listed, find_camera
from olivevib.files.capture.pattern import PatternCamera
from olivevib.files.capture.pipe import PipeCamera
from olivevib.files.capture.replay import FileCamera, StillsCamera
from olivevib.files.capture.v4l2 import V4l2Device


def open_camera(name: str, mode: Mode, side: str) -> Camera:
    """Open the camera that ``name`` means and wait until it can deliver.

    name: a device (number, address or part of its title, see ``list_cameras``), http:// or https://
    of an MJPEG stream, a named pipe of JPEG pictures, and for rehearsal a recording, a folder of
    JPEG stills, or "pattern:". side chooses the stills where a folder holds those of both cameras.
    Raises UsageError for a name that means nothing, InputError for a camera that does not deliver.
    """
    if name.lower().startswith(("http://", "https://")):
        return HttpCamera(name, mode)
    if name.startswith("pattern:"):
        return PatternCamera(name, mode)
    path = Path(name)
    if path.is_dir():
        return StillsCamera(path, mode, side)
    if path.is_fifo():
        return PipeCamera(path, mode)
    if path.is_file():
        return FileCamera(path, mode)
    if "://" in name:
        raise UsageError(
            f"{name} is no address that can be recorded.",
            "Streams are taken as MJPEG over HTTP, whose pictures stand for themselves.",
            "Switch the camera to MJPEG and give its http:// address.",
        )
    listed = find_camera(name)
    camera = DeviceCamera(listed, mode, functools.partial(_controls, listed))
    if mode.exposure_us is not None and not _set_by_hand(listed, mode.exposure_us):
        camera.close()
        asked_ms = mode.exposure_us / 1000
        raise InputError(
            f"the camera {listed.title} does not take an exposure of {asked_ms:g} ms.",
            "Its driver has no such setting, or does not keep it.",
            "Set it with the camera's own program and leave --exposure out.",
        )
    return camera


def _set_by_hand(listed: Listed, exposure_us: float) -> bool:
    if listed.kind != "v4l2":
        return False
    try:
        with V4l2Device(listed.address) as device:
            return device.set_by_hand(exposure_us)
    except OSError:
        return False


def _controls(listed: Listed) -> Controls:
    """Exposure and gain now, from the driver; nothing where it does not tell."""
    if listed.kind == "v4l2":
        with suppress(OSError), V4l2Device(listed.address) as device:
            return device.controls()
    return Controls()
