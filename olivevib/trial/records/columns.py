"""Rows of frozen values as columns of variables, and back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from olivevib.files.store import Variable
from olivevib.vibration import Figures, Line, LineStatus

STATUS = tuple(s.value for s in LineStatus)
NOT_COLUMNS = ("quantity", "unit")
Columns = dict[str, Variable]


def padded(rows: Sequence[Any], *rest: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Rows of different length as one array (R, longest, *rest), NaN beyond the end of each."""
    longest = max((len(r) for r in rows), default=0)
    out = np.full((len(rows), longest, *rest), np.nan)
    for k, row in enumerate(rows):
        if len(row):
            out[k, : len(row)] = row
    return out


def unpadded(row: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The part of a padded row before the NaN."""
    good = np.isfinite(row).any(axis=tuple(range(1, row.ndim)))
    return row[: int(good.sum())]


def line_columns(lines: Sequence[Line], dim: str) -> Columns:
    """The lines as columns along ``dim``."""
    unit = lines[0].unit if lines else "1"
    axis = (dim, "axis")
    status = np.array([STATUS.index(line.status.value) for line in lines], np.int64)
    return {
        "line_f": Variable((dim,), np.array([x.f_hz for x in lines]), "Hz", "fitted frequency"),
        "line_f_sigma": Variable((dim,), np.array([x.f_sigma_hz for x in lines]), "Hz", "sigma"),
        "line_status": Variable((dim,), status, "1", "what is known of the frequency", STATUS),
        "line_candidates": Variable(
            (dim, "candidate"), padded([x.candidates_hz for x in lines]), "Hz", "candidates"
        ),
        "line_probabilities": Variable(
            (dim, "weighed"), padded([x.probabilities for x in lines]), "1", "of the candidates"
        ),
        "line_amplitude": Variable(axis, _stack(lines, "amplitude", 3), unit, "peak amplitude"),
        "line_amplitude_sigma": Variable(axis, _stack(lines, "amplitude_sigma", 3), unit, "sigma"),
        "line_phase": Variable(axis, _stack(lines, "phase_rad", 3), "rad", "phase at line_t_ref"),
        "line_t_ref": Variable((dim,), np.array([x.t_ref_s for x in lines]), "s", "zero of phase"),
        "line_harmonics": Variable(
            (dim, "harmonic", "axis"), padded([x.harmonics for x in lines], 3), unit, "at 2f, 3f"
        ),
    }


def _stack(rows: Sequence[Any], name: str, *rest: int) -> np.ndarray[Any, Any]:
    values = [getattr(row, name) for row in rows]
    return np.stack(values) if values else np.empty((0, *rest))


def lines_from(columns: Columns, unit: str, reasons: Sequence[Sequence[str]]) -> list[Line]:
    """The lines of ``line_columns``."""
    get = {name: np.asarray(v.values) for name, v in columns.items() if name.startswith("line_")}
    return [
        Line(
            f_hz=float(get["line_f"][k]),
            f_sigma_hz=float(get["line_f_sigma"][k]),
            status=LineStatus(STATUS[int(get["line_status"][k])]),
            candidates_hz=tuple(unpadded(get["line_candidates"][k]).tolist()),
            amplitude=get["line_amplitude"][k],
            amplitude_sigma=get["line_amplitude_sigma"][k],
            phase_rad=get["line_phase"][k],
            t_ref_s=float(get["line_t_ref"][k]),
            unit=unit,
            harmonics=unpadded(get["line_harmonics"][k]),
            probabilities=tuple(unpadded(get["line_probabilities"][k]).tolist()),
            reasons=tuple(reasons[k]),
        )
        for k in range(len(get["line_f"]))
    ]


def figure_columns(rows: Sequence[Figures], dim: str) -> Columns:
    """Figures of one quantity as columns along ``dim``, under their own names."""
    out: Columns = {}
    for field in fields(Figures):
        if field.name in NOT_COLUMNS:
            continue
        values = [np.asarray(getattr(row, field.name), dtype=np.float64) for row in rows]
        array = np.stack(values) if values else np.empty((0,))
        inner = {0: (), 3: ("axis",), 5: ("class",)}[array.shape[1] if array.ndim == 2 else 0]
        unit = _unit(field.name, rows[0].unit if rows else "1")
        out[field.name] = Variable((dim, *inner), array, unit, field.name.replace("_", " "))
    return out


def _unit(name: str, unit: str) -> str:
    own = {"crest": "1", "kurtosis": "1", "thd_percent": "percent", "class_percent": "percent"}
    own |= {"energy_m2_s3": "m2 s-3", "dose_m_s175": "m s-1.75"}
    return own.get(name, unit)


def figures_from(columns: Columns, quantity: str, unit: str) -> list[Figures]:
    """The figures of ``figure_columns``."""
    names = [f.name for f in fields(Figures) if f.name not in NOT_COLUMNS]
    arrays = {name: np.asarray(columns[name].values) for name in names}
    count = len(arrays["rms"])
    rows: list[dict[str, Any]] = [
        {n: a[k] if a.ndim > 1 else float(a[k]) for n, a in arrays.items()} for k in range(count)
    ]
    return [Figures(quantity=quantity, unit=unit, **row) for row in rows]


def texts(rows: Sequence[Sequence[str]]) -> str:
    """Words of each row as JSON."""
    return json.dumps([list(row) for row in rows], ensure_ascii=False)
