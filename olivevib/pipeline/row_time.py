"""The row time of a camera from the recording of a flashing lamp, and the book that keeps it."""

from __future__ import annotations

import tomllib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.calibration.row_time import RowTime, row_time_from_led
from olivevib.errors import Caution, UsageError
from olivevib.files.video import Video
from olivevib.pipeline.capture.record import RECORD
from olivevib.pipeline.recordings import stamps_of
from olivevib.progress import Tick, silent
from olivevib.trial.camera_book import CameraMode, Entry

MOST_FRAMES = 600


@dataclass(frozen=True)
class MeasuredRowTime:
    """A row time with what it belongs to; mode.camera is "" where nothing says whose it is."""

    found: RowTime
    mode: CameraMode
    led_hz: float
    cautions: tuple[Caution, ...]

    @property
    def words(self) -> str:
        """For a person."""
        rows = self.mode.size_px[1]
        micro, sigma = abs(self.found.row_time_s) * 1e6, self.found.sigma_s * 1e6
        way = "downward" if self.found.row_time_s > 0 else "upward"
        read = f"read {way}" if self.found.sign_known else "readout direction not known"
        return (
            f"row time {micro:.3f} ± {sigma:.3f} µs, readout {micro * rows / 1000:.2f} ms over "
            f"{rows} rows, {read} ({self.found.stripes:.1f} stripes)"
        )

    @property
    def entry(self) -> Entry:
        """The line for the workspace's book of cameras."""
        micro = round(self.found.row_time_s * 1e6, 4)
        source = f"lamp at {self.led_hz:g} Hz, {self.found.stripes:.1f} stripes"
        if not self.found.sign_known:
            source += ", direction assumed"
        return Entry(self.mode, micro, round(self.found.sigma_s * 1e6, 4), source)


def measure_row_time(
    video: Path, led_hz: float, camera: str | None = None, tick: Tick = silent
) -> MeasuredRowTime:
    """Measure the row time in a recording of a lamp that flashes led_hz times a second.

    camera: whose recording it is; else what the recorder wrote beside it. Rows are those of the
    file: a picture that was scaled or turned gives a wrong time. Raises InputError as
    ``row_time_from_led`` and ``Video.open`` do, UsageError for a frequency that is none.
    """
    if not 0 < led_hz < 1e6:
        raise UsageError(f"--led {led_hz:g} is no frequency.", "", "Give flashes a second, in Hz.")
    profiles, stamps, kept = [], [], []
    with Video.open(video) as opened:
        size = opened.info.size_px
        for frame in opened.frames():
            stamps.append(frame.stamp_s)
            if frame.grey is not None:
                profiles.append(frame.grey.mean(axis=1))
                kept.append(frame.index)
            tick(frame.index + 1, opened.info.frame_count_hint, f"reading {video.name}")
            if len(profiles) == MOST_FRAMES:
                break
    _, _, fit = stamps_of(None, video, stamps)
    found = row_time_from_led(np.array(profiles), fit.t_s[kept], led_hz)
    mode = CameraMode(camera or recorded_camera(video) or "", size, round(fit.rate_hz, 3))
    return MeasuredRowTime(found, mode, led_hz, _cautions(found))


def recorded_camera(video: Path) -> str | None:
    """The serial number (or title) that the recorder wrote of a recording's camera."""
    with suppress(OSError, tomllib.TOMLDecodeError):
        told = tomllib.loads((video.parent / RECORD).read_text(encoding="utf-8"))
        side = told.get(video.stem)
        if isinstance(side, dict):
            return str(side.get("serial") or side.get("title") or "") or None
    return None


def _cautions(found: RowTime) -> tuple[Caution, ...]:
    if found.sign_known:
        return ()
    return (
        Caution(
            "readout-direction-unknown",
            "The stripes do not tell whether the rows are read downward or upward.",
            "Taken as downward, as webcams are. A lamp at another frequency, not near a multiple "
            "of half the frame rate, tells it.",
        ),
    )
