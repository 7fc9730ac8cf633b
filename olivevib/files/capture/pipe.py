"""A camera program that writes JPEG pictures into a named pipe, one after another."""

from __future__ import annotations

import os
import select
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from olivevib.errors import InputError
from olivevib.files.capture.camera import POLL_S, CameraFacts, Controls, Mode, Shot
from olivevib.files.capture.jpeg import JpegSplitter
from olivevib.files.image_size import image_size

OPEN_S = 10.0
CHUNK = 262_144


class PipeCamera:
    """Motion JPEG out of a named pipe (mkfifo), such as libcamera-vid or gphoto2 write it."""

    def __init__(self, path: Path, mode: Mode) -> None:
        """Wait for the first picture; InputError where no program writes one."""
        self._path = path
        self._handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        self._splitter = JpegSplitter()
        self._ready: list[Shot] = []
        self._begun = False
        try:
            size = self._first_size()
        except (OSError, InputError):
            os.close(self._handle)
            raise
        self._facts = CameraFacts(
            str(path), path.name, "", "pipe", "mjpeg", "", size, mode.fps, "host"
        )

    @property
    def facts(self) -> CameraFacts:
        """What is known of it."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Pictures as they come; OSError when the writing program ends."""
        while not stop.is_set():
            self._read()
            while self._ready:
                yield self._ready.pop(0)

    def controls(self) -> Controls:
        """Nothing: a pipe says nothing of exposure."""
        return Controls()

    def close(self) -> None:
        """Close the pipe."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    def _first_size(self) -> tuple[int, int]:
        deadline = time.monotonic() + OPEN_S
        while not self._ready:
            if time.monotonic() > deadline:
                raise InputError(
                    f"no picture came out of the pipe {self._path}.",
                    "No program writes to it, or what it writes is no Motion JPEG.",
                    "Start the camera program first; it must write JPEG pictures.",
                )
            self._read()
        size = image_size(self._ready[0].data)
        if size is None:
            raise InputError(f"the pipe {self._path} holds no JPEG pictures.", "", "")
        return size

    def _read(self) -> None:
        ready, _, _ = select.select([self._handle], [], [], POLL_S)
        data = os.read(self._handle, CHUNK) if ready else b""
        if data:
            self._begun = True
            arrived = time.monotonic_ns()
            self._ready += [Shot(jpeg, None, arrived) for jpeg in self._splitter.feed(data)]
        elif ready and self._begun:
            raise ConnectionAbortedError("the program that writes the pipe has ended")
        elif ready:
            time.sleep(POLL_S / 10)  # nobody has opened the other end yet
