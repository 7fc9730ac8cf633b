"""The tables of the markers: lines and motion, phases, states of samples, distances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.figures import Distance
from olivevib.report.lines import MOST, OPEN, candidates_text, describe
from olivevib.report.words import NOT_KNOWN, known, measure, percent, plain
from olivevib.signals import State
from olivevib.vibration import Line, LineStatus


@dataclass(frozen=True)
class MarkerRow:
    """One marker as the table prints it; every field is text with its unit."""

    id: int
    place: str
    seen: str
    frequency: str
    status: str
    candidates: tuple[str, ...]
    amplitude: tuple[str, str, str, str]  # x, y, z, largest in any direction
    acceleration: tuple[str, ...]
    displacement: str


def candidate_accelerations(
    content: ReportContent, marker_id: int
) -> list[tuple[float, float, float]]:
    """(f, rms, sigma) of the acceleration that each candidate frequency would mean, m/s².

    The rms is that of the analysis (three axes together); its relative variance is that of the
    amplitude plus (2 sigma_f / f)².
    """
    row = None if content.vibration is None else content.vibration.row(marker_id)
    if row is None:
        return []
    line = row.line
    size = float(np.linalg.norm(line.amplitude))
    of_size = float(np.linalg.norm(line.amplitude * line.amplitude_sigma)) / max(size, 1e-12) ** 2
    out = []
    for each in row.candidates:
        relative = float(np.hypot(of_size, 2 * line.f_sigma_hz / each.f_hz))
        rms = each.acceleration_rms_m_s2
        if np.isfinite(rms):
            out.append((each.f_hz, rms, rms * relative))
    return out


def marker_rows(content: ReportContent) -> list[MarkerRow]:
    """The per-marker table from the summary's markers, candidates from the lines."""
    lines = content.lines()
    rows = []
    for marker in content.summary.get("markers") or []:
        marker_id = int(marker["id"])
        line = lines.get(marker_id)
        sizes, sigmas = marker.get("amplitude_mm") or {}, marker.get("amplitude_sigma_mm") or {}
        x, y, z = (measure(sizes.get(a), "", sigmas.get(a), digits=3) for a in "xyz")
        listed = marker.get("frequency_candidates_hz") or []
        hz, sigma = marker.get("frequency_hz"), frequency_sigma(marker)
        most = (marker.get("amplitude_largest_mm"), marker.get("amplitude_largest_sigma_mm"))
        rows.append(
            MarkerRow(
                id=marker_id,
                place=clean(content.places.get(marker_id, "")) or NOT_KNOWN,
                seen=percent(marker.get("seen_fraction")),
                frequency="" if listed and hz is None else measure(hz, "Hz", sigma),
                status=clean(marker.get("frequency_status") or NOT_KNOWN),
                candidates=_candidates(listed, line),
                amplitude=(x, y, z, measure(most[0], "", most[1], digits=3)),
                acceleration=_acceleration(content, marker),
                displacement=measure(
                    marker.get("displacement_pp_mm"),
                    "",
                    marker.get("displacement_pp_sigma_mm"),
                    digits=3,
                ),
            )
        )
    return rows


def frequency_sigma(marker: Mapping[str, Any]) -> float | None:
    """Sigma of a frequency, of the fit and of the camera's own clock together."""
    sigma, clock = marker.get("frequency_sigma_hz"), marker.get("frequency_clock_sigma_hz")
    if sigma is None or not known(sigma):
        return None
    return float(np.hypot(sigma, clock or 0.0))


def _candidates(listed: Sequence[float], line: Line | None) -> tuple[str, ...]:
    """The candidates one by one while they are few; none where the line is not to be seen."""
    if line is not None and line.status not in (*OPEN, LineStatus.SUPPORTED):
        return ()
    if len(listed) == 1 and line is not None and line.status is LineStatus.SUPPORTED:
        return ()  # the frequency itself
    shares = line.probabilities if line is not None else ()
    if len(listed) > MOST:
        return (candidates_text(listed),)
    if len(shares) == len(listed):
        return tuple(
            f"{plain(f, 2)} Hz ({share:.0%})" for f, share in zip(listed, shares, strict=True)
        )
    return tuple(f"{plain(f, 2)} Hz" for f in listed)


def _acceleration(content: ReportContent, marker: Mapping[str, Any]) -> tuple[str, ...]:
    value = marker.get("acceleration_rms_m_s2")
    if known(value):
        return (measure(value, digits=3),)
    each = candidate_accelerations(content, int(marker["id"]))
    listed = tuple(f"{measure(a, '', s)} if {plain(f, 2)} Hz" for f, a, s in each[:MOST])
    if len(each) > MOST:
        listed += (f"up to {measure(each[-1][1], digits=3)} if {plain(each[-1][0], 2)} Hz",)
    return listed or (NOT_KNOWN,)


def phase_rows(content: ReportContent) -> list[tuple[str, ...]]:
    """Marker × phase: displacement rms x y z and peak to peak, acceleration rms and 95 %, line."""
    if content.vibration is None:
        return []
    out = []
    for row in content.vibration.table:
        d, a = row.displacement, row.acceleration
        if not np.isfinite(d.rms).any():  # too short a phase for any figure
            continue
        out.append((
            content.marker_name(row.id), phase_word(content, row.phase), str(row.samples),
            *(measure(float(v), digits=3) for v in d.rms),
            measure(d.extent, "", d.extent_sigma, digits=3),
            measure(a.resultant_rms, digits=3), measure(a.resultant_p95, digits=3),
            describe(row.line),
        ))  # fmt: skip
    return out


STILL = 5.0  # times the sigma of a position: moving less is rest


def phase_word(content: ReportContent, name: str) -> str:
    """The phase in words: a "rest" in which the markers move is only without shaking."""
    path, vibration = content.trajectory, content.vibration
    if name != "rest" or path is None or vibration is None:
        return clean(name, 30)
    moved = [row.displacement.resultant_rms for row in vibration.table if row.phase == name]
    moved = [v for v in moved if np.isfinite(v)]
    sigma = np.linalg.norm(path.sigma_xyz_mm[path.seen], axis=1)
    if not moved or not np.isfinite(sigma).any():
        return name
    return "no shaking" if max(moved) > STILL * float(np.nanmedian(sigma)) else name


def state_rows(content: ReportContent) -> list[tuple[str, list[str]]]:
    """How many frames each marker spent in each state, by camera and in space."""
    out = []
    for marker_id, name in content.names().items():
        strips = [(t.camera, t.state) for t in content.tracks if t.id == marker_id]
        path = content.trajectory
        if path is not None and marker_id in path.ids:
            m = int(np.flatnonzero(path.ids == marker_id)[0])
            strips.append(("3-D", path.state[:, m]))
        out += [
            (f"{name}, {where}", [str(int((s == k).sum())) for k in State]) for where, s in strips
        ]
    return out


def distance_rows(pairs: Sequence[Distance]) -> list[tuple[str, str, str]]:
    """Each pair of markers: mean distance with standard deviation, and in how many frames."""
    return [
        (f"{p.first} – {p.second}", measure(p.mean_mm, "mm", p.sd_mm), str(p.frames))
        for p in pairs
    ]  # fmt: skip
