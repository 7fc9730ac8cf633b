"""Stage ``track``: both videos to tracks, with a journal so that nothing acknowledged is lost."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from olivevib.detection import Detector
from olivevib.errors import Caution
from olivevib.files.journal import Journal
from olivevib.files.store import write_stage
from olivevib.files.video import Frame, Video, VideoInfo
from olivevib.marker import MarkerLibrary
from olivevib.pipeline.libraries import trial_library, wrapped_markers
from olivevib.pipeline.observations import FrameObservations, pack, unpack
from olivevib.pipeline.recordings import SIDES, check_sizes
from olivevib.pipeline.tracks_result import stored_tracks
from olivevib.pipeline.two_cameras import both
from olivevib.progress import Tick, silent
from olivevib.tracking import Tracker
from olivevib.trial import Trial
from olivevib.trial.fingerprints import PRIVATE
from olivevib.trial.records.tracks import tracks_file

LOOK_EVERY, LOOKS = 15, 8  # frames looked at in a mirror where no marker was found
TICK_ROWS = 16  # frames read back between two ticks
COMMIT_ROWS = 16  # frames acknowledged together: at most this much work is repeated after a crash


def track(trial: Trial, tick: Tick = silent) -> tuple[Caution, ...]:
    """Track every marker of the trial through both videos and write tracks.h5.

    Cancelling or killing it keeps every acknowledged frame; the next run resumes there and gives
    bit-identical tracks. Raises InputError for unreadable videos, sizes or stamps.
    """
    now = trial.fingerprint("track")
    library = trial_library(trial)
    infos = {side: _info(trial, side) for side in SIDES}
    check_sizes({side: infos[side].size_px for side in SIDES})
    trial.private.mkdir(exist_ok=True)
    key = hashlib.sha256(now.canonical().encode()).hexdigest()
    journal = Journal.open(trial.folder / PRIVATE / "track.journal", key)
    try:
        notes = _measure(trial, library, infos, journal, tick)
        seen = {side: partial(_seen, journal, side, tick) for side in SIDES}
        empty = [side for side in SIDES if not any(s.detections for s in seen[side]())]
        notes += tuple(c for side in empty for c in _if_mirrored(trial, library, side, tick))
        stored = stored_tracks(trial, library, infos, seen, notes)
    finally:
        journal.close()
    cautions, file = stored.cautions, tracks_file(stored, now)
    del stored  # the file holds its own columns: memory for one of them is enough
    write_stage(trial.folder / "tracks.h5", file)
    journal.remove()
    return cautions


def _if_mirrored(trial: Trial, library: MarkerLibrary, side: str, tick: Tick) -> Iterator[Caution]:
    """A caution where a video without any marker shows some once it is flipped left to right."""
    detector = Detector(library, trial.settings.detection)
    hits = looked = 0
    with Video.open(trial.path(getattr(trial.settings.cameras, side).video)) as video:
        for frame in video.frames():
            tick(looked, LOOKS, "looking for mirrored markers")
            if frame.index % LOOK_EVERY or frame.grey is None:
                continue
            looked += 1
            hits += bool(detector.detect(np.ascontiguousarray(frame.grey[:, ::-1])))
            if looked == LOOKS:
                break
    if hits >= max(1, looked // 2):
        yield Caution(
            "mirrored-video",
            f"The {side} video is mirrored: flipped left to right it shows markers.",
            "Switch the mirror image off in the camera's program and record again; olivevib does "
            "not flip recordings, because a pixel's row is its time.",
        )


@dataclass(frozen=True)
class _Step:
    """One measured frame, and what the tracker remembers after it."""

    frame: int
    payload: bytes
    memory: bytes


def _measure(
    trial: Trial,
    library: MarkerLibrary,
    infos: dict[str, VideoInfo],
    journal: Journal,
    tick: Tick,
) -> tuple[Caution, ...]:
    """Bring the journal to the end of both videos; what is wrong with the files comes back."""
    done, waiting = 0, 0
    makers = {}
    notes: dict[str, tuple[Caution, ...]] = dict.fromkeys(SIDES, ())
    for side in SIDES:
        last = journal.last(side)
        start, memory = (0, None) if last is None else (last[0] + 1, last[1])
        done += start
        path = trial.path(getattr(trial.settings.cameras, side).video)
        tracker = _tracker(trial, library, memory)
        makers[side] = partial(_steps, path, start, tracker, partial(notes.__setitem__, side))

    def collect(side: str, step: _Step) -> None:
        nonlocal waiting
        journal.append(side, step.frame, step.payload, step.memory)
        waiting += 1
        if waiting >= COMMIT_ROWS:
            journal.commit()
            waiting = 0

    hints = [infos[side].frame_count_hint for side in SIDES]
    total = sum(h for h in hints if h) if all(hints) else None
    try:
        both(makers, collect, tick, total, "tracking markers", done)
    finally:
        journal.commit()
    return tuple(note for side in SIDES for note in notes[side])


def _tracker(trial: Trial, library: MarkerLibrary, memory: bytes | None) -> Tracker:
    tracker = Tracker(library, trial.settings.detection, wrapped_markers(trial))
    if memory is not None:
        tracker.recall(memory)
    return tracker


def _steps(
    path: Path, start: int, tracker: Tracker, note: Callable[[tuple[Caution, ...]], None]
) -> Iterator[_Step]:
    with Video.open(path) as video:
        for frame in video.frames(start):
            yield _Step(frame.index, pack(_observe(frame, tracker)), tracker.memory())
        note(tuple(video.cautions))


def _observe(frame: Frame, tracker: Tracker) -> FrameObservations:
    if frame.grey is None:
        return FrameObservations(frame.stamp_s, True, ())
    found = tracker.update(frame.grey, frame.stamp_s)
    return FrameObservations(frame.stamp_s, False, tuple(found))


def _seen(journal: Journal, side: str, tick: Tick) -> Iterator[FrameObservations]:
    """What every frame of one camera showed, one by one from the disk."""
    for done, row in enumerate(journal.rows(side)):
        if done % TICK_ROWS == 0:
            tick(done, None, f"putting the {side} tracks together")
        yield unpack(row.payload)


def _info(trial: Trial, side: str) -> VideoInfo:
    with Video.open(trial.path(getattr(trial.settings.cameras, side).video)) as video:
        return video.info
