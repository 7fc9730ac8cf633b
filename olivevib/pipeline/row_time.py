"""The row time of a camera from the recording of a flashing lamp, and the book that keeps it."""

from __future__ import annotations

import tomllib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.calibration.row_time import RowTime, row_time_from_led
from olivevib.errors import Caution, InputError, UsageError
from olivevib.files.video import Video
from olivevib.pipeline.capture.record import RECORD
from olivevib.pipeline.recordings import SIDES, stamps_of
from olivevib.progress import Tick, silent
from olivevib.trial import Trial
from olivevib.trial.camera_book import BOARD, CameraMode, Entry, remember

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


@dataclass(frozen=True)
class BoardRowTime:
    """The row time of one camera of a trial as its waved board showed it."""

    side: str
    entry: Entry

    @property
    def words(self) -> str:
        """For a person."""
        rows, micro = self.entry.mode.size_px[1], self.entry.row_time_us
        way = "downward" if micro > 0 else "upward"
        return (
            f"{self.side}: row time {abs(micro):.3f} ± {self.entry.sigma_us:.3f} µs, readout "
            f"{abs(micro) * rows / 1000:.2f} ms over {rows} rows, read {way} (waved board)"
        )


def board_row_times(trial: Trial) -> list[BoardRowTime]:
    """Both cameras' row times from the board that was waved for a trial's calibration.

    Raises InputError where the trial is not calibrated, or the board did not tell them.
    """
    rig = trial.rig
    if rig is None:
        raise trial.need("calibrate")
    found = []
    for side in SIDES:
        camera = getattr(rig, side)
        if camera.row_time_source == "board":
            video = trial.path(str(getattr(trial.settings.calibration, side)))
            rate = trial.tracks.cameras[side].rate_hz if trial.tracks else 0.0
            own = getattr(trial.settings.cameras, side).video
            name = recorded_camera(trial.path(own)) or recorded_camera(video) or ""
            mode = CameraMode(name, camera.size_px, round(rate, 3))
            micro = round(camera.row_time_s * 1e6, 4), round(camera.row_time_sigma_s * 1e6, 4)
            found.append(BoardRowTime(side, Entry(mode, *micro, f"{BOARD} of {trial.name}")))
    if not found:
        raise InputError(
            f"the calibration of {trial.name} tells no row time.",
            "The board was not waved in a video, or not fast enough; or the row time was declared.",
            "Wave the board for some seconds, tilting it; or use a lamp: olivevib rowtime --led HZ",
        )
    return found


def keep_row_time(entry: Entry, workspace: Path | None) -> str:
    """Write what was measured into the workspace's book of cameras; says where, or why not."""
    mode = entry.mode
    if not mode.camera:
        return "Not kept: the recording does not say whose it is. Name the camera."
    if not mode.fps:
        return "Not kept: the recording does not say in which mode the camera ran."
    if workspace is None:
        return "Not kept: there is no workspace here (olivevib init makes one)."
    return f"kept for {mode.camera} in {remember(workspace, entry)}; new trials of it will use it"


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
