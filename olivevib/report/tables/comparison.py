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
        ("gain, camera / sensor", _gain(c)),
        ("rotation, sensor to camera axes", measure(c.rotation_deg, "°", c.rotation_sigma_deg)),
        ("correlation of what both see", _r(float(np.sqrt(c.coherence)))),
        ("share of the motion that both see (its square)", _r(c.coherence)),
        (
            "likeness in the first search: best lag; best rival",
            f"{_r(c.peak)}; {_r(c.second_peak)}",
        ),
        *_limits(c),
        *_rival(c),
    ]


def _gain(c: Comparison) -> str:
    """The gain, and by how many per cent it is off one, as the verdict says it."""
    if not np.isfinite(c.gain):
        return NOT_KNOWN
    off = measure(100 * (c.gain - 1), "%", 100 * c.gain_sigma)
    return f"{measure(c.gain, '', c.gain_sigma)} ({off})"


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


def comparison_lines(
    content: ReportContent, comparison: Comparison
) -> tuple[list[tuple[str, str, str, str, str]], str]:
    """Each line that both may see: frequency, camera, sensor, difference, phase; and what is left.

    A path that was fitted holds one line and its harmonics. Of others it says nothing: those are
    left out of the rows and named in words. ± of the camera: its noise and the sigma of the gain.
    """
    out, left = [], []
    for each in comparison.lines:
        if not _held(content, comparison, each.f_hz):
            size = measure(each.sensor_m_s2, "m/s2", each.sensor_sigma_m_s2)
            left.append(f"{number(each.f_hz, 4)}\u00a0Hz ({size})")
            continue
        scale = comparison.gain_sigma if np.isfinite(comparison.gain_sigma) else 0.0
        camera = float(np.hypot(each.optical_sigma_m_s2, scale * each.optical_m_s2))
        sigma = float(np.hypot(camera, each.sensor_sigma_m_s2))
        out.append((
            measure(each.f_hz, "Hz"),
            measure(each.optical_m_s2, "m/s2", camera),
            measure(each.sensor_m_s2, "m/s2", each.sensor_sigma_m_s2),
            measure(each.optical_m_s2 - each.sensor_m_s2, "m/s2", sigma),
            measure(each.phase_deg, "°", each.phase_sigma_deg),
        ))  # fmt: skip
    words = _LEFT.format(lines="; ".join(left)) if left else ""
    return out, words


_LEFT = (
    "Left out, as the sensor sees them: {lines}. The camera's path was fitted at one frequency with"
    " its harmonics, so it holds no other line, however strong: of these the camera says nothing."
)


def _held(content: ReportContent, c: Comparison, f_hz: float) -> bool:
    """Whether the path that was compared can hold a line of that frequency."""
    line, spectrum = content.lines().get(c.marker), content.displacement
    if not content.continuous or line is None or spectrum is None or not np.isfinite(line.f_hz):
        return True
    order = round(f_hz / line.f_hz)
    known = 1 <= order <= 1 + len(line.harmonics)
    return known and abs(f_hz - order * line.f_hz) < spectrum.resolution_hz
