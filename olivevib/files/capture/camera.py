"""What every camera hands over, whatever it is: coded pictures, each with its stamps."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

POLL_S = 0.2  # a camera that waits looks this often whether it shall stop

RAW_LUMA = {  # raw pixel formats: first luma byte, bytes from one luma byte to the next
    "yuyv422": (0, 2),
    "yvyu422": (0, 2),
    "uyvy422": (1, 2),
    "nv12": (0, 1),
    "nv21": (0, 1),
    "yuv420p": (0, 1),
    "yuv422p": (0, 1),
    "gray": (0, 1),
}


class Shot(NamedTuple):
    """One picture as the camera coded it; these bytes are recorded as they are.

    device_ns: the camera's own stamp on a clock of its own, None if it has none; host_ns: this
    computer's monotonic clock when the picture began to arrive.
    """

    data: bytes
    device_ns: int | None
    host_ns: int


class Controls(NamedTuple):
    """What the driver says of a camera now; None where it does not tell."""

    exposure_us: float | None = None
    gain: float | None = None


@dataclass(frozen=True)
class Mode:
    """What a camera is asked for; None: what it does by itself.

    exposure_us: set by hand, with the focus held and the frame rate not lowered in the dark; only
    where the driver can (v4l2).
    """

    size_px: tuple[int, int] | None = None
    fps: float | None = None
    exposure_us: float | None = None


@dataclass(frozen=True)
class CameraFacts:
    """What is known of an open camera.

    name: as it was asked for; title and serial: what the device says of itself ("" if nothing);
    kind: v4l2, dshow, avfoundation, http, pipe, file, stills, pattern or simulated; codec: "mjpeg"
    or "rawvideo" in ``pixel_format``; fps: what it promises, None if nothing; stamp_kind: what the
    device stamps are (kernel, sample, header, file, simulated), "host" where there are none.
    """

    name: str
    title: str
    serial: str
    kind: str
    codec: str
    pixel_format: str
    size_px: tuple[int, int]
    fps: float | None
    stamp_kind: str


class Camera(Protocol):
    """One open camera. One thread walks ``shots``; any thread may ask ``controls``."""

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        ...

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Pictures as they come, until ``stop`` is set or the camera ends.

        A recording that has been played ends the walk; a camera that vanishes raises OSError.
        """
        ...

    def controls(self) -> Controls:
        """Exposure and gain as the driver tells them now."""
        ...

    def close(self) -> None:
        """Release the device; called by the thread that walked ``shots``."""
        ...
