"""What ``olivevib show --json`` says of a survey and of every sensor; what is not known is None."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from olivevib.arrays import Floats
from olivevib.comparison import Comparison
from olivevib.reconstruction import Trajectory
from olivevib.vibration import (
    Figures,
    MarkerMotion,
    MarkerSurvey,
    NamedMotion,
    Survey,
    Transmission,
    Turning,
    Vibration,
)

_AXES = ("rms", "peak", "peak_to_peak", "crest", "kurtosis", "noise", "line_amplitude",
         "line_amplitude_sigma", "thd_percent")  # fmt: skip
_RESULTANT = ("mean", "rms", "median", "p95", "p99", "max")
_CLASSES = ("below_50", "below_100", "below_200", "below_300", "more")


def known(value: float | None) -> float | None:
    """The value, or None where it is not a number."""
    return None if value is None or not math.isfinite(value) else float(value)


def vibration_summary(
    result: Vibration | None, path: Trajectory | None = None
) -> dict[str, Any] | None:
    """Phases, figures of every marker and phase, and the survey; None before analyse.

    path: the positions that were analysed. Where they are those of a fitted motion, what a line
    leaves of the curve is no noise of a measurement: the sigma of its positions stands there.
    """
    if result is None:
        return None
    rows = [_row(row) for row in result.table]
    if path is not None and path.method == "continuous":
        for row in rows:
            row["displacement_mm"]["noise"] = axes(_position_sigma(path, row))
            for name in ("velocity_mm_s", "acceleration_m_s2"):
                row[name]["noise"] = axes([None] * 3)
    return {
        "phases": [{"name": p.name, "start_s": p.start_s, "end_s": p.end_s} for p in result.phases],
        "figures": rows,
        "survey": None if result.survey is None else _survey(result.survey),
    }


def _position_sigma(path: Trajectory, row: dict[str, Any]) -> Floats:
    """(3,) rms of the sigma of one marker's positions in the phase of a row, mm."""
    m = int(np.flatnonzero(path.ids == row["id"])[0])
    inside = (path.t_s >= row["start_s"]) & (path.t_s <= row["end_s"]) & path.seen[:, m]
    if not inside.any():
        return np.full(3, np.nan)
    return np.asarray(np.sqrt(np.mean(path.sigma_xyz_mm[inside, m] ** 2, axis=0)))


def axes(values: Any) -> dict[str, float | None]:
    """Three values by axis."""
    return dict(zip("xyz", (None if v is None else known(float(v)) for v in values), strict=True))


def _row(row: MarkerMotion) -> dict[str, Any]:
    line = row.line
    return {
        "id": row.id,
        "phase": row.phase,
        "start_s": row.start_s,
        "end_s": row.end_s,
        "samples": row.samples,
        "line": {
            "frequency_hz": known(line.f_hz) if line.status.value != "none" else None,
            "frequency_sigma_hz": known(line.f_sigma_hz),
            "status": line.status.value,
            "candidates_hz": list(line.candidates_hz),
            "amplitude_mm": axes(line.amplitude),
            "amplitude_sigma_mm": axes(line.amplitude_sigma),
            "phase_rad": axes(line.phase_rad),
            "harmonics_mm": [axes(h) for h in line.harmonics],
        },
        "displacement_mm": _figures(row.displacement),
        "velocity_mm_s": _figures(row.velocity),
        "acceleration_m_s2": _figures(row.acceleration),
    }


def _figures(f: Figures) -> dict[str, Any]:
    out: dict[str, Any] = {name: axes(getattr(f, name)) for name in _AXES}
    out["resultant"] = {name: known(getattr(f, f"resultant_{name}")) for name in _RESULTANT}
    out |= {"extent": known(f.extent), "extent_sigma": known(f.extent_sigma)}
    if f.quantity == "acceleration":
        shares = (known(float(v)) for v in f.class_percent)
        out["class_percent"] = dict(zip(_CLASSES, shares, strict=True))
        out |= {"energy_m2_s3": known(f.energy_m2_s3), "dose_m_s175": known(f.dose_m_s175)}
    return out


def _survey(survey: Survey) -> dict[str, Any]:
    shape = survey.deflection
    return {
        "phase": survey.phase,
        "markers": [_marker(m) for m in survey.markers],
        "transmissibility": [_transmission(t) for t in survey.transmissions],
        "deflection": None
        if shape is None
        else {
            "f_hz": shape.f_hz,
            "markers": [
                {
                    "id": i,
                    "amplitude_mm": axes(np.abs(row)),
                    "phase_deg": axes(np.degrees(np.angle(row))),
                }
                for i, row in zip(shape.ids, shape.shape, strict=True)
            ],
        },
        "motions": [_motion(m) for m in survey.motions],
    }


def _marker(m: MarkerSurvey) -> dict[str, Any]:
    f = m.ridge_true_hz if np.isfinite(m.ridge_true_hz).any() else m.ridge_f_hz
    seen = f[np.isfinite(f)]
    return {
        "id": m.id,
        "orbit": {
            "major_mm": known(m.orbit.major),
            "minor_mm": known(m.orbit.minor),
            "minor_noise_mm": known(m.orbit.minor_noise),
            "straight": m.orbit.straight,
            "sense_may_be_reversed": m.orbit.folded,
            "major_axis": axes(m.orbit.major_axis),
            "normal": axes(m.orbit.normal),
        },
        "precession_deg_s": known(m.precession_deg_s),
        "precession_sigma_deg_s": known(m.precession_sigma_deg_s),
        "decay": {
            "f_hz": known(m.decay_f_hz),
            "f_sigma_hz": known(m.decay_f_sigma_hz),
            "damping_percent": known(100 * m.decay_damping),
            "damping_sigma_percent": known(100 * m.decay_damping_sigma),
            "explained": known(m.decay_share),
        },
        "ridge": {
            "lowest_hz": known(float(seen.min())) if seen.size else None,
            "highest_hz": known(float(seen.max())) if seen.size else None,
            "as_seen": not np.isfinite(m.ridge_true_hz).any(),
        },
        "rotation": None if m.turning is None else _turning(m.turning),
    }


def _turning(t: Turning) -> dict[str, Any]:
    return {
        "frequency_hz": known(t.line.f_hz),
        "status": t.line.status.value,
        "amplitude_mrad": axes(t.line.amplitude),
        "amplitude_sigma_mrad": axes(t.line.amplitude_sigma),
        "rms_mrad": axes(t.rms_mrad),
        "velocity_rad_s": axes(t.velocity_rad_s),
        "acceleration_rad_s2": axes(t.acceleration_rad_s2),
    }


def _transmission(t: Transmission) -> dict[str, Any]:
    r = t.ratio
    return {
        "marker": t.response,
        "reference": t.reference,
        "f_hz": None if r is None else r.f_hz,
        "ratio": None if r is None else known(r.ratio_total),
        "ratio_sigma": None if r is None else known(r.ratio_total_sigma),
        "ratio_db": None if r is None else known(r.decibels),
        "ratio_axes": None if r is None else axes(r.ratio),
        "phase_deg": None if r is None else axes(r.phase_deg),
        "phase_sigma_deg": None if r is None else axes(r.phase_sigma_deg),
        "coherence": axes(t.coherence),
        "segments": t.curve.segments,
    }


def _motion(m: NamedMotion) -> dict[str, Any]:
    asked = {"name": m.name, "relative_to": m.relative_to, "at_mm": list(m.at_mm)}
    return asked | _row(m.row)


def sensor_summary(c: Comparison) -> dict[str, Any]:
    """One sensor against its marker, every number with its sigma."""
    names = (
        *("clock_offset_s", "clock_offset_sigma_s", "clock_drift_ppm", "clock_drift_sigma_ppm"),
        *("gain", "gain_sigma", "rotation_deg", "rotation_sigma_deg", "coherence"),
        *("peak", "second_peak", "rival_offset_s", "rival_turn_deg"),
    )
    return {
        "marker": c.marker,
        "sensor": c.sensor,
        **{name: known(getattr(c, name)) for name in names},
        "ambiguous": c.ambiguous,
        "rotation_matrix": [[known(float(v)) for v in row] for row in c.R_camera_sensor],
        "bias_mm": axes(c.bias_mm),
        "limits_mm": axes(c.limits_mm),
        "limits_sigma_mm": axes(c.limits_sigma_mm),
        "lines": [{k: known(v) for k, v in asdict(line).items()} for line in c.lines],
        "verdict": c.verdict.value,
        "reason": c.reason,
    }
