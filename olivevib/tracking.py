"""Frames of one camera to tracks: location rectangles, re-initialisation, states."""

from __future__ import annotations

from dataclasses import dataclass

from olivevib.arrays import Floats, Ints, floats, ints


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
