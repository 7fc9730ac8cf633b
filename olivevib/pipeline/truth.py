"""What a simulated trial's measurement is worth: measured against the truth kept beside it."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from olivevib.arrays import Floats
from olivevib.errors import InputError
from olivevib.geometry import nearest_rotation
from olivevib.reconstruction import Trajectory
from olivevib.signals import State
from olivevib.trial import Trial
from olivevib.vibration import MarkerMotion


@dataclass(frozen=True)
class MarkerTruth:
    """One marker, measured minus true. Rms errors in mm after alignment of the frames.

    seen: share of the frames in which it was found by both cameras. lateral_mm: rms across the
    line of sight, a coordinate; depth_mm along it; sigma ratios: rms error over predicted sigma.
    frequency (sigma with the camera's clock) and amplitude (largest axis) with their sigmas; NaN
    where not measured.
    """

    id: int
    seen: float
    lateral_mm: float
    depth_mm: float
    z_lateral: float
    z_depth: float
    status: str
    f_hz: float
    f_sigma_hz: float
    true_f_hz: float
    amplitude_mm: float
    amplitude_sigma_mm: float
    true_amplitude_mm: float


@dataclass(frozen=True)
class TruthReport:
    """All markers; the misfit of the calibrated frame against the true one (a rigid motion).

    shift_mm, turn_mrad: how far the calibrated left camera's frame lies from the true one, found
    by a rigid fit without scale; everything else is given after that alignment.
    """

    markers: tuple[MarkerTruth, ...]
    shift_mm: float
    turn_mrad: float

    @property
    def lateral_mm(self) -> float:
        """Rms lateral error over all markers, mm."""
        return float(np.sqrt(np.mean([m.lateral_mm**2 for m in self.markers])))

    @property
    def depth_mm(self) -> float:
        """Rms depth error over all markers, mm."""
        return float(np.sqrt(np.mean([m.depth_mm**2 for m in self.markers])))


def compare_with_truth(trial: Trial, truth: Path) -> TruthReport:
    """Compare the trajectory and the lines of a simulated trial with its truth folder."""
    trajectory = trial.trajectory
    if trajectory is None:
        raise trial.need("reconstruct")
    facts = _facts(truth)
    true_xyz = _true_positions(truth, trajectory)
    measured = trajectory.xyz_mm
    if trajectory.method == "continuous":  # frames outside of the fit are flagged, not measured
        measured = np.where((trajectory.state == State.FLAGGED)[..., None], np.nan, measured)
    errors, R, shift = _align(measured, true_xyz)
    sigma = np.sqrt(np.einsum("ij,nmjk,ik->nmi", R, trajectory.covariance_mm2, R))
    rows = [
        _marker(trial, trajectory, m, errors[:, m], sigma[:, m], facts)
        for m in range(trajectory.ids.size)
    ]
    turn = float(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)))
    return TruthReport(tuple(rows), shift, turn * 1e3)


def _facts(truth: Path) -> dict[int, dict[str, Any]]:
    path = truth / "truth.toml"
    if not path.is_file():
        raise InputError(
            f"{truth} holds no truth.", "Only simulated trials have one.", "Simulate a trial."
        )
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    return {int(m["id"]): m for m in table["markers"]}


def _true_positions(truth: Path, trajectory: Trajectory) -> Floats:
    """(N, M, 3) the true positions at the instants of the samples, mm; NaN outside the record."""
    from scipy.interpolate import CubicSpline

    with h5py.File(truth / "truth.h5") as h5:
        t_s, ids, xyz = h5["t_s"][()], h5["ids"][()].tolist(), h5["xyz_mm"][()]
    out = np.full(trajectory.xyz_mm.shape, np.nan)
    for m, marker in enumerate(trajectory.ids.tolist()):
        if marker in ids:
            spline = CubicSpline(t_s, xyz[:, ids.index(marker)], extrapolate=False)
            times = trajectory.sample_t_s[:, m]
            out[:, m] = spline(np.clip(times, t_s[0], t_s[-1]))
    return out


def _align(measured: Floats, true: Floats) -> tuple[Floats, Floats, float]:
    """Errors (N, M, 3) after the rigid fit of the frames, its rotation, and its shift, mm."""
    good = np.isfinite(measured).all(axis=2) & np.isfinite(true).all(axis=2)
    if good.sum() < 3:
        return measured - true, np.eye(3), float("nan")
    a, b = measured[good], true[good]
    R = nearest_rotation((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
    moved = (measured - a.mean(axis=0)) @ R.T + b.mean(axis=0)
    return moved - true, R, float(np.linalg.norm(b.mean(axis=0) - a.mean(axis=0)))


def _marker(
    trial: Trial,
    trajectory: Trajectory,
    m: int,
    error: Floats,
    sigma: Floats,
    facts: dict[int, dict[str, Any]],
) -> MarkerTruth:
    marker = int(trajectory.ids[m])
    fact = facts.get(marker, {})
    row = trial.vibration.row(marker) if trial.vibration else None
    amplitude, amplitude_sigma, true_amplitude = _amplitudes(row, fact)
    return MarkerTruth(
        id=marker,
        seen=float(trajectory.seen[:, m].mean()),
        lateral_mm=_rms(error[:, :2]),
        depth_mm=_rms(error[:, 2]),
        z_lateral=_rms(error[:, :2] / sigma[:, :2]),
        z_depth=_rms(error[:, 2] / sigma[:, 2]),
        status=row.line.status.value if row else "not analysed",
        f_hz=row.line.f_hz if row else float("nan"),
        f_sigma_hz=row.line.f_total_sigma_hz if row else float("nan"),
        true_f_hz=float(fact.get("frequency_hz", float("nan"))),
        amplitude_mm=amplitude,
        amplitude_sigma_mm=amplitude_sigma,
        true_amplitude_mm=true_amplitude,
    )


def _amplitudes(row: MarkerMotion | None, fact: dict[str, Any]) -> tuple[float, float, float]:
    """Measured amplitude, its sigma and the truth on the axis that truly moves most, mm."""
    true = np.array(fact.get("amplitude_mm", [np.nan] * 3), dtype=np.float64)
    if row is None or not np.isfinite(true).any():
        return float("nan"), float("nan"), float("nan")
    axis = int(np.nanargmax(true))
    line = row.line
    return float(line.amplitude[axis]), float(line.amplitude_sigma[axis]), float(true[axis])


def _rms(values: Floats) -> float:
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if good.size else float("nan")
