"""The continuous-time fit in trajectory.h5: everything that evaluating it again needs."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

import numpy as np

from olivevib.files.store import StageFile, Variable
from olivevib.reconstruction.motion.types import (
    TIMING,
    Anchor,
    BranchTable,
    MarkerMotion,
    MotionFit,
    Timing,
)
from olivevib.vibration import LineStatus

GROUP = "fit"
COMPONENTS = "x y z mm, rx ry rz rad"
BRANCH = ("f_hz", "evidence", "probability", "right_offset_s", "row_time_scale")
WHOLE = (
    *("kind", "noise_scale", "noise_source", "chi2", "first_knot_s", "knot_s", "start_s"),
    *("end_s", "shift_s", "psi_first_s", "psi_knot_s", "growth", "amplitude_refused"),
)


def motion_columns(fit: MotionFit) -> dict[str, Variable]:
    """Arrays of the fit: a row a marker or a candidate."""
    m = fit.markers

    def stack(name: str) -> np.ndarray[Any, Any]:
        return np.stack([np.asarray(getattr(one, name), dtype=np.float64) for one in m])

    out = {
        f"branch_{name}": Variable(("branch",), getattr(fit.branches, name), unit, what)
        for name, unit, what in zip(
            BRANCH,
            ("Hz", "1", "1", "s", "1"),
            ("candidate", "log evidence", "probability", "offset needed", "row time needed"),
            strict=True,
        )
    }
    out["timing_covariance"] = Variable(
        ("timing", "timing2"), fit.timing.covariance, "1", f"covariance of {' '.join(TIMING)}"
    )
    out["psi"] = Variable(("phase_knot",), fit.psi, "rad", "phase spline of a wandering speed")
    if m:
        out |= {
            "id": Variable(("fitted",), np.array([one.id for one in m], np.int64), "1", "marker"),
            "pose_rotation": Variable(("fitted", "row", "column"), stack("R0"), "1", "mean pose"),
            "pose_place": Variable(("fitted", "axis"), stack("t0_mm"), "mm", "mean pose"),
            "sway": Variable(("fitted", "knot", "component"), stack("sway"), "1", COMPONENTS),
            "cosine": Variable(
                ("fitted", "harmonic", "component"), stack("cosine"), "1", COMPONENTS
            ),
            "sine": Variable(("fitted", "harmonic", "component"), stack("sine"), "1", COMPONENTS),
            "covariance": Variable(
                ("fitted", "parameter", "parameter2"), stack("covariance"), "1", "of all of them"
            ),
            "blind": Variable(("fitted", "harmonic"), stack("blind"), "1", "may be something else"),
            "seen": Variable(
                ("fitted",), stack("seen_share"), "1", "share of frames, both cameras"
            ),
        }
    return {f"{GROUP}/{name}": variable for name, variable in out.items()}


def motion_text(fit: MotionFit) -> str:
    """Words and single numbers of the fit as JSON; what is not finite as text."""
    timing = {f.name: getattr(fit.timing, f.name) for f in fields(Timing) if f.name != "covariance"}
    whole = {name: getattr(fit, name) for name in WHOLE}
    told = {
        "status": fit.status.value,
        "reasons": list(fit.reasons),
        "next_time": list(fit.next_time),
        "anchor": {f.name: getattr(fit.anchor, f.name) for f in fields(Anchor)},
        "timing": timing | {"row_time_keeps": list(fit.timing.row_time_keeps)},
    }
    return json.dumps(_words(whole | told), ensure_ascii=False)


def motion_from(file: StageFile) -> MotionFit | None:
    """The fit of a stage file, None where there is none."""
    text = str(file.attributes.get("motion", ""))
    if not text:
        return None
    told = _numbers(json.loads(text))

    def get(name: str) -> np.ndarray[Any, Any]:
        return np.asarray(file.variables[f"{GROUP}/{name}"].values)

    timing = told["timing"] | {"row_time_keeps": tuple(told["timing"]["row_time_keeps"])}
    return MotionFit(
        markers=_markers(get) if f"{GROUP}/id" in file.variables else (),
        timing=Timing(covariance=get("timing_covariance"), **timing),
        branches=BranchTable(**{name: get(f"branch_{name}") for name in BRANCH}),
        status=LineStatus(told["status"]),
        reasons=tuple(told["reasons"]),
        next_time=tuple(told["next_time"]),
        anchor=Anchor(**told["anchor"]),
        psi=get("psi"),
        **{name: told[name] for name in WHOLE},
    )


def _markers(get: Any) -> tuple[MarkerMotion, ...]:
    return tuple(
        MarkerMotion(
            id=int(i),
            R0=get("pose_rotation")[k],
            t0_mm=get("pose_place")[k],
            sway=get("sway")[k],
            cosine=get("cosine")[k],
            sine=get("sine")[k],
            covariance=get("covariance")[k],
            blind=tuple(bool(b) for b in get("blind")[k]),
            seen_share=float(get("seen")[k]),
        )
        for k, i in enumerate(get("id"))
    )


def _words(value: Any) -> Any:
    """JSON knows neither infinity nor NaN."""
    if isinstance(value, dict):
        return {k: _words(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_words(v) for v in value]
    if isinstance(value, float) and not np.isfinite(value):
        return {"number": repr(float(value))}
    return value.item() if isinstance(value, np.generic) else value


def _numbers(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {"number"}:
            return float(value["number"])
        return {k: _numbers(v) for k, v in value.items()}
    return [_numbers(v) for v in value] if isinstance(value, list) else value
