"""The tables of the comparison with an accelerometer."""

from __future__ import annotations

import numpy as np

from olivevib.comparison import Comparison
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.words import NOT_KNOWN, measure, number, seconds

Pair = tuple[str, str]  # label, value with unit


def comparison_pairs(content: ReportContent, c: Comparison) -> list[Pair]:
    """Camera against accelerometer, each number with its sigma."""
    return [
        ("marker and sensor", f"{content.marker_name(c.marker)}; {clean(c.sensor, 80)}"),
        ("sensor's stamp less the trial clock", seconds(c.clock_offset_s, c.clock_offset_sigma_s)),
        ("drift of the sensor's clock", measure(c.clock_drift_ppm, "ppm", c.clock_drift_sigma_ppm)),
        ("gain, camera / sensor", measure(c.gain, "", c.gain_sigma)),
        ("rotation, sensor to camera axes", measure(c.rotation_deg, "°", c.rotation_sigma_deg)),
        ("share of the motion that both see", measure(c.coherence, "", digits=4)),
        ("correlation, and at the best rival lag", f"{_r(c.peak)}; {_r(c.second_peak)}"),
        *_limits(c),
        *_rival(c),
    ]


def _limits(c: Comparison) -> list[Pair]:
    """95 % limits of agreement of single positions (Bland, Altman), axis by axis."""
    if not np.isfinite(c.limits_mm).all():
        return []
    pairs = zip("xyz", c.limits_mm, c.limits_sigma_mm, strict=True)
    words = "; ".join(f"{axis} ± {measure(float(v), 'mm', float(s))}" for axis, v, s in pairs)
    return [("camera less sensor, 95 % limits of agreement", words)]


def _rival(c: Comparison) -> list[Pair]:
    if not c.ambiguous:
        return []
    turn = measure(c.rival_turn_deg, "°", digits=3)
    return [("as good: stamp less trial clock, and turn", f"{seconds(c.rival_offset_s)}; {turn}")]


def _r(value: float) -> str:
    return number(value, 4) if np.isfinite(value) else NOT_KNOWN


def comparison_lines(comparison: Comparison) -> list[tuple[str, str, str, str, str]]:
    """Each common line: frequency, camera, sensor, their difference, phase."""
    out = []
    for each in comparison.lines:
        sigma = float(np.hypot(each.optical_sigma_m_s2, each.sensor_sigma_m_s2))
        out.append((
            measure(each.f_hz, "Hz"),
            measure(each.optical_m_s2, "m/s2", each.optical_sigma_m_s2),
            measure(each.sensor_m_s2, "m/s2", each.sensor_sigma_m_s2),
            measure(each.optical_m_s2 - each.sensor_m_s2, "m/s2", sigma),
            measure(each.phase_deg, "°", each.phase_sigma_deg),
        ))  # fmt: skip
    return out
