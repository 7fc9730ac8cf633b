"""From the detections of every frame to the tracks that are stored: times, strays, cautions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import Caution
from olivevib.files.video import VideoInfo
from olivevib.marker import MarkerLibrary
from olivevib.pipeline.observations import FrameObservations
from olivevib.pipeline.recordings import SIDES, check_counts, stamps_of
from olivevib.signals import StampFit
from olivevib.tracking import FrameTimes, Track, assemble
from olivevib.trial import Trial
from olivevib.trial.records.tracks import CameraRecord, StoredTracks

Seen = Callable[[], Iterator[FrameObservations]]  # the frames of one camera, from the first

STRAY_FRAMES = 3  # an id seen in fewer frames of both cameras is a stray reading, not a marker
STRAY_SHARE = 0.05


@dataclass(frozen=True)
class _Recorded:
    """One camera: what its file says and what its frames showed; ``seen`` reads them anew.

    frames: how many were delivered; damaged: indices of those that would not decode; counts: in
    how many frames each id was seen.
    """

    side: str
    info: VideoInfo
    seen: Seen
    frames: int
    damaged: frozenset[int]
    counts: Mapping[int, int]
    stamps: Floats
    stamp_kind: str
    fit: StampFit


def stored_tracks(
    trial: Trial,
    library: MarkerLibrary,
    infos: dict[str, VideoInfo],
    seen: Mapping[str, Seen],
    notes: tuple[Caution, ...] = (),
) -> StoredTracks:
    """Tracks of both cameras on their own clocks, with the record of each recording.

    notes: what reading the files had to say.
    """
    recorded = {side: _recorded(trial, side, infos[side], seen[side]) for side in SIDES}
    declared = tuple(int(i) for i in library.ids) if trial.settings.markers.ids else None
    ids, strays = _markers(list(recorded.values()), declared)
    tracks = {side: _tracks(trial, recorded, side, ids) for side in SIDES}
    localisers = sorted({t.localiser for side in SIDES for t in tracks[side] if t.localiser})
    counts = check_counts(
        {side: recorded[side].frames for side in SIDES},
        {side: recorded[side].fit for side in SIDES},
    )
    return StoredTracks(
        left=tracks["left"],
        right=tracks["right"],
        cameras={side: _record(trial, recorded[side]) for side in SIDES},
        stamp_s={side: _with_drops(recorded[side]) for side in SIDES},
        fitted_s={side: _by_the_fit(recorded[side].fit) for side in SIDES},
        stray_ids=strays,
        localiser=", ".join(localisers),
        cautions=notes + counts + _cautions(list(recorded.values()), ids, declared),
    )


def _recorded(trial: Trial, side: str, info: VideoInfo, seen: Seen) -> _Recorded:
    camera = getattr(trial.settings.cameras, side)
    file = trial.path(camera.stamps) if camera.stamps else None
    container, damaged, counts = [], [], Counter[int]()
    for index, frame in enumerate(seen()):
        container.append(frame.stamp_s)
        counts.update(d.id for d in frame.detections)
        if frame.damaged:
            damaged.append(index)
    stamps, kind, fit = stamps_of(file, trial.path(camera.video), container)
    if kind == "container" and info.container.startswith("avi"):
        kind = "slots"  # AVI has no stamps of its own: the frame's number times the rate
    return _Recorded(
        side, info, seen, len(container), frozenset(damaged), dict(counts), stamps, kind, fit
    )


def _markers(
    cameras: list[_Recorded], declared: tuple[int, ...] | None
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The ids to track and the stray ones: seen, but too rarely to be a marker of this trial."""
    if declared is not None:
        return declared, ()
    counts = [camera.counts for camera in cameras]
    least = [max(STRAY_FRAMES, STRAY_SHARE * camera.frames) for camera in cameras]
    ids = sorted(set(counts[0]) | set(counts[1]))
    kept = [i for i in ids if any(c.get(i, 0) >= n for c, n in zip(counts, least, strict=True))]
    return tuple(kept), tuple(i for i in ids if i not in kept)


def _tracks(
    trial: Trial, recorded: dict[str, _Recorded], side: str, ids: tuple[int, ...]
) -> tuple[Track, ...]:
    """Tracks of one camera; its clock starts at the left one's where both share a clock."""
    me, left = recorded[side], recorded["left"]
    shared = me.stamp_kind == left.stamp_kind == "file"
    exposure = getattr(trial.settings.cameras, side).exposure_ms
    times = FrameTimes(
        fit=me.fit,
        start_s=float(me.fit.t_s[0] - left.fit.t_s[0]) if shared else 0.0,
        row_time_s=trial.settings.cameras.row_time_s(side)[0],
        exposure_s=float("nan") if exposure is None else exposure * 1e-3,
        size_px=me.info.size_px,
        damaged=me.damaged,
    )
    return tuple(assemble(side, (s.detections for s in me.seen()), times, ids))


def _record(trial: Trial, camera: _Recorded) -> CameraRecord:
    row_time, row_time_sigma, source = trial.settings.cameras.row_time_s(camera.side)
    return CameraRecord(
        video=getattr(trial.settings.cameras, camera.side).video,
        codec=camera.info.codec,
        size_px=camera.info.size_px,
        frames=camera.frames,
        dropped=int(camera.fit.dropped.size),
        damaged=len(camera.damaged),
        stamp_kind=camera.stamp_kind,
        method=camera.fit.method,
        rate_hz=camera.fit.rate_hz,
        rate_sigma_hz=camera.fit.rate_sigma_hz,
        jitter_s=camera.fit.jitter_s,
        worst_s=camera.fit.worst_s,
        row_time_s=row_time,
        row_time_sigma_s=row_time_sigma,
        row_time_source=source,
        turn_deg=camera.info.rotation_deg,
    )


def _by_the_fit(fit: StampFit) -> Floats:
    """The stamp of every frame count by the clock fit, also of those that were dropped."""
    return np.interp(np.arange(int(fit.sequence[-1]) + 1), fit.sequence, fit.t_s)


def _with_drops(camera: _Recorded) -> Floats:
    """The raw stamp of every frame count, NaN where the camera delivered no frame."""
    out = np.full(int(camera.fit.sequence[-1]) + 1, np.nan)
    out[camera.fit.sequence] = camera.stamps
    return out


def _cautions(
    cameras: list[_Recorded], ids: tuple[int, ...], declared: tuple[int, ...] | None
) -> tuple[Caution, ...]:
    out = []
    counts = [camera.counts for camera in cameras]
    if not any(counts):
        out.append(
            Caution(
                "no-markers",
                "No marker of the library was found in either video.",
                "Check the library (--markers), that prints are sharp and lit, and that the "
                "videos are not mirrored.",
            )
        )
    elif declared:
        absent = [str(i) for i in declared if not any(i in c for c in counts)]
        if absent:
            out.append(
                Caution(
                    "marker-never-seen",
                    f"Declared markers were never seen: {', '.join(absent)}.",
                    "Correct markers.ids in trial.toml, or check that they face the cameras.",
                )
            )
    return tuple(out)
