"""The survey in vibration.h5: orbits, rotations, decays, ridges, transmissibility, asked ones."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from olivevib.files.store import StageFile, Variable
from olivevib.trial.records.columns import Columns, line_columns, lines_from, padded
from olivevib.vibration import (
    Deflection,
    LineRatio,
    MarkerMotion,
    MarkerResponse,
    MarkerSurvey,
    NamedMotion,
    Orbit,
    Survey,
    Transmission,
    Turning,
)

ORBIT = {"major": "mm", "minor": "mm", "minor_noise": "mm"}
MARKER = {
    "precession_deg_s": "degree/s",
    "precession_sigma_deg_s": "degree/s",
    "decay_f_hz": "Hz",
    "decay_f_sigma_hz": "Hz",
    "decay_damping": "1",
    "decay_damping_sigma": "1",
    "decay_share": "1",
}
RIDGE = {"ridge_t_s": "s", "ridge_f_hz": "Hz", "ridge_true_hz": "Hz", "ridge_rms_mm": "mm"}
TURNING = {"rms_mrad": "mrad", "velocity_rad_s": "rad/s", "acceleration_rad_s2": "rad/s2"}
RATIO = {
    "ratio": "1",
    "ratio_sigma": "1",
    "phase_deg": "degree",
    "phase_sigma_deg": "degree",
}
TOTAL = {"f_hz": "Hz", "ratio_total": "1", "ratio_total_sigma": "1"}
NAN3 = np.full(3, np.nan)

Rows = Callable[[tuple[MarkerMotion, ...], str], Columns]
RowsFrom = Callable[[StageFile, str], tuple[MarkerMotion, ...]]


def survey_columns(survey: Survey, rows: Rows) -> tuple[Columns, dict[str, str | float | int]]:
    """Variables and attributes of a survey; rows: how marker motions become columns."""
    out = {f"survey/{name}": v for name, v in _markers(survey.markers, survey.deflection).items()}
    out |= {f"rotation/{name}": v for name, v in _rotations(survey.markers).items()}
    out |= {f"transmission/{name}": v for name, v in _transmissions(survey.transmissions).items()}
    out |= rows(tuple(m.row for m in survey.motions), "motion")
    facts = {
        "phase": survey.phase,
        "deflection_f_hz": None if survey.deflection is None else survey.deflection.f_hz,
        "motions": [[m.name, m.marker, m.relative_to, m.at_mm] for m in survey.motions],
        "reasons": [m.turning.line.reasons if m.turning else () for m in survey.markers],
        "motion_reasons": [m.row.line.reasons for m in survey.motions],
    }
    return out, {"survey": json.dumps(facts, ensure_ascii=False)}


def _markers(markers: Sequence[MarkerSurvey], shape: Deflection | None) -> Columns:
    dim, axis = ("marker",), ("marker", "axis")
    ids = np.array([m.id for m in markers], np.int64)
    out = {"marker": Variable(dim, ids, "1", "marker id")}
    for name, unit in MARKER.items():
        out[name] = Variable(dim, _of(markers, name), unit, name.replace("_", " "))
    for name, unit in ORBIT.items():
        values = _of([m.orbit for m in markers], name)
        out[f"orbit_{name}"] = Variable(dim, values, unit, f"orbit's {name} semi-axis")
    for name in ("major_axis", "normal"):
        vectors = np.array([getattr(m.orbit, name) for m in markers]).reshape(-1, 3)
        out[f"orbit_{name}"] = Variable(axis, vectors, "1", f"orbit's {name}, unit vector")
    for name in ("straight", "folded"):
        flags = np.array([getattr(m.orbit, name) for m in markers], np.int64)
        out[f"orbit_{name}"] = Variable(dim, flags, "1", f"orbit is {name}", ("no", "yes"))
    for name, unit in RIDGE.items():
        values = padded([getattr(m, name) for m in markers])
        out[name] = Variable(("marker", "window"), values, unit, name.replace("_", " "))
    moved = np.full((len(markers), 3), np.nan + 0j)
    if shape is not None:
        for k, marker in enumerate(shape.ids):
            moved[int(np.flatnonzero(ids == marker)[0])] = shape.shape[k]
    for name, part in (("real", moved.real), ("imaginary", moved.imag)):
        out[f"deflection_{name}"] = Variable(axis, part, "mm", f"deflection shape, {name} part")
    return out


def _of(rows: Sequence[object], name: str) -> np.ndarray[Any, Any]:
    return np.array([getattr(row, name) for row in rows], dtype=np.float64)


def _rotations(markers: Sequence[MarkerSurvey]) -> Columns:
    turned = [m for m in markers if m.turning is not None]
    each = [m.turning for m in turned if m.turning is not None]
    ids = np.array([m.id for m in turned], np.int64)
    out = {"turned": Variable(("turned",), ids, "1", "marker id")}
    for name, unit in TURNING.items():
        values = np.array([getattr(t, name) for t in each]).reshape(-1, 3)
        out[name] = Variable(("turned", "axis"), values, unit, f"rotation, {name}")
    return out | line_columns([t.line for t in each], "turned")


def _transmissions(rows: Sequence[Transmission]) -> Columns:
    dim, axis = ("pair",), ("pair", "axis")
    out = {
        name: Variable(dim, np.array([getattr(r, name) for r in rows], np.int64), "1", "marker id")
        for name in ("response", "reference")
    }
    found = [r.ratio for r in rows]
    for name, unit in TOTAL.items():
        values = np.array([np.nan if r is None else getattr(r, name) for r in found])
        out[f"line_{name}"] = Variable(dim, values, unit, f"common line, {name}")
    for name, unit in RATIO.items():
        vectors = np.array([NAN3 if r is None else getattr(r, name) for r in found]).reshape(-1, 3)
        out[f"line_{name}"] = Variable(axis, vectors, unit, f"common line, {name}")
    coherence = np.array([r.coherence for r in rows]).reshape(-1, 3)
    out["line_coherence"] = Variable(axis, coherence, "1", "coherence at the common line")
    curves = [r.curve for r in rows]
    segments = np.array([c.segments for c in curves], np.int64)
    out["segments"] = Variable(dim, segments, "1", "independent segments")
    frequency = padded([c.f_hz for c in curves])
    out["frequency"] = Variable(("pair", "bin"), frequency, "Hz", "as seen at the frame rate")
    for name, unit, part in _CURVES:
        curve = padded([part(c) for c in curves], 3)
        out[name] = Variable(("pair", "bin", "axis"), curve, unit, f"response, {name}")
    return out


_CURVES: tuple[tuple[str, str, Callable[[MarkerResponse], Any]], ...] = (
    ("h1_real", "1", lambda c: c.h1.real),
    ("h1_imaginary", "1", lambda c: c.h1.imag),
    ("coherence", "1", lambda c: c.coherence),
    ("sigma", "1", lambda c: c.sigma),
)


def survey_from(file: StageFile, rows_from: RowsFrom) -> Survey | None:
    """The survey of a stage file, or None."""
    if "survey" not in file.attributes:
        return None
    facts = json.loads(str(file.attributes["survey"]))
    get = {name: np.asarray(v.values) for name, v in file.variables.items()}
    asked = rows_from(file, "motion")
    return Survey(
        phase=facts["phase"],
        markers=_markers_from(file, get, facts["reasons"]),
        transmissions=_transmissions_from(get),
        deflection=_deflection_from(get, facts["deflection_f_hz"]),
        motions=tuple(
            NamedMotion(name, marker, other, tuple(at), row)
            for (name, marker, other, at), row in zip(facts["motions"], asked, strict=True)
        ),
    )


def _markers_from(
    file: StageFile, get: dict[str, Any], reasons: Sequence[Sequence[str]]
) -> tuple[MarkerSurvey, ...]:
    ids = get["survey/marker"]
    turned = get["rotation/turned"].tolist()
    columns = {
        n.removeprefix("rotation/"): v
        for n, v in file.variables.items()
        if n.startswith("rotation/")
    }
    told = [why for i, why in zip(ids, reasons, strict=True) if int(i) in turned]
    lines = lines_from(columns, "mrad", told)
    out = []
    for k, marker in enumerate(ids.tolist()):
        at = turned.index(marker) if marker in turned else None
        parts: dict[str, Any] = {}
        if at is not None:
            parts = {name: get[f"rotation/{name}"][at] for name in TURNING}
        known = np.isfinite(get["survey/ridge_t_s"][k])
        own: dict[str, Any] = {name: float(get[f"survey/{name}"][k]) for name in MARKER}
        own |= {name: get[f"survey/{name}"][k][known] for name in RIDGE}
        turned_one = None if at is None else Turning(line=lines[at], **parts)
        out.append(MarkerSurvey(id=marker, orbit=_orbit_from(get, k), turning=turned_one, **own))
    return tuple(out)


def _orbit_from(get: dict[str, Any], k: int) -> Orbit:
    own: dict[str, Any] = {name: float(get[f"survey/orbit_{name}"][k]) for name in ORBIT}
    own |= {name: get[f"survey/orbit_{name}"][k] for name in ("major_axis", "normal")}
    own |= {name: bool(get[f"survey/orbit_{name}"][k]) for name in ("straight", "folded")}
    return Orbit(**own, unit="mm")


def _deflection_from(get: dict[str, Any], f_hz: float | None) -> Deflection | None:
    if f_hz is None:
        return None
    shape = get["survey/deflection_real"] + 1j * get["survey/deflection_imaginary"]
    known = np.isfinite(shape).all(axis=1)
    ids = tuple(int(i) for i in get["survey/marker"][known])
    return Deflection(ids, f_hz, shape[known], "mm")


def _transmissions_from(get: dict[str, Any]) -> tuple[Transmission, ...]:
    get = {n.removeprefix("transmission/"): v for n, v in get.items() if "transmission/" in n}
    out = []
    for k in range(len(get["response"])):
        ratio = None
        if np.isfinite(get["line_f_hz"][k]):
            own: dict[str, Any] = {name: float(get[f"line_{name}"][k]) for name in TOTAL}
            ratio = LineRatio(**own, **{name: get[f"line_{name}"][k] for name in RATIO})
        known = np.isfinite(get["frequency"][k])
        curve = MarkerResponse(
            f_hz=get["frequency"][k][known],
            h1=get["h1_real"][k][known] + 1j * get["h1_imaginary"][k][known],
            coherence=get["coherence"][k][known],
            sigma=get["sigma"][k][known],
            segments=int(get["segments"][k]),
        )
        pair = int(get["response"][k]), int(get["reference"][k])
        out.append(Transmission(*pair, ratio, get["line_coherence"][k], curve))
    return tuple(out)
