"""Rehearsal cameras: a recording or a folder of stills, played as if it were seen now."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

from olivevib.errors import InputError
from olivevib.files.capture.camera import CameraFacts, Controls, Mode, Shot
from olivevib.files.container import open_container, video_path
from olivevib.files.image_size import image_size
from olivevib.files.packets import Packets
from olivevib.files.stills import list_stills

STILLS_FPS = 30.0


class Pace:
    """Holds pictures back until their time has come; late ones go out at once."""

    def __init__(self, stop: threading.Event) -> None:
        self._stop = stop
        self._start_ns: int | None = None

    def wait(self, since_ns: int) -> bool:
        """Wait until ``since_ns`` after the first call; False where it was told to stop."""
        if self._start_ns is None:
            self._start_ns = time.monotonic_ns() - since_ns
        left_s = (self._start_ns + since_ns - time.monotonic_ns()) * 1e-9
        return not (self._stop.wait(left_s) if left_s > 0 else self._stop.is_set())


class FileCamera:
    """A recording played in real time; its coded pictures and stamps are handed on unchanged."""

    def __init__(self, path: Path, mode: Mode) -> None:
        """Open the recording; InputError for one that is not MJPEG or has no stamps."""
        self._path = video_path(path)
        self._container, self._stream = open_container(self._path)
        codec = self._stream.codec_context
        self._packets = Packets(self._path, self._container, self._stream)
        if codec.name != "mjpeg" or not self._packets.stamped:
            self._container.close()
            raise InputError(
                f"{path} cannot stand in for a camera.",
                "Only MJPEG recordings with time stamps can be handed on without changing them.",
                "Give the recording of a webcam, or simulated:demo, or pattern:",
            )
        rate = self._stream.average_rate
        self._facts = CameraFacts(
            name=str(path),
            title=self._path.name,
            serial="",
            kind="file",
            codec="mjpeg",
            pixel_format="",
            size_px=(codec.width, codec.height),
            fps=mode.fps or (float(rate) if rate else None),
            stamp_kind="file",
        )

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Every picture at its time; the walk ends with the recording."""
        pace = Pace(stop)
        first: int | None = None
        for packet, _ in self._packets:
            stamp = int(packet.pts * packet.time_base * 1_000_000_000)
            first = stamp if first is None else first
            if not pace.wait(stamp - first):
                return
            yield Shot(bytes(packet), stamp, time.monotonic_ns())

    def controls(self) -> Controls:
        """Nothing: a recording does not say."""
        return Controls()

    def close(self) -> None:
        """Close the file."""
        self._container.close()


class StillsCamera:
    """A folder of JPEG stills, shown one after another at an even rate."""

    def __init__(self, folder: Path, mode: Mode, side: str) -> None:
        """List the stills of this side; InputError where they are no JPEG pictures."""
        self._stills = list_stills(folder, side)
        self._fps = mode.fps or STILLS_FPS
        first = self._stills[0].read_bytes()
        size = image_size(first)
        if size is None or not first.startswith(b"\xff\xd8"):
            raise InputError(
                f"{self._stills[0]} is no JPEG picture.",
                "Stills stand in for a camera as they are, so they must be JPEG.",
                "Give JPEG stills, a recording, or pattern:",
            )
        self._facts = CameraFacts(
            *(str(folder), folder.name, "", "stills", "mjpeg", "", size, self._fps, "file")
        )

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Every still at its time; the walk ends after the last."""
        pace = Pace(stop)
        for number, still in enumerate(self._stills):
            since_ns = round(number * 1e9 / self._fps)
            if not pace.wait(since_ns):
                return
            yield Shot(still.read_bytes(), since_ns, time.monotonic_ns())

    def controls(self) -> Controls:
        """Nothing: stills do not say."""
        return Controls()

    def close(self) -> None:
        """Nothing to release."""
