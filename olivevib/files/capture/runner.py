"""The thread of one camera: takes its pictures, records them, and closes when it goes away."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import av

from olivevib.errors import InputError, OlivevibError
from olivevib.files.capture.camera import Camera, CameraFacts, Controls, Shot
from olivevib.files.capture.clock import StampClock
from olivevib.files.capture.parts import part_path
from olivevib.files.capture.recording import Recording

JOIN_S = 2.0
RETRY_S = 0.5
RECENT = 30


@dataclass(frozen=True)
class RunnerState:
    """One camera as it is now.

    frames, size_bytes: recorded so far; gone: why no picture comes at present ("" while they do);
    ended: why it is over for good ("" while it is not); losses: how often it went away; latest: the
    last picture with its time on the computer's clock, ns.
    """

    frames: int
    size_bytes: int
    gone: str
    ended: str
    losses: int
    latest: tuple[Shot, int] | None


class CameraRunner:
    """One camera in a thread of its own, from ``start`` to ``finish``.

    Pictures are taken from the start, recorded from ``record``. When the camera vanishes its file
    is closed at once; if it comes back (``reopen``) the recording goes on in a part of its own,
    left-2.nut. Nothing of this touches the other camera.
    """

    def __init__(
        self, side: str, camera: Camera, reopen: Callable[[], Camera] | None = None
    ) -> None:
        self.side = side
        self.facts: CameraFacts = camera.facts
        self.error: OlivevibError | None = None
        self.failure: BaseException | None = None
        self.controls = Controls()
        self.parts: list[Path] = []
        self.stamps_s: list[float] = []  # of the recorded frames, after the origin; only appended
        self.recent_ns: deque[int] = deque(maxlen=RECENT)  # of the last pictures, recorded or not
        self.gone_ns = 0  # when it last went away and its file was closed
        self._camera = camera
        self._reopen = reopen
        self._clock = StampClock()
        self._stop = threading.Event()
        self._lock = threading.Lock()  # around the recording: the supervisor may close it too
        self._recording: Recording | None = None
        self._video: Path | None = None
        self._origin_ns = 0
        self._written = (0, 0)  # frames and bytes of closed parts
        self._latest: tuple[Shot, int] | None = None
        self._gone = ""
        self._ended = ""
        self._losses = 0
        self._thread = threading.Thread(target=self._run, name=f"{side} camera", daemon=True)

    def start(self) -> None:
        """Begin to take pictures."""
        self._thread.start()

    def record(self, video: Path, origin_ns: int) -> None:
        """Begin to record every picture that is taken after ``origin_ns``; raises as Recording."""
        with self._lock:
            self._video, self._origin_ns = video, origin_ns
            self._begin_part()

    def state(self) -> RunnerState:
        """How it goes."""
        recording = self._recording
        frames, size = self._written
        if recording is not None and not recording.closed:
            frames, size = frames + recording.frames, size + recording.size_bytes
        return RunnerState(frames, size, self._gone, self._ended, self._losses, self._latest)

    def ask_controls(self) -> None:
        """Ask the driver for exposure and gain; they go into the lines from now on."""
        if not self._ended and not self._gone:
            self.controls = self._camera.controls()

    def sync(self) -> None:
        """Make what is recorded safe from a power cut."""
        recording = self._recording
        if recording is not None:
            recording.sync()

    def silent(self, why: str) -> None:
        """Close the file of a camera that delivers nothing, from another thread."""
        self._lose(why)

    def finish(self) -> None:
        """Stop, close the files and wait for the thread; a camera that hangs is left behind."""
        self._stop.set()
        self._thread.join(JOIN_S)
        self._end("stopped")

    def _run(self) -> None:
        try:
            while self._walk() and self._come_back():
                continue
            self._end("stopped" if self._stop.is_set() else self._gone or "the recording ended")
        except InputError as error:
            self.error = error
            self._end(error.what)
        except BaseException as error:  # handed to the supervisor, which raises it
            self.failure = error
            self._end(f"{type(error).__name__}: {error}")
        finally:
            self._camera.close()

    def _walk(self) -> bool:
        """Take pictures until the camera ends (False) or vanishes (True)."""
        try:
            for shot in self._camera.shots(self._stop):
                self._take(shot)
        except (OSError, av.error.FFmpegError) as error:
            self._lose(str(error).split("] ")[-1] or type(error).__name__)
            return not self._stop.is_set()
        return False

    def _come_back(self) -> bool:
        """Open a camera that vanished anew, again and again; False where nobody wants it any more.

        What comes back must deliver pictures as before: a recording holds one size only.
        """
        if self._reopen is None:
            return False
        self._camera.close()
        while not self._stop.wait(RETRY_S):
            with suppress(OlivevibError, OSError):
                camera = self._reopen()
                if camera.facts.size_px == self.facts.size_px:
                    self._camera, self._clock = camera, StampClock()
                    return True
                camera.close()
        return False

    def _take(self, shot: Shot) -> None:
        placed = self._clock.place(shot)
        with self._lock:
            recording = self._recording
            if recording is not None and recording.closed and not self._ended:
                recording = self._begin_part()
            self._gone = ""
            if recording is not None and not recording.closed:
                before = recording.frames
                recording.append(shot, placed, self.controls)
                if recording.frames > before:
                    self.stamps_s.append((placed - self._origin_ns) * 1e-9)
        self.recent_ns.append(placed)
        self._latest = (shot, placed)

    def _begin_part(self) -> Recording:
        assert self._video is not None
        path = part_path(self._video, len(self.parts) + 1)
        self._recording = Recording(path, self.facts, self._origin_ns)
        self.parts.append(path)
        return self._recording

    def _lose(self, why: str) -> None:
        with self._lock:
            if not self._gone and not self._ended:
                self._close_part()
                self._gone, self._losses = why, self._losses + 1
                self.gone_ns = time.monotonic_ns()

    def _end(self, why: str) -> None:
        with self._lock:
            self._close_part()
            self._ended = self._ended or why

    def _close_part(self) -> None:
        recording = self._recording
        if recording is None or recording.closed:
            return
        recording.close()
        frames, size = self._written
        self._written = (frames + recording.frames, size + recording.size_bytes)
        if not recording.frames:
            self.parts.remove(recording.video)
