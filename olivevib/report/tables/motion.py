"""The tables of how the tree moves: transmissibility, free decay, orbits, further figures."""

from __future__ import annotations

import numpy as np

from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.words import NOT_KNOWN, measure, number, triple
from olivevib.vibration import Figures, largest

Row = tuple[str, ...]


def transmissibility_rows(content: ReportContent) -> list[Row]:
    """Each marker against the trunk: all axes in % with sigma and in dB, single axes, phases."""
    found = content.transmissibility
    if found is None:
        return []
    return [
        (
            content.marker_name(marker_id),
            measure(100 * r.ratio_total, "%", 100 * r.ratio_total_sigma),
            measure(20 * np.log10(r.ratio_total), "dB", _db(r.ratio_total_sigma / r.ratio_total)),
            *(measure(100 * v, "%", 100 * s) for v, s in zip(r.ratio, r.ratio_sigma, strict=True)),
            triple((float(p) for p in r.phase_deg), "°", 3),
        )
        for marker_id, r in found.ratios.items()
    ]


def _db(relative: float) -> float:
    """Sigma in dB of a relative sigma of an amplitude."""
    return float(20 / np.log(10) * relative)


def decay_rows(content: ReportContent) -> list[Row]:
    """Each marker's free decay: frequency, damping ratio, time to a tenth, share explained."""
    out: list[Row] = []
    for one in content.decays:
        m = one.found
        tenth_ms = 1e3 * np.log(10) / one.fall
        relative = np.hypot(
            m.decay_damping_sigma / m.decay_damping, m.decay_f_sigma_hz / m.decay_f_hz
        )
        out.append((
            content.marker_name(m.id),
            measure(m.decay_f_hz, "Hz", m.decay_f_sigma_hz),
            measure(100 * m.decay_damping, "%", 100 * m.decay_damping_sigma),
            measure(tenth_ms, "ms", float(tenth_ms * relative)),
            measure(100 * m.decay_share, "%", digits=3),
            str(one.t_s.size),
        ))  # fmt: skip
    return out


def orbit_rows(content: ReportContent) -> list[Row]:
    """The ellipse of each marker's line: semi-axes, long axis, normal, precession."""
    if content.survey is None:
        return []
    lines = content.lines()
    out: list[Row] = []
    for m in content.survey.markers:
        one, line = m.orbit, lines.get(m.id)
        if not np.isfinite(one.major) or line is None:
            continue
        major, major_sigma = largest(line)
        sigma = float(np.sqrt(np.mean(line.amplitude_sigma**2)))
        minor = "straight" if one.straight else measure(one.minor, "mm", sigma)
        normal = NOT_KNOWN if one.straight or one.folded else _unit(one.normal)
        turning = measure(m.precession_deg_s, "°/s", m.precession_sigma_deg_s)
        out.append((
            content.marker_name(m.id), measure(major, "mm", major_sigma), minor,
            _unit(one.major_axis), normal, turning,
        ))  # fmt: skip
    return out


def _unit(vector: np.ndarray) -> str:
    known = np.isfinite(vector).all()
    return " / ".join(number(float(v), 2) for v in vector) if known else NOT_KNOWN


def figure_rows(content: ReportContent) -> list[Row]:
    """Further figures of the phase whose spectra are shown, one row a marker and quantity."""
    vibration = content.vibration
    if vibration is None:
        return []
    out = []
    for row in vibration.table:
        if row.phase == vibration.spectrum_phase:
            for figures in (row.displacement, row.velocity, row.acceleration):
                if np.isfinite(figures.rms).all():
                    out.append((content.marker_name(row.id), *_figures(figures)))
    return out


def _figures(f: Figures) -> Row:
    def three(values: np.ndarray, digits: int = 3) -> str:
        known = np.isfinite(values)
        return " / ".join(
            number(float(v), digits) if k else "–" for v, k in zip(values, known, strict=True)
        )

    resultant = (f.resultant_mean, f.resultant_median, f.resultant_p95, f.resultant_p99)
    single = tuple(measure(v, digits=3) for v in (*resultant, f.resultant_max))
    return (
        f"{f.quantity}, {f.unit.replace('s2', 's²')}",
        three(f.rms),
        three(f.peak),
        three(f.crest, 2),
        three(f.kurtosis, 2),
        three(f.thd_percent, 2),
        *single,
    )


def dose_rows(content: ReportContent) -> list[Row]:
    """Share of time in each class of acceleration, energy index and dose; where it is known."""
    vibration = content.vibration
    if vibration is None:
        return []
    out = []
    for row in vibration.table:
        a = row.acceleration
        if row.phase == vibration.spectrum_phase and np.isfinite(a.class_percent).all():
            shares = tuple(measure(float(v), "%", digits=3) for v in a.class_percent)
            energy = measure(a.energy_m2_s3, digits=3)
            dose = measure(a.dose_m_s175, digits=3)
            out.append((content.marker_name(row.id), clean(row.phase, 20), *shares, energy, dose))
    return out
