"""The rows of the report's tables: text with units, made from frozen values and the summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from olivevib.arrays import Floats
from olivevib.geometry import CameraModel
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.words import NOT_KNOWN, fact, known, measure, number, percent, seconds
from olivevib.signals import State, fit_stamps
from olivevib.vibration.types import Line, LineStatus

Pair = tuple[str, str]  # label, value with unit


@dataclass(frozen=True)
class MarkerRow:
    """One marker as the table prints it; every field is text with its unit."""

    id: int
    place: str
    seen: str
    frequency: str
    status: str
    candidates: str
    amplitude: tuple[str, str, str]
    acceleration: tuple[str, ...]
    displacement: str


def candidate_accelerations(line: Line) -> list[tuple[float, float, float]]:
    """(f, rms, sigma) of the acceleration that each candidate means: (2 pi f)² A / sqrt 2, m/s².

    A is the resultant of the three peak amplitudes, so this is the total rms of the three axes;
    its relative variance is that of A plus (2 sigma_f / f)².
    """
    size = float(np.linalg.norm(line.amplitude))
    if not np.isfinite(size) or size == 0 or line.unit != "mm":
        return []
    of_size = float(np.linalg.norm(line.amplitude * line.amplitude_sigma)) / size**2
    out = []
    for f in line.candidates_hz or (line.f_hz,):
        rms = (2 * np.pi * f) ** 2 * size / np.sqrt(2) / 1000
        relative = np.hypot(of_size, 2 * line.f_sigma_hz / f)
        out.append((float(f), float(rms), float(rms * relative)))
    return out


def marker_rows(content: ReportContent) -> list[MarkerRow]:
    """The per-marker table from the summary's markers, candidates from the lines."""
    lines = content.lines()
    rows = []
    for marker in content.summary.get("markers") or []:
        marker_id = int(marker["id"])
        line = lines.get(marker_id)
        sizes, sigmas = marker.get("amplitude_mm") or {}, marker.get("amplitude_sigma_mm") or {}
        x, y, z = (measure(sizes.get(a), "mm", sigmas.get(a), digits=3) for a in "xyz")
        listed = marker.get("frequency_candidates_hz") or []
        hz, sigma = marker.get("frequency_hz"), marker.get("frequency_sigma_hz")
        rows.append(
            MarkerRow(
                id=marker_id,
                place=clean(content.places.get(marker_id, "")) or NOT_KNOWN,
                seen=percent(marker.get("seen_fraction")),
                frequency="" if listed else measure(hz, "Hz", sigma),
                status=clean(marker.get("frequency_status") or NOT_KNOWN),
                candidates=_candidates(listed, line),
                amplitude=(x, y, z),
                acceleration=_acceleration(marker, line),
                displacement=measure(marker.get("displacement_pp_mm"), "mm", digits=3),
            )
        )
    return rows


def _candidates(listed: Sequence[float], line: Line | None) -> str:
    if not listed:
        return ""
    shares = line.probabilities if line is not None else ()
    parts = [number(f) for f in listed]
    if len(shares) == len(parts):
        parts = [f"{f} ({share:.0%})" for f, share in zip(parts, shares, strict=True)]
    return " or ".join(parts) + "\u00a0Hz"


def _acceleration(marker: Mapping[str, Any], line: Line | None) -> tuple[str, ...]:
    value = marker.get("acceleration_rms_m_s2")
    if known(value):
        return (measure(value, "m/s2", digits=3),)
    open_ones = (LineStatus.AMBIGUOUS, LineStatus.ALIASED, LineStatus.SUPPORTED)
    if line is None or line.status not in open_ones:
        return (NOT_KNOWN,)
    each = candidate_accelerations(line)
    return tuple(f"{measure(a, 'm/s2', s)} if {number(f)}\u00a0Hz" for f, a, s in each) or (
        NOT_KNOWN,
    )


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
    if content.calibration is not None:
        pairs += [fact(k, v) for k, v in content.calibration.facts.items()]
    return pairs


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
    """The clock: frame rate as measured, offset of the right camera, row times and source."""
    timing = content.summary.get("timing") or {}
    offset, sigma = timing.get("right_offset_s"), timing.get("right_offset_sigma_s")
    row = timing.get("reference_row")
    at = "" if row is None else f", at raw row {number(float(row))}"
    pairs = [*_rate(content), (f"to add to the right camera's stamps{at}", seconds(offset, sigma))]
    for side in ("left", "right"):
        camera = timing.get(side) or {}
        source = clean(camera.get("source") or NOT_KNOWN)
        value = seconds(camera.get("row_time_s"), camera.get("row_time_sigma_s"))
        if source == "unknown":
            value = "not known, taken as 0\u00a0s"
        elif source == "global":
            value = "0\u00a0s: all rows at once"
        pairs.append((f"time from row to row, {side} camera", f"{value} (source: {source})"))
    return pairs


def _rate(content: ReportContent) -> list[Pair]:
    path = content.trajectory
    if path is None or path.t_s.size < 2:
        return [("frame rate, measured", NOT_KNOWN)]
    clock = fit_stamps(path.t_s)
    return [
        ("frame rate, measured", measure(clock.rate_hz, "frames/s", clock.rate_sigma_hz)),
        ("frames, and missing between them", f"{path.t_s.size}, {clock.dropped.size}"),
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


def comparison_pairs(content: ReportContent) -> list[Pair]:
    """Camera against accelerometer, each number with its sigma."""
    c = content.comparison
    if c is None:
        return []
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


def comparison_lines(content: ReportContent) -> list[tuple[str, str, str, str, str]]:
    """Each common line: frequency, camera, sensor, their difference, phase."""
    out = []
    for each in content.comparison.lines if content.comparison is not None else ():
        sigma = float(np.hypot(each.optical_sigma_m_s2, each.sensor_sigma_m_s2))
        out.append((
            measure(each.f_hz, "Hz"),
            measure(each.optical_m_s2, "m/s2", each.optical_sigma_m_s2),
            measure(each.sensor_m_s2, "m/s2", each.sensor_sigma_m_s2),
            measure(each.optical_m_s2 - each.sensor_m_s2, "m/s2", sigma),
            measure(each.phase_deg, "°", each.phase_sigma_deg),
        ))  # fmt: skip
    return out


def distance_rows(pairs: Sequence[tuple[str, Floats]]) -> list[Pair]:
    """Mean and standard deviation of labelled distance series, mm."""
    return [(name, measure(np.nanmean(v), "mm", np.nanstd(v, ddof=1))) for name, v in pairs]


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
