"""What was seen of each marker, frame by frame, and why it was not seen where it was not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats, Ints, floats, ints
from olivevib.detection import Detection
from olivevib.signals import StampFit, State

LOST_AFTER_S = 1.0  # a marker unseen for longer is lost, not merely hidden


@dataclass(frozen=True)
class Track:
    """One marker through the video of one camera; one row a frame, NaN where it was not seen.

    camera "left" or "right"; frame (N,) count with drops restored; t_s (N,) the instant at which
    the centre was seen, on this camera's own clock (stamp fit + row x row time; the offset between
    the cameras is added where tracks meet); raw_row (N,) sensor row of the centre; corners_px
    (N, 4, 2) with corners_cov_px2 (N, 8, 8); centre_px (N, 2) with centre_cov_px2 (N, 2, 2);
    exposure_s (N,) (NaN: unknown); state (N,) of signals.State.
    """

    camera: str
    id: int
    frame: Ints
    t_s: Floats
    raw_row: Floats
    corners_px: Floats
    corners_cov_px2: Floats
    centre_px: Floats
    centre_cov_px2: Floats
    exposure_s: Floats
    state: Ints
    localiser: str = ""

    def __post_init__(self) -> None:
        frame = ints("frame", self.frame, (None,))
        n = frame.size
        object.__setattr__(self, "frame", frame)
        object.__setattr__(self, "state", ints("state", self.state, (n,)))
        object.__setattr__(self, "t_s", floats("t_s", self.t_s, (n,)))
        shapes: dict[str, tuple[int, ...]] = {
            "raw_row": (n,),
            "corners_px": (n, 4, 2),
            "corners_cov_px2": (n, 8, 8),
            "centre_px": (n, 2),
            "centre_cov_px2": (n, 2, 2),
            "exposure_s": (n,),
        }
        for name, shape in shapes.items():
            object.__setattr__(self, name, floats(name, getattr(self, name), shape, nan=True))

    @property
    def seen(self) -> int:
        """In how many frames the marker was seen."""
        return int(np.isfinite(self.centre_px[:, 0]).sum())


@dataclass(frozen=True)
class FrameTimes:
    """When each delivered frame of one camera was taken, and its size.

    fit: the clock fit of the stamps of all frames; start_s: trial time of row 0 of count 0 on this
    camera's own clock; row_time_s signed, per raw row; damaged: indices that would not decode.
    """

    fit: StampFit
    start_s: float
    row_time_s: float
    exposure_s: float
    size_px: tuple[int, int]
    damaged: frozenset[int] = frozenset()


def assemble(
    camera: str, frames: Iterable[Sequence[Detection]], times: FrameTimes, ids: Sequence[int]
) -> list[Track]:
    """Tracks of the wanted ids from the detections of each delivered frame.

    frames: one list a delivered frame, in order; they are taken one by one, never kept. A count
    that the camera skipped is a row with state dropped; a frame that would not decode is damaged;
    where a marker is missing it is outside (it left at the border), hidden, or after LOST_AFTER_S
    lost.
    """
    sequence = times.fit.sequence
    rows = int(sequence[-1]) + 1
    frame_t_s = np.interp(np.arange(rows), sequence, times.fit.t_s - times.fit.t_s[0])
    base = np.full(rows, int(State.DROPPED), np.int64)
    base[sequence] = int(State.LOST)
    base[sequence[sorted(times.damaged)]] = int(State.DAMAGED)
    by_id = {i: _Rows(base) for i in ids}
    for row, detections in zip(sequence.tolist(), frames, strict=True):
        for d in detections:
            if d.id in by_id:
                by_id[d.id].put(row, d)
    return [by_id[i].track(camera, i, frame_t_s + times.start_s, times) for i in sorted(by_id)]


class _Rows:
    """The rows of one marker while its frames come in."""

    def __init__(self, base: Ints) -> None:
        n = base.size
        self.state = base.copy()
        self.values = {
            "raw_row": np.full(n, np.nan),
            "corners_px": np.full((n, 4, 2), np.nan),
            "corners_cov_px2": np.full((n, 8, 8), np.nan),
            "centre_px": np.full((n, 2), np.nan),
            "centre_cov_px2": np.full((n, 2, 2), np.nan),
        }
        self.localiser = ""

    def put(self, row: int, d: Detection) -> None:
        """Keep what one frame showed."""
        for name, values in self.values.items():
            values[row] = d.raw_row[0] if name == "raw_row" else getattr(d, name)
        self.state[row] = State.FLAGGED if d.flags else State.SEEN
        self.localiser = self.localiser or d.localiser

    def track(self, camera: str, marker: int, frame_t_s: Floats, times: FrameTimes) -> Track:
        """The finished track; the arrays are handed over, not copied."""
        _explain_gaps(self.state, self.values["corners_px"], frame_t_s, times.size_px)
        raw_row = self.values["raw_row"]
        row_or_middle = np.where(np.isfinite(raw_row), raw_row, times.size_px[1] / 2)
        for values in self.values.values():
            values.flags.writeable = False
        return Track(
            camera=camera,
            id=marker,
            frame=np.arange(frame_t_s.size),
            t_s=frame_t_s + times.row_time_s * row_or_middle,
            exposure_s=np.full(frame_t_s.size, times.exposure_s),
            state=self.state,
            localiser=self.localiser,
            **self.values,
        )


def _explain_gaps(state: Ints, corners: Floats, t_s: Floats, size_px: tuple[int, int]) -> None:
    """Turn lost into outside or hidden by where the marker was before and after the gap."""
    seen = np.flatnonzero((state == State.SEEN) | (state == State.FLAGGED))
    border = np.zeros(state.size, dtype=np.bool_)
    for k in seen:
        low, high = corners[k].min(axis=0), corners[k].max(axis=0)
        margin = 0.5 * (high - low).max()
        border[k] = bool(
            (low < margin).any() or (high > np.array(size_px, dtype=np.float64) - 1 - margin).any()
        )
    for k in np.flatnonzero(state == State.LOST):
        before, after = seen[seen < k], seen[seen > k]
        near = [int(s[e]) for s, e in ((before, -1), (after, 0)) if s.size]
        if any(border[j] for j in near):
            state[k] = State.OUTSIDE
        elif len(near) == 2 and t_s[near[1]] - t_s[near[0]] <= LOST_AFTER_S:
            state[k] = State.HIDDEN
