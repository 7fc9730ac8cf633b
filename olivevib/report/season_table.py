"""One tidy table of many trials: a row a marker and phase, the typed beside the measured."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from olivevib.files.exports.text import spreadsheet_cell
from olivevib.report.lines import KNOWN
from olivevib.report.transfer import in_phase
from olivevib.vibration import Line, MarkerMotion

if TYPE_CHECKING:
    from olivevib.trial import Trial

Row = Mapping[str, Any]
_TYPED: tuple[tuple[str, str, str], ...] = (
    ("date", "session", "date"),
    ("site", "session", "place"),
    ("operator", "session", "operator"),
    ("tree", "tree", "id"),
    ("cultivar", "tree", "cultivar"),
    ("training", "tree", "training"),
    ("trunk_diameter_mm", "tree", "trunk_diameter_mm"),
    ("clamp_height_mm", "tree", "clamp_height_mm"),
    ("machine", "machine", "make"),
    ("machine_type", "machine", "type"),
    ("set_frequency_hz", "machine", "set_frequency_hz"),
    ("shaking_time_s", "machine", "shaking_time_s"),
    ("removed_kg", "outcome", "removed_kg"),
    ("left_kg", "outcome", "left_kg"),
    ("damage", "outcome", "damage"),
)
_NUMBERS = ("trunk_diameter_mm", "clamp_height_mm", "set_frequency_hz", "shaking_time_s",
            "removed_kg", "left_kg")  # fmt: skip
COLUMNS: tuple[str, ...] = (
    "trial", "simulated", *(name for name, _, _ in _TYPED), "removed_percent",
    "marker", "place", "branch_diameter_mm", "distance_mm", "seen_fraction",
    "phase", "headline", "start_s", "end_s", "samples",
    "status", "f_hz", "f_sigma_hz", "candidates_hz",
    "amplitude_x_mm", "amplitude_y_mm", "amplitude_z_mm",
    "amplitude_sigma_x_mm", "amplitude_sigma_y_mm", "amplitude_sigma_z_mm",
    "displacement_rms_x_mm", "displacement_rms_y_mm", "displacement_rms_z_mm",
    "displacement_pp_mm", "displacement_pp_sigma_mm", "velocity_rms_mm_s", "acceleration_rms_m_s2",
    "acceleration_p95_m_s2", "acceleration_max_m_s2", "dose_m_s175",
    "reference_marker", "transmissibility", "transmissibility_sigma",
    "sensor", "verdict", "gain", "gain_sigma",
)  # fmt: skip
INTEGERS = ("marker", "samples", "reference_marker")
FLAGS = ("simulated", "headline")
WORDS = ("trial", "date", "site", "operator", "tree", "cultivar", "training", "machine",
         "machine_type", "damage", "place", "phase", "status", "candidates_hz", "sensor",
         "verdict")  # fmt: skip


def trial_rows(trial: Trial) -> list[dict[str, Any]]:
    """The rows of one trial, by marker and phase in order; None where a value is not known.

    ``headline``: the phase whose lines the report quotes. f_hz stands only where the frequency is
    known; else candidates_hz lists what remains possible. Transmissibility is against the
    reference marker in the same phase.
    """
    vibration = trial.vibration
    if vibration is None:
        return []
    typed, ratios = _typed(trial), _ratios(trial)
    markers = {m.id: m for m in trial.settings.markers.marker}
    sensors = {c.marker: c for c in trial.comparison}
    seen = _seen(trial)
    rows = []
    for motion in vibration.table:
        marker, sensor = markers.get(motion.id), sensors.get(motion.id)
        row = typed | {
            "marker": motion.id,
            "place": (marker.place if marker else None) or None,
            "branch_diameter_mm": marker.branch_diameter_mm if marker else None,
            "distance_mm": marker.distance_mm if marker else None,
            "seen_fraction": seen.get(motion.id),
            "headline": motion.phase == vibration.spectrum_phase,
            "sensor": sensor.sensor if sensor else None,
            "verdict": str(sensor.verdict) if sensor else None,
            "gain": _known(sensor.gain) if sensor else None,
            "gain_sigma": _known(sensor.gain_sigma) if sensor else None,
        }
        reference, ratio, sigma = ratios.get((motion.id, motion.phase), (None, None, None))
        row |= {"reference_marker": reference, "transmissibility": ratio}
        row |= {"transmissibility_sigma": sigma} | _motion(motion)
        rows.append({name: row.get(name) for name in COLUMNS})
    return rows


def _typed(trial: Trial) -> dict[str, Any]:
    out: dict[str, Any] = {"trial": trial.name, "simulated": trial.settings.session.simulated}
    for name, section, key in _TYPED:
        value = getattr(getattr(trial.settings, section), key)
        if name in _NUMBERS:
            out[name] = None if value is None else float(value)
        else:
            out[name] = str(value) if value not in (None, "") else None
    removed, left = out["removed_kg"], out["left_kg"]
    total = None if removed is None or left is None else removed + left
    out["removed_percent"] = 100 * removed / total if total else None
    return out


def _seen(trial: Trial) -> dict[int, float]:
    path = trial.trajectory
    if path is None or not path.t_s.size:
        return {}
    return {int(i): float(s) for i, s in zip(path.ids, path.seen.mean(axis=0), strict=True)}


def _ratios(trial: Trial) -> dict[tuple[int, str], tuple[int, float | None, float | None]]:
    """(marker, phase) to reference marker, transmissibility and its sigma."""
    assert trial.vibration is not None
    survey = trial.vibration.survey
    if survey is None or not survey.transmissions:
        return {}
    by_phase: dict[str, dict[int, Line]] = {}
    for row in trial.vibration.table:
        by_phase.setdefault(row.phase, {})[row.id] = row.line
    out = {}
    for phase, lines in by_phase.items():
        found = in_phase(lines, survey.transmissions[0].reference)
        for marker, r in found.ratios.items() if found else ():
            assert found is not None
            ratio = _known(r.ratio_total), _known(r.ratio_total_sigma)
            out[marker, phase] = (found.reference, *ratio)
    return out


def _motion(row: MarkerMotion) -> dict[str, Any]:
    line, d, a = row.line, row.displacement, row.acceleration
    decided = line.status in KNOWN
    out: dict[str, Any] = {
        "phase": row.phase,
        "start_s": row.start_s,
        "end_s": row.end_s,
        "samples": row.samples,
        "status": str(line.status),
        "f_hz": _known(line.f_hz) if decided else None,
        "f_sigma_hz": _known(line.f_sigma_hz),
        "candidates_hz": " ".join(f"{f:.4f}" for f in line.candidates_hz) or None,
        "displacement_pp_mm": _known(d.extent),
        "displacement_pp_sigma_mm": _known(d.extent_sigma),
        "velocity_rms_mm_s": _known(row.velocity.resultant_rms),
        "acceleration_rms_m_s2": _known(a.resultant_rms),
        "acceleration_p95_m_s2": _known(a.resultant_p95),
        "acceleration_max_m_s2": _known(a.resultant_max),
        "dose_m_s175": _known(a.dose_m_s175),
    }
    for k, axis in enumerate("xyz"):
        out[f"amplitude_{axis}_mm"] = _known(line.amplitude[k])
        out[f"amplitude_sigma_{axis}_mm"] = _known(line.amplitude_sigma[k])
        out[f"displacement_rms_{axis}_mm"] = _known(d.rms[k])
    return out


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def table_csv(rows: Iterable[Row]) -> str:
    """The table as CSV: UTF-8, comma, decimal point, LF; an empty cell is not known."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow([_cell(name, row[name]) for name in COLUMNS])
    return out.getvalue()


def _cell(name: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if name in WORDS:
        safe = spreadsheet_cell(str(value))
        return safe[1:-1].replace('""', '"') if safe.startswith('"') else safe
    return str(value) if name in INTEGERS else f"{value:.9g}"


def table_columns(rows: Sequence[Row]) -> dict[str, Any]:
    """The table by column, typed: float64 with NaN, nullable Int64, bool, words (pandas arrays)."""
    import pandas as pd

    kinds: dict[str, Any] = dict.fromkeys(WORDS, "string") | dict.fromkeys(INTEGERS, "Int64")
    kinds |= dict.fromkeys(FLAGS, "boolean")
    return {
        name: pd.array([row[name] for row in rows], dtype=kinds.get(name, "Float64"))
        for name in COLUMNS
    }


def season_table(trials: Sequence[Trial]) -> Any:
    """The table of many trials as a pandas.DataFrame: one row a marker and phase."""
    import pandas as pd

    rows = [row for trial in trials for row in trial_rows(trial)]
    return pd.DataFrame(table_columns(rows))
