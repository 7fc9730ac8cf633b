"""Pictures of a trial's recordings, one at a time, and what was tracked in them."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.signals import State

if TYPE_CHECKING:
    from olivevib.detection import DetectionSettings
    from olivevib.files.video import Frame, Video
    from olivevib.tracking import Track
    from olivevib.trial.records.tracks import StoredTracks

SIDES = ("left", "right")
TRAIL = 20  # frames


@dataclass(frozen=True)
class Seen:
    """One marker in one picture: corners_px (4, 2), its last centres (K, 2), how often seen."""

    id: int
    corners_px: Floats
    trail_px: Floats
    state: str
    share: float


@dataclass(frozen=True)
class Shot:
    """One picture: side and number, grey (None: damaged or past the end), markers, instant.

    detected: the markers were found in this picture alone, just now, not tracked.
    """

    side: str
    index: int
    count: int
    grey: Grey | None
    markers: tuple[Seen, ...]
    t_s: float
    detected: bool = False


class FrameReader:
    """Reads pictures by number; onwards is fast, going back starts the recording again."""

    def __init__(self, folder: Path) -> None:
        from olivevib.trial import Trial

        trial = Trial.open(folder)
        self._folder = folder
        self._paths = {s: trial.path(getattr(trial.settings.cameras, s).video) for s in SIDES}
        self._tracks = trial.tracks
        self._lock = threading.Lock()
        self._open: tuple[str, Video, Iterator[Frame], int] | None = None

    def shot(self, side: str, index: int) -> Shot:
        """Picture ``index`` of a side; raises InputError for a recording that cannot be read."""
        with self._lock:
            grey, reached, stamp_s = self._read(side, max(0, index))
        row = row_of(self._tracks, side, reached)
        seen = markers_at(self._tracks.of(side), row) if self._tracks else ()
        return Shot(side, reached, self._count(side), grey, seen, stamp_s)

    def initialised(self, side: str, index: int, settings: DetectionSettings | None) -> Shot:
        """The same picture, with the markers that the detector finds in it alone, now.

        The paper's INITIALIZE with ``settings``, or the parameters of trial.toml where None.
        """
        from olivevib.detection import Detector
        from olivevib.pipeline.libraries import trial_library
        from olivevib.trial import Trial

        shot, trial = self.shot(side, index), Trial.open(self._folder)
        detector = Detector(trial_library(trial), settings or trial.settings.detection)
        found = detector.detect(shot.grey) if shot.grey is not None else []
        nothing = np.empty((0, 2))
        markers = tuple(Seen(d.id, d.corners_px, nothing, "seen", np.nan) for d in found)
        return replace(shot, markers=markers, detected=True)

    def close(self) -> None:
        """Release the recording."""
        with self._lock:
            self._shut()

    def _shut(self) -> None:
        if self._open is not None:
            self._open[1].close()
            self._open = None

    def _count(self, side: str) -> int:
        """Pictures of a side: as tracked, else what the header promises, else 0."""
        if self._tracks is not None:
            return self._tracks.cameras[side].frames
        hint = self._open[1].info.frame_count_hint if self._open else None
        return hint or 0

    def _read(self, side: str, index: int) -> tuple[Grey | None, int, float]:
        from olivevib.files.video import Video

        if self._open is None or self._open[0] != side or self._open[3] > index:
            self._shut()
            video = Video.open(self._paths[side])
            self._open = (side, video, video.frames(), 0)
        side, video, frames, at = self._open
        frame = None
        for frame in frames:
            at = frame.index + 1
            if frame.index >= index:
                break
        self._open = (side, video, frames, at)
        if frame is None:
            return None, max(0, at - 1), float("nan")
        return frame.grey, frame.index, frame.stamp_s


def row_of(tracks: StoredTracks | None, side: str, index: int) -> int:
    """The row of the tracks that delivered picture ``index`` stands in (drops have rows too)."""
    if tracks is None:
        return index
    delivered = np.flatnonzero(np.isfinite(tracks.stamp_s[side]))
    return int(delivered[index]) if index < delivered.size else index


def markers_at(tracks: tuple[Track, ...], row: int) -> tuple[Seen, ...]:
    """Every marker that has corners in a row of the tracks, with its trail."""
    out = []
    for track in tracks:
        if row < track.frame.size and np.isfinite(track.corners_px[row]).all():
            trail = track.centre_px[max(0, row - TRAIL) : row + 1]
            trail = trail[np.isfinite(trail).all(axis=1)]
            share = track.seen / max(1, track.frame.size)
            word = State(int(track.state[row])).word
            out.append(Seen(track.id, track.corners_px[row], trail, word, share))
    return tuple(out)


def first_frame(path: Path) -> Grey:
    """The first sound frame of a recording; raises InputError where there is none."""
    from olivevib.files.video import Video

    with Video.open(path) as video:
        return next(frame.grey for frame in video.frames() if frame.grey is not None)
