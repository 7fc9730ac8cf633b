"""What the cameras at this computer can do: modes, true frame rate, manual settings that hold."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import av
import numpy as np

from olivevib.errors import OlivevibError
from olivevib.files.capture import Camera, Listed, Mode, list_cameras, open_camera
from olivevib.files.capture.v4l2 import CameraMode, V4l2Device

MEASURE_S = 1.5
SETTLE = 5  # first pictures, which a camera often delivers late
MOST_MODES = 8
PATIENCE_S = 8.0


@dataclass(frozen=True)
class CameraReport:
    """One camera: what it offers and what it did for a second in its own mode.

    fps: measured, NaN where it delivered nothing; rate_bytes_s: what that fills; exposure_holds,
    focus_holds: whether a manual setting is kept, None where the driver has none or does not tell.
    """

    listed: Listed
    fps: float
    rate_bytes_s: float
    exposure_holds: bool | None
    focus_holds: bool | None
    fault: str = ""

    @property
    def words(self) -> str:
        """For a person."""
        serial = f" ({self.listed.serial})" if self.listed.serial else ""
        parts = [f"{self.listed.title}{serial}"]
        parts.append(self.fault or f"{self.fps:.1f} frames/s measured")
        for what, holds in (("exposure", self.exposure_holds), ("focus", self.focus_holds)):
            if holds is not None:
                parts.append(f"manual {what} {'holds' if holds else 'does NOT hold'}")
        if self.listed.modes:
            parts.append(f"modes: {mode_words(self.listed.modes)}")
        return "; ".join(parts)


def report_cameras(measure_s: float = MEASURE_S) -> list[CameraReport]:
    """Look at every camera of this computer, one after another."""
    return [report_camera(listed, open_camera, measure_s) for listed in list_cameras()]


def report_camera(
    listed: Listed, opener: Callable[[str, Mode, str], Camera], measure_s: float
) -> CameraReport:
    """Look at one camera for ``measure_s``; manual settings are tried and put back."""
    exposure = focus = None
    if listed.kind == "v4l2":
        with suppress(OSError), V4l2Device(listed.address) as device:
            exposure, focus = device.manual_exposure_holds(), device.manual_focus_holds()
    run = _Run(functools.partial(opener, listed.address, Mode(), "left"), measure_s)
    fps, rate = run.result()
    fault = run.fault or ("" if math.isfinite(fps) else "it delivered no pictures")
    return CameraReport(listed, fps, rate, exposure, focus, fault)


class _Run:
    """A camera that runs for a moment, in a thread that is left behind where the camera hangs."""

    def __init__(self, opener: Callable[[], Camera], measure_s: float) -> None:
        self.fault = ""
        self._opener = opener
        self._measure_s = measure_s
        self._stamps_s: list[float] = []
        self._sizes: list[int] = []
        self._thread = threading.Thread(target=self._run, name="measuring", daemon=True)

    def result(self) -> tuple[float, float]:
        """Pictures and bytes a second; NaN and 0 where there were too few."""
        self._thread.start()
        self._thread.join(PATIENCE_S + self._measure_s)
        stamps, sizes = self._stamps_s[SETTLE:], self._sizes[SETTLE:]
        if self._thread.is_alive():
            self.fault = "it hangs"
        if len(stamps) < 2:
            return math.nan, 0.0
        period = float(np.median(np.diff(stamps)))
        return 1 / period, float(np.mean(sizes)) / period

    def _run(self) -> None:
        try:
            camera = self._opener()
        except OlivevibError as error:
            self.fault = error.what
            return
        stop = threading.Event()
        timer = threading.Timer(self._measure_s, stop.set)
        timer.start()
        try:
            for shot in camera.shots(stop):
                self._stamps_s.append((shot.device_ns or shot.host_ns) * 1e-9)
                self._sizes.append(len(shot.data))
        except (OSError, av.error.FFmpegError) as error:
            self.fault = str(error)
        finally:
            timer.cancel()
            camera.close()


def mode_words(modes: tuple[CameraMode, ...]) -> str:
    """The largest sizes of each coding with their highest rate, MJPEG first."""
    best: dict[tuple[str, tuple[int, int]], float] = {}
    for mode in modes:
        key = (mode.codec, mode.size_px)
        best[key] = max([best.get(key, 0.0), *mode.fps])
    order = sorted(best, key=lambda k: ("mj" not in k[0].lower(), k[0], -k[1][0] * k[1][1]))
    told = [f"{codec} {w}x{h}@{best[codec, (w, h)]:g}" for codec, (w, h) in order[:MOST_MODES]]
    return ", ".join(told) + (", …" if len(order) > MOST_MODES else "")
