"""What an export says besides the paths themselves, and the rows that all text formats share."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Bools, Floats, Ints
from olivevib.errors import UsageError
from olivevib.geometry import StereoRig
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.vibration.types import Spectrum


@dataclass(frozen=True)
class ExportFacts:
    """What travels with the paths: where they come from, the rig, the spectra.

    trial: its name, written into headers; rig and spectra go into formats that can hold them
    (h5: both). The unit is always mm and s, the frame is the trajectory's own.
    """

    trial: str = ""
    rig: StereoRig | None = None
    spectra: tuple[Spectrum, ...] = ()


@dataclass(frozen=True)
class MarkerPath:
    """One marker's path: t_s (N,), xyz_mm and sigma_mm (N, 3) with NaN gaps, state (N,)."""

    id: int
    t_s: Floats
    xyz_mm: Floats
    sigma_mm: Floats
    state: Ints

    @property
    def seen(self) -> Bools:
        """(N,) True where the marker has a position."""
        return np.asarray(np.isfinite(self.xyz_mm).all(axis=1))

    def runs(self) -> Iterator[tuple[int, int]]:
        """The stretches [first, beyond) without a gap, in order; a gap is never bridged."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.seen, [False]])))
        yield from ((int(a), int(b)) for a, b in edges.reshape(-1, 2))


def marker_paths(trajectory: Trajectory) -> Iterator[MarkerPath]:
    """The markers by id; where a sample has no time of its own the frame's time stands for it."""
    for m in np.argsort(trajectory.ids, kind="stable"):
        own = trajectory.sample_t_s[:, m]
        yield MarkerPath(
            id=int(trajectory.ids[m]),
            t_s=np.where(np.isfinite(own), own, trajectory.t_s),
            xyz_mm=trajectory.xyz_mm[:, m],
            sigma_mm=trajectory.sigma_xyz_mm[:, m],
            state=trajectory.state[:, m],
        )


def only_markers(trajectory: Trajectory, ids: tuple[int, ...] | None) -> Trajectory:
    """The trajectory with the markers ``ids`` alone (None: all); UsageError for unknown ids."""
    if ids is None:
        return trajectory
    known = [int(i) for i in trajectory.ids]
    unknown = sorted(set(ids) - set(known))
    if unknown or not ids:
        raise UsageError(
            f"this trajectory has no marker {', '.join(map(str, unknown)) or 'of no id'}.",
            "It has the markers " + (", ".join(map(str, sorted(known))) or "none") + ".",
            "Name ids of that list, or none to export all.",
        )
    pick = np.array([known.index(i) for i in sorted(set(ids))], dtype=np.int64)
    return trajectory.markers(pick)
