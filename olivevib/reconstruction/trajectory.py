"""Three-dimensional paths of the markers, each sample with its sigma and its own time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from olivevib.arrays import Bools, Floats, Ints, floats, ints
from olivevib.signals import Samples, State


@dataclass(frozen=True)
class ContinuousFit:
    """The continuous-time motion of one marker (sway spline + harmonics), where it was fitted.

    Written by the fit above the frame rate; all arrays follow CONVENTIONS.md (continuous fit).
    """

    id: int
    f_hz: float
    knots_s: Floats  # (B,)
    sway: Floats  # (6, B) mm and rad
    cosine: Floats  # (H, 6)
    sine: Floats  # (H, 6)
    covariance: Floats  # of f_hz, cosine, sine: (1 + 12 H, 1 + 12 H)
    t_ref_s: float
    chi2: float
    candidates_hz: tuple[float, ...] = ()
    evidence: tuple[float, ...] = ()


_SAMPLES = (  # arrays (N, M, …), beside sigma_rig_mm
    *("sample_t_s", "xyz_mm", "sigma_xyz_mm", "covariance_mm2"),
    *("rotation_rad", "sigma_rotation_rad", "state", "epipolar_px"),
)


@dataclass(frozen=True)
class Trajectory:
    """Where each marker was, frame after frame.

    t_s (N,) the frame's time on the trial clock; sample_t_s (N, M) the instant at which each marker
    was seen (row and camera offset included); xyz_mm (N, M, 3) its centre, rotation_rad (N, M, 3)
    rotation vector of its plane, with sigmas; covariance_mm2 (N, M, 3, 3); state (N, M) of State;
    epipolar_px (N, M) signed epipolar distance before triangulation. NaN = not seen.
    sigma_rig_mm (N, M, 3): what the calibration adds, the same error in all frames (not in
    sigma_xyz_mm, nor in amplitudes); None where the rig does not say.
    frame: "left camera", "board" or "gravity"; X_frame = R_world_left X_left + t_world_left_mm.
    method: "optimal", "linear-eigen" or "continuous".
    """

    t_s: Floats
    ids: Ints
    sample_t_s: Floats
    xyz_mm: Floats
    sigma_xyz_mm: Floats
    covariance_mm2: Floats
    rotation_rad: Floats
    sigma_rotation_rad: Floats
    state: Ints
    epipolar_px: Floats
    frame: str
    method: str
    fits: tuple[ContinuousFit, ...] = ()
    sigma_rig_mm: Floats | None = None
    R_world_left: Floats = field(default_factory=lambda: np.eye(3))
    t_world_left_mm: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        t_s = floats("t_s", self.t_s, (None,))
        ids = ints("ids", self.ids, (None,))
        n, m = t_s.size, ids.size
        shapes: dict[str, tuple[int, ...]] = {
            "sample_t_s": (n, m),
            "xyz_mm": (n, m, 3),
            "sigma_xyz_mm": (n, m, 3),
            "covariance_mm2": (n, m, 3, 3),
            "rotation_rad": (n, m, 3),
            "sigma_rotation_rad": (n, m, 3),
            "epipolar_px": (n, m),
        }
        object.__setattr__(self, "t_s", t_s)
        object.__setattr__(self, "ids", ids)
        object.__setattr__(self, "state", ints("state", self.state, (n, m)))
        shapes |= {"R_world_left": (3, 3), "t_world_left_mm": (3,)}
        if self.sigma_rig_mm is not None:
            shapes["sigma_rig_mm"] = (n, m, 3)
        for name, shape in shapes.items():
            object.__setattr__(self, name, floats(name, getattr(self, name), shape, nan=True))

    @property
    def left_camera_mm(self) -> Floats:
        """Positions (N, M, 3) in the left camera's frame, whatever ``frame`` is."""
        out: Floats = (self.xyz_mm - self.t_world_left_mm) @ self.R_world_left
        return out

    @property
    def seen(self) -> Bools:
        """(N, M) True where a marker has a position."""
        return np.asarray(np.isfinite(self.xyz_mm).all(axis=2))

    def rows(self, which: Ints | Bools) -> Trajectory:
        """The instants ``which`` of the N alone."""
        kept = self._samples(lambda values: values[which])
        return replace(self, t_s=self.t_s[which], **kept)

    def markers(self, which: Ints) -> Trajectory:
        """The markers in the columns ``which`` of the M alone, with their fits."""
        ids = self.ids[which]
        kept = self._samples(lambda values: values[:, which])
        fits = tuple(fit for fit in self.fits if fit.id in ids)
        return replace(self, ids=ids, fits=fits, **kept)

    def onto(self, t_s: Floats, rows: Ints) -> Trajectory:
        """The instants as the rows ``rows`` of longer ``t_s``; NaN and *dropped* in the others."""

        def spread(values: Any) -> Any:
            none = np.nan if values.dtype.kind == "f" else int(State.DROPPED)
            out = np.full((t_s.size, *values.shape[1:]), none, values.dtype)
            out[rows] = values
            return out

        return replace(self, t_s=t_s, **self._samples(spread))

    def _samples(self, change: Callable[[Any], Any]) -> dict[str, Any]:
        kept = {name: change(getattr(self, name)) for name in _SAMPLES}
        rig = self.sigma_rig_mm
        return {**kept, "sigma_rig_mm": None if rig is None else change(rig)}

    def samples(self, marker_id: int) -> Samples:
        """The displacement of one marker from its mean position, at its own times, mm."""
        m = int(np.flatnonzero(self.ids == marker_id)[0])
        good = self.seen[:, m]
        xyz = self.xyz_mm[good, m]
        values = xyz - xyz.mean(axis=0) if len(xyz) else xyz
        return Samples(self.sample_t_s[good, m], values, "displacement", "mm", ("x", "y", "z"))

    def to_dataframe(self) -> Any:
        """One row a marker and time, markers by id: the columns of the CSV export (pandas)."""
        import pandas as pd

        order = np.argsort(self.ids)
        n, m = self.t_s.size, self.ids.size
        frame = {"time_s": self.sample_t_s[:, order].T.ravel()}
        frame["marker"] = np.repeat(self.ids[order], n)
        for k, axis in enumerate("xyz"):
            frame[f"{axis}_mm"] = self.xyz_mm[:, order, k].T.ravel()
        for k, axis in enumerate("xyz"):
            frame[f"sigma_{axis}_mm"] = self.sigma_xyz_mm[:, order, k].T.ravel()
        words = np.array([s.word for s in State])
        frame["state"] = words[self.state[:, order].T.ravel()] if m else np.empty(0, "U1")
        return pd.DataFrame(frame)

    def to_xarray(self) -> Any:
        """The arrays with named axes time, marker, axis, as in trajectory.h5 (xarray.Dataset).

        ``.sel(marker=3, axis="x")`` picks by name; units stand in the attributes. Needs the package
        xarray, which olivevib does not install.
        """
        import xarray as xr

        nm = ("time", "marker")
        nma = (*nm, "axis")
        data = {
            "sample_time": (nm, self.sample_t_s, {"units": "s"}),
            "xyz": (nma, self.xyz_mm, {"units": "mm"}),
            "sigma_xyz": (nma, self.sigma_xyz_mm, {"units": "mm"}),
            "covariance": ((*nma, "axis2"), self.covariance_mm2, {"units": "mm2"}),
            "rotation": (nma, self.rotation_rad, {"units": "rad"}),
            "sigma_rotation": (nma, self.sigma_rotation_rad, {"units": "rad"}),
            "state": (nm, np.array([s.word for s in State])[self.state]),
            "epipolar": (nm, self.epipolar_px, {"units": "px"}),
        }
        axes = ["x", "y", "z"]
        coords = {
            "time": ("time", self.t_s, {"units": "s"}),
            **{"marker": self.ids, "axis": axes, "axis2": axes},
        }
        return xr.Dataset(data, coords, {"frame": self.frame, "method": self.method})
