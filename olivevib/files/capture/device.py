"""A camera at this computer: v4l2 (Linux), dshow (Windows), avfoundation (macOS), through PyAV."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import av

from olivevib.errors import InputError
from olivevib.files.capture.camera import RAW_LUMA, CameraFacts, Controls, Mode, Shot
from olivevib.files.capture.listing import Listed

STAMP_KINDS = {"v4l2": "kernel", "dshow": "sample", "avfoundation": "sample"}
_BUSY_S = 0.001


class DeviceCamera:
    """One camera device; compressed pictures where it has them, raw ones otherwise."""

    def __init__(self, listed: Listed, mode: Mode, controls: Callable[[], Controls]) -> None:
        """Open the device in the asked mode; InputError with the remedy where that fails."""
        self._controls = controls
        self._container = _open(listed, mode)
        try:
            self._stream = self._container.streams.video[0]
            self._facts = _facts(listed, mode, self._stream)
        except (InputError, IndexError):
            self._container.close()
            raise

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Pictures as they come; OSError where the camera is unplugged."""
        packets = self._container.demux(self._stream)
        while not stop.is_set():
            try:
                packet = next(packets, None)
            except av.error.BlockingIOError:  # avfoundation: nothing there yet
                time.sleep(_BUSY_S)
                packets = self._container.demux(self._stream)
                continue
            arrived = time.monotonic_ns()
            if packet is None or (not packet.size and packet.pts is None):
                raise ConnectionAbortedError("the camera delivers no more pictures")
            if packet.size:
                yield Shot(bytes(packet), _stamp_ns(packet), arrived)

    def controls(self) -> Controls:
        """Exposure and gain as the driver tells them now."""
        return self._controls()

    def close(self) -> None:
        """Release the device."""
        self._container.close()


def _stamp_ns(packet: Any) -> int | None:
    if packet.pts is None or packet.time_base is None:
        return None
    return int(packet.pts * packet.time_base * 1_000_000_000)


def open_options(kind: str, mode: Mode) -> dict[str, str]:
    """What FFmpeg is told for a device of this kind."""
    options: dict[str, str] = {}
    if mode.size_px is not None:
        options["video_size"] = f"{mode.size_px[0]}x{mode.size_px[1]}"
    if mode.fps is not None:
        options["framerate"] = f"{mode.fps:g}"
    if kind == "v4l2":
        options |= {"input_format": "mjpeg", "timestamps": "default"}
    if kind == "dshow":
        options |= {"rtbufsize": "256M"}
    return options


def _open(listed: Listed, mode: Mode) -> Any:
    options = open_options(listed.kind, mode)
    raw = {key: value for key, value in options.items() if key != "input_format"}
    tries = [options, raw] if raw != options else [options]
    for number, wanted in enumerate(tries):
        try:
            return av.open(listed.address, format=listed.kind, container_options=wanted)
        except (av.error.FFmpegError, ValueError, OSError) as error:
            if number == len(tries) - 1:
                raise _cannot_open(listed, mode, error) from error
    raise AssertionError("unreachable")


def _facts(listed: Listed, mode: Mode, stream: Any) -> CameraFacts:
    codec = stream.codec_context
    pixel_format = codec.pix_fmt or ""
    known = codec.name == "mjpeg" or (codec.name == "rawvideo" and pixel_format in RAW_LUMA)
    if not known:
        raise InputError(
            f"the camera {listed.title} delivers {codec.name} ({pixel_format or 'unknown'}).",
            "Recorded are MJPEG or raw pictures, of which each stands for itself.",
            "Choose another mode with --size and --fps; olivevib doctor lists them.",
        )
    rate = stream.average_rate
    return CameraFacts(
        name=listed.address,
        title=listed.title,
        serial=listed.serial,
        kind=listed.kind,
        codec=codec.name,
        pixel_format="" if codec.name == "mjpeg" else pixel_format,
        size_px=(codec.width, codec.height),
        fps=float(rate) if rate else mode.fps,
        stamp_kind=STAMP_KINDS[listed.kind],
    )


def _cannot_open(listed: Listed, mode: Mode, error: Exception) -> InputError:
    size = "its own size" if mode.size_px is None else "{} x {}".format(*mode.size_px)
    rate = "" if mode.fps is None else f" at {mode.fps:g} frames/s"
    return InputError(
        f"the camera {listed.title} ({listed.address}) does not open with {size}{rate}.",
        str(error).split("] ")[-1],
        "Close other programs that use it, and choose a mode that olivevib doctor lists.",
    )
