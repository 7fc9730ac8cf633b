"""One camera's recording on disk: coded pictures copied into NUT, a line a frame in the side-car.

A frame is on its way to the disk, whole, before the next one is taken from the camera: a killed
program loses at most the frame in flight, and what was written opens without repair.
"""

from __future__ import annotations

import contextlib
import errno
import os
import zlib
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
from av.container import OutputContainer
from av.video.stream import VideoStream

from olivevib.errors import InputError, UsageError
from olivevib.files.capture.camera import CameraFacts, Controls, Shot
from olivevib.files.capture.sidecar import HEADER, Line, sidecar_of

MICROSECOND = Fraction(1, 1_000_000)
BUFFER = 1_048_576  # what the muxer may hold of one packet
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class DiskFull(InputError):
    """The disk took no more; everything acknowledged before is safe."""


class _Heap:
    """What the muxer writes of one packet, so that it goes to the disk in one piece."""

    def __init__(self) -> None:
        self.content = bytearray()

    def write(self, data: bytes) -> int:
        self.content += data
        return len(data)

    def take(self) -> bytes:
        out = bytes(self.content)
        self.content.clear()
        return out


class _Appending:
    """A new file that only grows by whole pieces; what did not fit is taken back."""

    def __init__(self, path: Path) -> None:
        flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0)
        self.path = path
        self.size = 0
        self._handle = os.open(path, flags, 0o644)

    def append(self, data: bytes) -> None:
        """Write all of it or nothing; OSError."""
        at = 0
        try:
            while at < len(data):
                at += os.write(self._handle, memoryview(data)[at:])
        except OSError:
            self.cut(self.size)
            raise
        self.size += len(data)

    def cut(self, size: int) -> None:
        """Go back to an earlier size."""
        with contextlib.suppress(OSError):
            os.ftruncate(self._handle, size)
            os.lseek(self._handle, size, os.SEEK_SET)
        self.size = size

    def sync(self) -> None:
        """Make what was appended safe from a power cut too."""
        os.fsync(self._handle)

    def close(self) -> None:
        os.close(self._handle)


class Recording:
    """Writes the shots of one camera; ``frames`` counts those acknowledged.

    Times are microseconds after ``origin_ns`` of the computer's monotonic clock, which both cameras
    share. Not thread-safe; only ``sync`` may be called from another thread meanwhile.
    """

    def __init__(self, video: Path, facts: CameraFacts, origin_ns: int) -> None:
        """Make the two new files; UsageError where one is there already, InputError otherwise."""
        self.video = video
        self.frames = 0
        self.closed = False
        self._origin_ns = origin_ns
        self._facts = facts
        self._last_us = -1
        self._heap = _Heap()
        with contextlib.ExitStack() as undo:
            self._lines = _create(sidecar_of(video), undo)
            self._pictures = _create(video, undo)
            self._write(self._lines, HEADER)
            undo.pop_all()
        self._container, self._stream = _muxer(self._heap, facts)

    @property
    def size_bytes(self) -> int:
        """How much both files hold."""
        return self._pictures.size + self._lines.size

    def append(self, shot: Shot, placed_ns: int, controls: Controls) -> None:
        """Write one frame; when this returns it is acknowledged.

        placed_ns: when it was taken (``StampClock.place``). A frame from before the origin is left
        out. Raises DiskFull, or InputError for another fault of the disk; the frame is then taken
        back and both files end with the one before.
        """
        stamp_us = (placed_ns - self._origin_ns + 500) // 1000
        if stamp_us < 0:
            return
        stamp_us = max(stamp_us, self._last_us + 1)
        packet = av.Packet(shot.data)
        packet.stream = self._stream
        packet.time_base = MICROSECOND
        packet.pts = packet.dts = stamp_us
        packet.is_keyframe = True
        self._container.mux(packet)
        before = self._lines.size
        self._write(self._lines, self._line(shot, stamp_us, controls).encode())
        try:
            self._write(self._pictures, self._heap.take())
        except InputError:
            self._lines.cut(before)
            raise
        self._last_us = stamp_us
        self.frames += 1

    def sync(self) -> None:
        """Make everything acknowledged safe from a power cut; called at most once a second."""
        if not self.closed:
            with contextlib.suppress(OSError):  # a disk that cannot sync fails at the next write
                self._pictures.sync()
                self._lines.sync()

    def close(self) -> None:
        """End the file with its index; where the disk is full it stays without, readable.

        A recording without a frame is removed.
        """
        if self.closed:
            return
        self.closed = True
        self._container.close()
        if self.frames:
            with contextlib.suppress(OSError):
                self._pictures.append(self._heap.take())
        for file in (self._pictures, self._lines):
            with contextlib.suppress(OSError):
                file.sync()
            file.close()
            if not self.frames:
                file.path.unlink(missing_ok=True)

    def _line(self, shot: Shot, stamp_us: int, controls: Controls) -> Line:
        kind = "host" if shot.device_ns is None else self._facts.stamp_kind
        return Line(
            sequence=self.frames,
            stamp_us=stamp_us,
            stamp_kind=kind,
            device_ns=shot.device_ns,
            host_ns=shot.host_ns,
            size=len(shot.data),
            crc32=zlib.crc32(shot.data),
            exposure_us=controls.exposure_us,
            gain=controls.gain,
        )

    def _write(self, file: _Appending, data: bytes) -> None:
        try:
            file.append(data)
        except OSError as error:
            raise _as_error(error, file.path, self.frames) from error


def _create(path: Path, undo: contextlib.ExitStack) -> _Appending:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = _Appending(path)
    except FileExistsError as error:
        raise UsageError(
            f"{path} is there already.",
            "A recording never overwrites another.",
            "Choose another trial name, or move the old recording away yourself.",
        ) from error
    except OSError as error:
        raise _as_error(error, path, 0) from error
    undo.callback(path.unlink, missing_ok=True)
    undo.callback(file.close)
    return file


def _muxer(heap: _Heap, facts: CameraFacts) -> tuple[OutputContainer, VideoStream]:
    options = {"flush_packets": "1", "fflags": "+bitexact"}
    container = av.open(heap, "w", format="nut", options=options, buffer_size=BUFFER)
    rate = Fraction(facts.fps or 30).limit_denominator(100_000)
    stream = cast(VideoStream, container.add_stream(facts.codec, rate=rate))
    stream.width, stream.height = facts.size_px
    stream.pix_fmt = facts.pixel_format or "yuvj420p"
    stream.time_base = MICROSECOND
    return container, stream


def _as_error(error: OSError, path: Path, frames: int) -> InputError:
    if error.errno in FULL:
        return DiskFull(
            f"the disk is full: {path.name} ends after {frames} frames.",
            "Everything up to there is safe and can be used.",
            "Free some space, or record on another disk.",
        )
    return InputError(
        f"{path} could not be written.",
        error.strerror or str(error),
        "Check the folder, its rights and the disk.",
    )
