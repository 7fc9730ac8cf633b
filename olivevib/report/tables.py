"""The rows of the report's tables: text with units, made from frozen values and the summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from olivevib.comparison import Comparison
from olivevib.geometry import CameraModel
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.figures import Distance
from olivevib.report.lines import MOST, OPEN, candidates_text, describe
from olivevib.report.words import NOT_KNOWN, fact, known, measure, number, percent, plain, seconds
from olivevib.signals import State, fit_stamps
from olivevib.vibration import Line, LineStatus

Pair = tuple[str, str]  # label, value with unit


@dataclass(frozen=True)
class MarkerRow:
    """One marker as the table prints it; every field is text with its unit."""

    id: int
    place: str
    seen: str
    frequency: str
    status: str
    candidates: tuple[str, ...]
    amplitude: tuple[str, str, str]
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
        hz, sigma = marker.get("frequency_hz"), marker.get("frequency_sigma_hz")
        rows.append(
            MarkerRow(
                id=marker_id,
                place=clean(content.places.get(marker_id, "")) or NOT_KNOWN,
                seen=percent(marker.get("seen_fraction")),
                frequency="" if listed and hz is None else measure(hz, "Hz", sigma),
                status=clean(marker.get("frequency_status") or NOT_KNOWN),
                candidates=_candidates(listed, line),
                amplitude=(x, y, z),
                acceleration=_acceleration(content, marker),
                displacement=measure(marker.get("displacement_pp_mm"), digits=3),
            )
        )
    return rows


def _candidates(listed: Sequence[float], line: Line | None) -> tuple[str, ...]:
    """The candidates one by one while they are few; none where the line is not to be seen."""
    if line is not None and line.status not in (*OPEN, LineStatus.SUPPORTED):
        return ()
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
        out.append((
            content.marker_name(row.id), clean(row.phase, 30), str(row.samples),
            *(measure(float(v), digits=3) for v in d.rms), measure(d.extent, digits=3),
            measure(a.resultant_rms, digits=3), measure(a.resultant_p95, digits=3),
            describe(row.line),
        ))  # fmt: skip
    return out


def record_sections(content: ReportContent) -> list[tuple[str, list[Pair]]]:
    """The session record as it was typed: one card a section, keys as words, values with units."""
    out = []
    for name in ("session", "tree", "machine", "outcome", "markers", "cameras", "accelerometers"):
        section = content.record.get(name)
        entries = section if isinstance(section, list | tuple) else [section]
        for number_of, entry in enumerate(entries):
            if isinstance(entry, Mapping):
                pairs = [fact(str(k), v) for k, v in _flat(entry)]
                title = name if len(entries) == 1 else f"{name} {number_of + 1}"
                if pairs:
                    out.append((title, pairs))
    return out


def _flat(section: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Keys and values, nested tables as ``outer inner``; per-marker tables are left to theirs."""
    out: list[tuple[str, Any]] = []
    for name, value in section.items():
        if isinstance(value, Mapping):
            if not any(str(k).isdigit() for k in value):
                out += [(f"{name} {k}", v) for k, v in value.items() if not isinstance(v, Mapping)]
        elif not (isinstance(value, list | tuple) and value and isinstance(value[0], Mapping)):
            out.append((str(name), value))
    return out


def rig_pairs(content: ReportContent) -> list[Pair]:
    """The rig's own numbers: baseline, angle, epipolar and hold-out errors."""
    calibration = content.summary.get("calibration") or {}
    rig = content.rig
    sigma = None
    if rig is not None and rig.covariance is not None:
        along = rig.t_right_left_mm / rig.baseline_mm
        sigma = float(np.sqrt(along @ rig.covariance[15:, 15:] @ along))
    baseline = rig.baseline_mm if rig is not None else calibration.get("baseline_mm")
    angle = rig.angle_deg if rig is not None else None
    mm, share = calibration.get("holdout_rms_mm"), calibration.get("holdout_rms_percent")
    pairs = [
        ("baseline between the cameras", measure(baseline, "mm", sigma)),
        ("angle between the optical axes", measure(angle, "°", digits=3)),
        ("epipolar error, rms", measure(calibration.get("epipolar_rms_px"), "px", digits=3)),
        ("distances on left-out views, rms error", measure(mm, "mm", digits=3)),
        ("the same, relative", measure(share, "%", digits=3)),
    ]
    record = content.calibration
    if record is None:
        return pairs
    lag = -record.right_offset_s  # the right camera is late by this much
    return [
        ("calibrated from", clean(record.source, 40) or NOT_KNOWN),
        ("board", clean(record.board, 80) or NOT_KNOWN),
        *pairs,
        ("right camera late by, in the calibration", seconds(lag, record.right_offset_sigma_s)),
        *(fact(k, v) for k, v in record.facts.items()),
    ]


def camera_columns(content: ReportContent) -> list[tuple[str, str, str]]:
    """Quantity, left, right: the lens of each camera with sigmas from its covariance."""
    calibration = content.summary.get("calibration") or {}
    rig = content.rig
    cameras = [rig.left, rig.right] if rig is not None else [None, None]
    columns = [
        _camera(camera, calibration.get(side) or {})
        for camera, side in zip(cameras, ("left", "right"), strict=True)
    ]
    return [(name, left, right) for (name, left), (_, right) in zip(*columns, strict=True)]


def _camera(camera: CameraModel | None, summary: Mapping[str, Any]) -> list[Pair]:
    names = ("focal length fx", "focal length fy", "centre cx", "centre cy")
    lens: list[float | None] = [summary.get(k) for k in ("fx", "fy", "cx", "cy")]
    lens += [None, None]
    sigma: list[float | None] = [None] * 6
    size = NOT_KNOWN
    if camera is not None:
        lens = [float(v) for v in camera.lens]
        size = f"{camera.size_px[0]} × {camera.size_px[1]}\u00a0px"
        if camera.covariance is not None:
            sigma = [float(v) for v in np.sqrt(np.diag(camera.covariance))]
    pairs = [("picture", size)]
    pairs += [(n, measure(v, "px", s)) for n, v, s in zip(names, lens, sigma, strict=False)]
    pairs += [
        (f"distortion {n}", measure(v, "", s))
        for n, v, s in zip(("k1", "k2"), lens[4:], sigma[4:], strict=True)
    ]
    return [*pairs, ("residual, rms", measure(summary.get("rms_px"), "px", digits=3))]


def timing_pairs(content: ReportContent) -> list[Pair]:
    """The clock: frames of the trial, and what is added to the right camera's stamps."""
    timing = content.summary.get("timing") or {}
    offset, sigma = timing.get("right_offset_s"), timing.get("right_offset_sigma_s")
    row = timing.get("reference_row")
    at = "" if row is None else f", at raw row {number(float(row))}"
    source = timing.get("right_offset_source")
    came = f" (source: {clean(source, 40)})" if source else ""
    value = "not known, taken as 0\u00a0s" if source == "unknown" else seconds(offset, sigma) + came
    return [*_rate(content), (f"to add to the right camera's stamps{at}", value)]


def camera_clocks(content: ReportContent) -> list[tuple[str, str, str]]:
    """Quantity, left, right: what each recording says of its own clock and read-out."""
    columns = [_clock(content, side) for side in ("left", "right")]
    return [(name, left, right) for (name, left), (_, right) in zip(*columns, strict=True)]


def _clock(content: ReportContent, side: str) -> list[Pair]:
    timing = (content.summary.get("timing") or {}).get(side) or {}
    source = clean(timing.get("source") or NOT_KNOWN)
    value = seconds(timing.get("row_time_s"), timing.get("row_time_sigma_s"))
    if source == "unknown":
        value = "not known, taken as 0\u00a0s"
    elif source == "global":
        value = "0\u00a0s: all rows at once"
    pairs = [("time from row to row", value), ("its source", source)]
    if not content.recordings:
        return pairs
    get = content.recordings.get(side, {}).get
    counts = "; ".join(clean(get(k, "?"), 12) for k in ("frames", "dropped", "damaged"))
    return [
        ("recording", clean(get("video") or NOT_KNOWN, 60)),
        ("codec", clean(get("codec") or NOT_KNOWN, 20)),
        ("frame rate by the stamps", measure(get("rate_hz"), "frames/s", get("rate_sigma_hz"))),
        ("stamps from", clean(get("stamp_kind") or NOT_KNOWN, 30)),
        ("scatter of the stamps, rms", seconds(get("jitter_s"))),
        ("largest distance from an even clock", seconds(get("worst_s"))),
        ("frames; dropped; damaged", counts),
        *pairs,
    ]


def _rate(content: ReportContent) -> list[Pair]:
    path = content.trajectory
    if path is None or path.t_s.size < 2:
        return [("frames in space", NOT_KNOWN)]
    clock = fit_stamps(path.t_s)
    return [
        ("frame rate on the trial clock", measure(clock.rate_hz, "frames/s", clock.rate_sigma_hz)),
        ("frames; missing between them", f"{path.t_s.size}; {clock.dropped.size}"),
    ]


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
    ]


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


def distance_rows(pairs: Sequence[Distance]) -> list[tuple[str, str, str]]:
    """Each pair of markers: mean distance with standard deviation, and in how many frames."""
    return [
        (f"{p.first} – {p.second}", measure(p.mean_mm, "mm", p.sd_mm), str(p.frames))
        for p in pairs
    ]  # fmt: skip


def provenance_pairs(content: ReportContent) -> list[Pair]:
    """Versions, settings and hashes; the command stands first and is left out here."""
    return [
        (clean(k.replace("_", " "), 80), clean(v, 160) if v not in (None, "") else NOT_KNOWN)
        for k, v in content.provenance.items()
        if k != "command"
    ]


def stage_rows(content: ReportContent) -> list[tuple[str, str, str]]:
    """Each stage with its state and, where there is one, the reason."""
    stages = content.summary.get("stages") or {}
    return [
        (clean(name, 40), clean(s.get("state") or NOT_KNOWN, 40), clean(s.get("reason") or ""))
        for name, s in stages.items()
    ]  # fmt: skip
