"""The tables of bodies: rotation of each marker, the shape they move in, motions asked for."""

from __future__ import annotations

import numpy as np

from olivevib.report.content import ReportContent
from olivevib.report.lines import describe
from olivevib.report.words import NOT_KNOWN, measure, triple

Row = tuple[str, ...]


def rotation_rows(content: ReportContent) -> list[Row]:
    """Each marker's turning: frequency, x y z amplitude with sigma, rms, angular acceleration."""
    survey = content.survey
    turned = [] if survey is None else [m for m in survey.markers if m.turning is not None]
    out: list[Row] = []
    for m in turned:
        t = m.turning
        if t is None or t.line.status.value == "none":
            continue
        pairs = zip(t.line.amplitude, t.line.amplitude_sigma, strict=True)
        known = np.isfinite(t.acceleration_rad_s2).all()
        out.append((
            content.marker_name(m.id),
            *(measure(float(a), "mrad", float(s)) for a, s in pairs),
            triple((float(v) for v in t.rms_mrad), "mrad", 3),
            triple((float(v) for v in t.acceleration_rad_s2), "rad/s2", 3) if known else NOT_KNOWN,
            describe(t.line),
        ))  # fmt: skip
    return out


def deflection_rows(content: ReportContent) -> list[Row]:
    """The shape in which the markers move: amplitude and phase on each axis."""
    shape = None if content.survey is None else content.survey.deflection
    if shape is None:
        return []
    return [
        (
            content.marker_name(i),
            triple((float(v) for v in np.abs(row)), shape.unit, 3),
            triple((float(v) for v in np.degrees(np.angle(row))), "°", 3),
        )
        for i, row in zip(shape.ids, shape.shape, strict=True)
    ]


def motion_rows(content: ReportContent) -> list[Row]:
    """Points of bodies and motions against another marker, as trial.toml asks for them."""
    out: list[Row] = []
    for m in () if content.survey is None else content.survey.motions:
        line, pp = m.row.line, m.row.displacement_pp_mm
        pairs = zip(line.amplitude, line.amplitude_sigma, strict=True)
        out.append((
            m.name,
            *(measure(float(a), "mm", float(s)) for a, s in pairs),
            measure(pp, "mm", m.row.displacement_pp_sigma_mm),
            measure(m.row.acceleration_rms_m_s2, "m/s2", digits=3),
            describe(line),
        ))  # fmt: skip
    return out
