"""vibration.h5: spectra, the dominant lines with their status, one row a marker and phase."""

from __future__ import annotations

import json

import numpy as np

from olivevib.files.store import StageFile, Variable
from olivevib.trial.records.cautions import cautions_from, cautions_text
from olivevib.trial.records.columns import (
    Columns,
    figure_columns,
    figures_from,
    line_columns,
    lines_from,
    padded,
    texts,
)
from olivevib.trial.records.survey import survey_columns, survey_from
from olivevib.trial.stages import BY_NAME, Fingerprint
from olivevib.vibration import CandidateMotion, MarkerMotion, Phase, Spectrum, Vibration

STAGE = BY_NAME["analyse"]
QUANTITIES = {"displacement": "mm", "velocity": "mm/s", "acceleration": "m/s2"}
CANDIDATE = {
    "displacement_mm": "mm",
    "velocity_mm_s": "mm/s",
    "acceleration_m_s2": "m/s2",
}


def vibration_file(result: Vibration, now: Fingerprint) -> StageFile:
    """The stage file of an analysis."""
    variables: Columns = {}
    attributes: dict[str, str | float | int] = {
        "spectrum_phase": result.spectrum_phase,
        "phases": json.dumps([[p.name, p.start_s, p.end_s] for p in result.phases]),
        "cautions": cautions_text(result.cautions),
        "table_reasons": texts([row.line.reasons for row in result.table]),
    }
    for quantity, spectrum in result.spectra.items():
        variables |= _grouped(quantity, _spectrum(spectrum))
        attributes[f"{quantity}_reasons"] = texts([line.reasons for line in spectrum.lines])
        attributes[f"{quantity}_facts"] = json.dumps(
            [
                spectrum.unit,
                spectrum.window,
                spectrum.resolution_hz,
                spectrum.enbw_bins,
                spectrum.phase,
                spectrum.start_s,
                spectrum.end_s,
            ]
        )
    variables |= _rows(result.table, "table")
    if result.survey is not None:
        more, facts = survey_columns(result.survey, _rows)
        variables, attributes = variables | more, attributes | facts
    return StageFile(
        stage=STAGE.name,
        schema=STAGE.schema,
        settings=dict(now.settings),
        inputs=dict(now.inputs),
        variables=variables,
        attributes=attributes,
    )


def _rows(rows: tuple[MarkerMotion, ...], group: str) -> Columns:
    """Rows of one marker and phase each: their lines in ``group``, their figures in three more."""
    out = _grouped(group, _table(rows, "row" if group == "table" else f"{group}_row"))
    for quantity in QUANTITIES:
        figures = [getattr(row, quantity) for row in rows]
        columns = figure_columns(figures, "row" if group == "table" else f"{group}_row")
        out |= _grouped(f"{group}_{quantity}", columns)
    return out


def _grouped(group: str, columns: Columns) -> Columns:
    return {f"{group}/{name}": variable for name, variable in columns.items()}


def _group(file: StageFile, group: str) -> Columns:
    start = f"{group}/"
    return {n.removeprefix(start): v for n, v in file.variables.items() if n.startswith(start)}


def _spectrum(spectrum: Spectrum) -> Columns:
    fma = ("frequency", "marker", "axis")
    unit = spectrum.unit
    return {
        "frequency": Variable(("frequency",), spectrum.f_hz, "Hz", "frequency"),
        "marker": Variable(("marker",), spectrum.ids, "1", "marker id"),
        "amplitude": Variable(fma, spectrum.amplitude, unit, "one-sided peak amplitude"),
        "psd": Variable(fma, spectrum.psd, f"({unit})2/Hz", "one-sided power spectral density"),
    } | line_columns(spectrum.lines, "marker")


def _table(rows: tuple[MarkerMotion, ...], dim: str) -> Columns:
    words = tuple(dict.fromkeys(row.phase for row in rows))
    phase = np.array([words.index(row.phase) for row in rows], np.int64)
    out = {
        dim: Variable((dim,), np.arange(len(rows)), "1", "row"),
        "id": Variable((dim,), np.array([r.id for r in rows], np.int64), "1", "marker id"),
        "phase": Variable((dim,), phase, "1", "phase of the trial", words),
        "start": Variable((dim,), np.array([r.start_s for r in rows]), "s", "start of the phase"),
        "end": Variable((dim,), np.array([r.end_s for r in rows]), "s", "end of the phase"),
        "samples": Variable((dim,), np.array([r.samples for r in rows], np.int64), "1", "used"),
    }
    for name, unit in CANDIDATE.items():
        values = padded([[getattr(c, name) for c in row.candidates] for row in rows], 3)
        out[f"candidate_{name}"] = Variable((dim, "candidate", "axis"), values, unit, name)
    rms = padded([[c.acceleration_rms_m_s2 for c in row.candidates] for row in rows])
    out["candidate_acceleration_rms"] = Variable((dim, "candidate"), rms, "m/s2", "total RMS")
    return out | line_columns([row.line for row in rows], dim)


def vibration_from(file: StageFile) -> Vibration:
    """The analysis of a stage file."""
    phases = json.loads(str(file.attributes["phases"]))
    return Vibration(
        phases=tuple(Phase(name, start, end) for name, start, end in phases),
        spectra={q: _spectrum_from(file, q) for q in QUANTITIES},
        table=_table_from(file, "table", str(file.attributes["table_reasons"])),
        spectrum_phase=str(file.attributes["spectrum_phase"]),
        cautions=cautions_from(file.attributes["cautions"]),
        survey=survey_from(file, _motions_from),
    )


def _spectrum_from(file: StageFile, quantity: str) -> Spectrum:
    columns = _group(file, quantity)
    unit, window, step, enbw, phase, start, end = json.loads(
        str(file.attributes[f"{quantity}_facts"])
    )
    reasons = json.loads(str(file.attributes[f"{quantity}_reasons"]))
    return Spectrum(
        f_hz=np.asarray(columns["frequency"].values),
        ids=np.asarray(columns["marker"].values).astype(np.int64),
        amplitude=np.asarray(columns["amplitude"].values),
        psd=np.asarray(columns["psd"].values),
        quantity=quantity,
        unit=unit,
        window=window,
        resolution_hz=step,
        enbw_bins=enbw,
        lines=tuple(lines_from(columns, unit, reasons)),
        phase=phase,
        start_s=start,
        end_s=end,
    )


def _motions_from(file: StageFile, group: str) -> tuple[MarkerMotion, ...]:
    reasons = json.loads(str(file.attributes["survey"]))["motion_reasons"]
    return _table_from(file, group, json.dumps(reasons)) if reasons else ()


def _table_from(file: StageFile, group: str, reasons: str) -> tuple[MarkerMotion, ...]:
    columns = _group(file, group)
    words = columns["phase"].flag_words
    lines = lines_from(columns, "mm", json.loads(reasons))
    figures = {
        q: figures_from(_group(file, f"{group}_{q}"), q, unit) for q, unit in QUANTITIES.items()
    }
    get = {name: np.asarray(v.values) for name, v in columns.items()}
    return tuple(
        MarkerMotion(
            id=int(get["id"][k]),
            phase=words[int(get["phase"][k])],
            start_s=float(get["start"][k]),
            end_s=float(get["end"][k]),
            samples=int(get["samples"][k]),
            line=lines[k],
            displacement=figures["displacement"][k],
            velocity=figures["velocity"][k],
            acceleration=figures["acceleration"][k],
            candidates=_candidates(get, k, lines[k].candidates_hz),
        )
        for k in range(len(get["id"]))
    )


def _candidates(
    get: dict[str, np.ndarray], row: int, f_hz: tuple[float, ...]
) -> tuple[CandidateMotion, ...]:
    return tuple(
        CandidateMotion(
            f_hz=f,
            acceleration_rms_m_s2=float(get["candidate_acceleration_rms"][row, k]),
            **{name: get[f"candidate_{name}"][row, k] for name in CANDIDATE},
        )
        for k, f in enumerate(f_hz)
    )
