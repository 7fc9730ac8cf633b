"""State and headline numbers of a trial: the content of ``olivevib show --json``.

What is not known is None. Amplitudes are peak, of the dominant line in the steady phase.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from olivevib.comparison import Comparison
from olivevib.errors import Caution
from olivevib.reconstruction import Trajectory
from olivevib.reconstruction.continuous import decided
from olivevib.signals import State
from olivevib.trial.records.tracks import StoredTracks
from olivevib.trial.stages import StageState
from olivevib.trial.standing import old_results, standing
from olivevib.trial.survey_summary import known, sensor_summary, vibration_summary
from olivevib.vibration import LineStatus, MarkerMotion, largest

if TYPE_CHECKING:
    from olivevib.trial.trial import Trial

SETTLED = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.NONE)  # advice changes nothing
KNOWN = (LineStatus.DIRECT, LineStatus.CONFIRMED, LineStatus.SUPPORTED)


def summary(trial: Trial) -> dict[str, Any]:
    """The whole summary as plain values (str, float, int, list, dict, None)."""
    states = trial.states()
    old = old_results(trial, states)
    return {
        "trial": trial.name,
        "simulated": trial.settings.session.simulated,
        "stages": {name: _stage(s, old.get(name)) for name, s in states.items()},
        "calibration": _calibration(trial),
        "timing": _timing(trial),
        "markers": _markers(trial),
        "vibration": vibration_summary(trial.vibration, trial.trajectory),
        "comparison": _comparison(trial.comparison),
        "comparisons": [sensor_summary(c) for c in trial.comparison],
        "warnings": [_caution(c) for c in (*standing(trial, states), *trial.cautions)],
    }


def _stage(state: StageState, old: str | None) -> dict[str, str | None]:
    """State and reason; ``old``: why what is stored is not of the trial as it is now."""
    return {"state": state.state.value, "reason": state.reason, "old": old}


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
    fit = trial.reconstruction.motion if trial.reconstruction else None
    advice = () if fit is None else fit.next_time
    seen = seen_fractions(trajectory, trial.tracks)
    return [
        {
            "id": int(i),
            "place": trial.settings.markers.place_of(int(i)),
            "seen_fraction": seen[int(i)],
        }
        | _motion(trial.vibration.row(int(i)) if trial.vibration else None, advice)
        for i in trajectory.ids
    ]


def seen_fractions(path: Trajectory, tracks: StoredTracks | None) -> dict[int, float]:
    """Of each marker the share of the frames in which both cameras saw it.

    Of a path at the frames' own times these are its instants; a fitted one has finer instants, so
    there the tracks of the two cameras tell.
    """
    shares = path.seen.mean(axis=0) if len(path.seen) else np.zeros(path.ids.size)
    out = {int(i): float(share) for i, share in zip(path.ids, shares, strict=True)}
    if path.method == "continuous" and tracks is not None:
        right = {t.id: t.state <= State.FLAGGED for t in tracks.right}
        for track in tracks.left:
            if track.id in right and track.id in out:
                left, other = track.state <= State.FLAGGED, right[track.id]
                both = min(left.size, other.size)
                seen = np.count_nonzero(left[:both] & other[:both])
                out[track.id] = float(seen / max(1, left.size))
    return out


def _motion(row: MarkerMotion | None, advice: tuple[str, ...]) -> dict[str, Any]:
    """Line and figures of one marker; a frequency only where it is known.

    advice: what would make the frequency surer another time; it is no reason for a status, and
    where the status could be no surer it would change nothing.
    """
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
            "frequency_next_time": [],
            "amplitude_mm": unknown,
            "amplitude_sigma_mm": unknown,
            "amplitude_largest_mm": None,
            "amplitude_largest_sigma_mm": None,
            "acceleration_rms_m_s2": None,
            "frequency_clock_sigma_hz": None,
            "displacement_pp_mm": None,
            "displacement_pp_sigma_mm": None,
        }
    line, decided = row.line, row.line.status in KNOWN
    size, size_sigma = largest(line)
    proven = bool(np.isfinite(line.amplitude_sigma).any())  # else the motion itself is in doubt
    return {
        "phase": row.phase,
        "frequency_hz": known(line.f_hz) if decided else None,
        "frequency_sigma_hz": known(line.f_sigma_hz),
        "frequency_clock_sigma_hz": known(line.f_clock_sigma_hz) if decided else None,
        "frequency_status": line.status.value,
        "frequency_candidates_hz": [float(f) for f in line.candidates_hz],
        "frequency_probabilities": [float(p) for p in line.probabilities],
        "frequency_reasons": [r for r in line.reasons if r not in advice],
        "frequency_next_time": [] if line.status in SETTLED else list(advice),
        "amplitude_mm": _axes(line.amplitude),
        "amplitude_sigma_mm": _axes(line.amplitude_sigma),
        "amplitude_largest_mm": known(size),
        "amplitude_largest_sigma_mm": known(size_sigma),
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
