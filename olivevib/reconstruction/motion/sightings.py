"""What the cameras saw of the markers, each point with its own row: the input of the motion fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from olivevib.arrays import Bools, Floats, Ints, floats, ints


@dataclass(frozen=True)
class Drawn:
    """What a drawing fitted to a whole marker reports of it.

    px (N, K, 2): where the fitted homography puts the nodes; reported (2P, 2K): by how much the P
    points of the fit move when its nodes do.
    """

    px: Floats
    reported: Floats

    def __post_init__(self) -> None:
        n, k = np.shape(self.px)[:2]
        object.__setattr__(self, "px", floats("px", self.px, (n, k, 2)))
        object.__setattr__(self, "reported", floats("reported", self.reported, (None, 2 * k)))


@dataclass(frozen=True)
class Sightings:
    """One marker as one camera saw it, in the N frames in which it did (P points each).

    frame (N,) count with drops restored; row_zero_s (N,) when raw row 0 was taken, on this
    camera's own clock (offset and row time not included); row (N, K) raw sensor row of each node;
    px (N, P, 2) raw pixels; covariance_px2 (N, 2P, 2P); exposure_s (N,), NaN: unknown. drawn: how
    the P points follow from K nodes of the marker (module drawing); None: the points are the nodes.
    """

    frame: Ints
    row_zero_s: Floats
    row: Floats
    px: Floats
    covariance_px2: Floats
    exposure_s: Floats
    drawn: Drawn | None = None

    def __post_init__(self) -> None:
        n, p, _ = np.shape(self.px)
        k = p if self.drawn is None else self.drawn.px.shape[1]
        object.__setattr__(self, "frame", ints("frame", self.frame, (n,)))
        shapes: dict[str, tuple[int, ...]] = {
            "row_zero_s": (n,),
            "row": (n, k),
            "px": (n, p, 2),
            "covariance_px2": (n, 2 * p, 2 * p),
        }
        for name, shape in shapes.items():
            object.__setattr__(self, name, floats(name, getattr(self, name), shape))
        object.__setattr__(
            self, "exposure_s", floats("exposure_s", self.exposure_s, (n,), nan=True)
        )

    def only(self, keep: Bools) -> Sightings:
        """The sightings ``keep`` (N,)."""
        drawn = self.drawn
        return replace(
            self,
            frame=self.frame[keep],
            row_zero_s=self.row_zero_s[keep],
            row=self.row[keep],
            px=self.px[keep],
            covariance_px2=self.covariance_px2[keep],
            exposure_s=self.exposure_s[keep],
            drawn=None if drawn is None else replace(drawn, px=drawn.px[keep]),
        )


@dataclass(frozen=True)
class MarkerSightings:
    """One marker in both cameras, in its own frame, origin at its centre.

    points_mm (P, 3): what is reported; nodes_mm (K, 3): whose motion decides it, None: the points.
    """

    id: int
    points_mm: Floats
    left: Sightings
    right: Sightings
    nodes_mm: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_mm", floats("points_mm", self.points_mm, (None, 3)))
        if self.nodes_mm is not None:
            object.__setattr__(self, "nodes_mm", floats("nodes_mm", self.nodes_mm, (None, 3)))

    @property
    def moving_mm(self) -> Floats:
        """(K, 3) the nodes, else the points."""
        return self.points_mm if self.nodes_mm is None else self.nodes_mm


@dataclass(frozen=True)
class Observations:
    """All markers that both cameras saw; skipped: ids seen too seldom to fit.

    reference_row: mean raw row of all points, at which the fitted offset holds.
    """

    markers: tuple[MarkerSightings, ...]
    frame_rate_hz: float
    reference_row: float
    skipped: tuple[int, ...] = ()
