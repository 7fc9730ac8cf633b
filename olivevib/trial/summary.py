"""State and headline numbers of a trial: the content of ``olivevib show --json``.

What is not known is None. Amplitudes are peak, of the dominant line in the steady phase.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from olivevib.comparison import Comparison
from olivevib.errors import Caution
from olivevib.reconstruction.continuous import decided
from olivevib.trial.survey_summary import known, sensor_summary, vibration_summary
from olivevib.vibration import LineStatus, MarkerMotion

if TYPE_CHECKING:
    from olivevib.trial.trial import Trial

KNOWN = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)


def summary(trial: Trial) -> dict[str, Any]:
    """The whole summary as plain values (str, float, int, list, dict, None)."""
    return {
        "trial": trial.name,
        "simulated": trial.settings.session.simulated,
        "stages": {
            name: {"state": s.state.value, "reason": s.reason} for name, s in trial.states().items()
        },
        "calibration": _calibration(trial),
        "timing": _timing(trial),
        "markers": _markers(trial),
        "vibration": vibration_summary(trial.vibration),
        "comparison": _comparison(trial.comparison),
        "comparisons": [sensor_summary(c) for c in trial.comparison],
        "warnings": [_caution(c) for c in trial.cautions],
    }


def _caution(caution: Caution) -> dict[str, str]:
    return {"code": caution.code, "text": caution.text, "remedy": caution.remedy}


def _calibration(trial: Trial) -> dict[str, Any]:
    rig, stored = trial.rig, trial.calibration
    out: dict[str, Any] = {}
    for side in ("left", "right"):
        lens = getattr(rig, side).lens if rig else [None] * 4
        out[side] = dict(zip(("fx", "fy", "cx", "cy"), (known(v) for v in lens[:4]), strict=True))
        out[side]["rms_px"] = known(getattr(stored, f"rms_{side}_px")) if stored else None
    out["baseline_mm"] = rig.baseline_mm if rig else None
    for name in ("epipolar_rms_px", "holdout_rms_mm", "holdout_rms_percent"):
        out[name] = known(getattr(stored, name)) if stored else None
    out["verdict"] = stored.verdict if stored else None
    return out


def _timing(trial: Trial) -> dict[str, Any]:
    clock = trial.reconstruction.clock if trial.reconstruction else None
    unknown = clock is None or clock.source == "unknown"
    out: dict[str, Any] = {
        "right_offset_s": None if clock is None or unknown else clock.right_offset_s,
        "right_offset_sigma_s": None if clock is None else known(clock.right_offset_sigma_s),
        "right_offset_source": clock.source if clock else None,
        "reference_row": clock.reference_row if clock else None,
    }
    for side in ("left", "right"):
        camera = trial.tracks.cameras[side] if trial.tracks else None
        told = camera is not None and camera.row_time_source != "unknown"
        out[side] = {
            "row_time_s": camera.row_time_s if camera and told else None,
            "row_time_sigma_s": known(camera.row_time_sigma_s) if camera else None,
            "source": camera.row_time_source if camera else None,
            "frame_rate_hz": camera.rate_hz if camera else None,
            "stamp_jitter_s": camera.jitter_s if camera else None,
            "dropped": camera.dropped if camera else None,
            "frames": camera.frames if camera else None,
        } | _fitted_row_time(trial, side)
    return out


def _fitted_row_time(trial: Trial, side: str) -> dict[str, Any]:
    """The row time as the trial itself shows it, where the fit decided; its anchor beside it."""
    fit = trial.reconstruction.motion if trial.reconstruction else None
    if fit is None or not decided(fit):
        return {}
    name = f"{side}_row_time_s"
    sigma = fit.timing.sigma(name)
    if sigma == 0 or fit.anchor.row_time_source == "global":  # there is none to be found
        return {}
    return {
        "row_time_s": getattr(fit.timing, name),
        "row_time_sigma_s": known(sigma),
        "source": f"fit, from {fit.anchor.row_time_source}",
    }


def _markers(trial: Trial) -> list[dict[str, Any]]:
    trajectory = trial.trajectory
    if trajectory is None:
        return []
    seen = trajectory.seen
    return [
        {
            "id": int(i),
            "place": trial.settings.markers.place_of(int(i)),
            "seen_fraction": float(seen[:, k].mean()) if len(seen) else 0.0,
        }
        | _motion(trial.vibration.row(int(i)) if trial.vibration else None)
        for k, i in enumerate(trajectory.ids)
    ]


def _motion(row: MarkerMotion | None) -> dict[str, Any]:
    """Line and figures of one marker; a frequency only where it is known."""
    if row is None:
        unknown = dict.fromkeys("xyz")
        return {
            "phase": None,
            "frequency_hz": None,
            "frequency_sigma_hz": None,
            "frequency_status": None,
            "frequency_candidates_hz": [],
            "frequency_probabilities": [],
            "frequency_reasons": [],
            "amplitude_mm": unknown,
            "amplitude_sigma_mm": unknown,
            "acceleration_rms_m_s2": None,
            "frequency_clock_sigma_hz": None,
            "displacement_pp_mm": None,
            "displacement_pp_sigma_mm": None,
        }
    line, decided = row.line, row.line.status in KNOWN
    proven = bool(np.isfinite(line.amplitude_sigma).any())  # else the motion itself is in doubt
    return {
        "phase": row.phase,
        "frequency_hz": known(line.f_hz) if decided else None,
        "frequency_sigma_hz": known(line.f_sigma_hz),
        "frequency_clock_sigma_hz": known(line.f_clock_sigma_hz) if decided else None,
        "frequency_status": line.status.value,
        "frequency_candidates_hz": [float(f) for f in line.candidates_hz],
        "frequency_probabilities": [float(p) for p in line.probabilities],
        "frequency_reasons": list(line.reasons),
        "amplitude_mm": _axes(line.amplitude),
        "amplitude_sigma_mm": _axes(line.amplitude_sigma),
        "acceleration_rms_m_s2": known(row.acceleration_rms_m_s2),
        "displacement_pp_mm": known(row.displacement_pp_mm),
        "displacement_pp_sigma_mm": known(row.displacement_pp_sigma_mm) if proven else None,
    }


def _axes(values: np.ndarray[Any, Any]) -> dict[str, float | None]:
    return dict(zip("xyz", (known(float(v)) for v in values), strict=True))


def _comparison(results: tuple[Comparison, ...]) -> dict[str, Any]:
    """The first sensor's comparison; all None where there is none."""
    one = results[0] if results else None
    names = (
        *("clock_offset_s", "clock_offset_sigma_s", "clock_drift_ppm"),
        *("gain", "rotation_deg", "coherence"),
    )
    out: dict[str, Any] = {name: known(getattr(one, name)) if one else None for name in names}
    out["verdict"] = one.verdict.value if one else None
    out["reason"] = one.reason if one else None
    return out
