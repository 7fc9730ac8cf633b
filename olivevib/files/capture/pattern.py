"""A rehearsal camera that needs nothing: FFmpeg's moving test pattern as Motion JPEG."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import av
import cv2

from olivevib.errors import InputError
from olivevib.files.capture.camera import CameraFacts, Controls, Mode, Shot
from olivevib.files.capture.replay import Pace

SIZE, FPS, QUALITY = (1280, 720), 30.0, 80


class PatternCamera:
    """FFmpeg's ``testsrc2`` in real time, as Motion JPEG."""

    def __init__(self, name: str, mode: Mode) -> None:
        """Start the pattern; InputError where this build of FFmpeg has none."""
        size, fps = mode.size_px or SIZE, mode.fps or FPS
        source = f"testsrc2=size={size[0]}x{size[1]}:rate={fps:g}"
        try:
            self._container = av.open(source, format="lavfi")
        except (av.error.FFmpegError, ValueError) as error:
            raise InputError(
                "there is no test pattern in this build of FFmpeg.",
                str(error),
                "Rehearse with a recording or with simulated:demo.",
            ) from error
        self._facts = CameraFacts(
            name, "test pattern", "", "pattern", "mjpeg", "", size, fps, "simulated"
        )

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Pictures at an even rate, without end."""
        pace = Pace(stop)
        fps = self._facts.fps or FPS
        for number, picture in enumerate(self._container.decode(video=0)):
            since_ns = round(number * 1e9 / fps)
            image = picture.to_ndarray(format="bgr24")
            _, coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
            if not pace.wait(since_ns):
                return
            yield Shot(coded.tobytes(), since_ns, time.monotonic_ns())

    def controls(self) -> Controls:
        """Nothing: a pattern has no exposure."""
        return Controls()

    def close(self) -> None:
        """Stop the pattern."""
        self._container.close()
