"""Pictures to files as a webcam leaves them: MJPEG with exact stamps, stills, a logger's text."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av
import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.errors import InputError

MICROSECOND = Fraction(1, 1_000_000)


def jpeg(grey: Grey, quality: int) -> bytes:
    """The picture as a camera compresses it: baseline JPEG, grey."""
    done, data = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise InputError("a simulated picture could not be compressed")
    return data.tobytes()


class MjpegWriter:
    """Writes JPEG pictures into a container with their stamps in whole microseconds.

    NUT (``.nut``) keeps every microsecond; Matroska would round to milliseconds.
    """

    def __init__(self, path: Path, size_px: tuple[int, int], fps: float) -> None:
        self._container = av.open(str(path), "w", options={"fflags": "+bitexact"})
        rate = Fraction(fps).limit_denominator(100_000)
        self._stream = self._container.add_stream("mjpeg", rate=rate)
        self._stream.width, self._stream.height = size_px
        self._stream.pix_fmt = "yuvj420p"
        self._stream.time_base = MICROSECOND

    def __enter__(self) -> MjpegWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._container.close()

    def write(self, picture: bytes, stamp_us: int) -> None:
        """Append one compressed picture."""
        packet = av.Packet(picture)
        packet.stream = self._stream
        packet.time_base = MICROSECOND
        packet.pts = packet.dts = stamp_us
        packet.is_keyframe = True
        self._container.mux(packet)


def write_still(path: Path, grey: Grey, quality: int) -> None:
    """One still, by the suffix of its name: ``.png`` without loss, ``.jpg`` with ``quality``."""
    if path.suffix == ".jpg":
        path.write_bytes(jpeg(grey, quality))
        return
    done, data = cv2.imencode(".png", grey)
    if not done:
        raise InputError(f"{path} could not be written as a picture")
    path.write_bytes(data.tobytes())


def write_logger_csv(path: Path, stamp_s: Floats, force_g: Floats) -> None:
    """Accelerometer samples (N, 3) in g as a logger writes them, stamps by its own clock."""
    rows = np.column_stack([stamp_s, force_g])
    lines = ["Time (s),X (g),Y (g),Z (g)"]
    lines += [f"{t:.6f},{x:.5f},{y:.5f},{z:.5f}" for t, x, y, z in rows]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
