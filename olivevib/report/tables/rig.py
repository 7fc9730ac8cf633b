"""The tables of the rig and the clock: lenses, calibration, recordings, offsets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from olivevib.geometry import CameraModel
from olivevib.report.clean import clean
from olivevib.report.content import ReportContent
from olivevib.report.words import NOT_KNOWN, fact, known, measure, number, seconds
from olivevib.signals import fit_stamps
from olivevib.vibration.types import CRYSTAL

Pair = tuple[str, str]  # label, value with unit


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
    ]


def calibration_facts(content: ReportContent) -> list[Pair]:
    """Further numbers that the calibration states of itself."""
    record = content.calibration
    return [] if record is None else [fact(k, v, 4) for k, v in record.facts.items()]


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
        ("frame rate by the stamps", _frames_a_second(get("rate_hz"), get("rate_sigma_hz"))),
        ("stamps from", clean(get("stamp_kind") or NOT_KNOWN, 30)),
        ("scatter of the stamps, rms", seconds(get("jitter_s"))),
        ("largest distance from an even clock", seconds(get("worst_s"))),
        ("frames; dropped; damaged", counts),
        *pairs,
    ]


def _frames_a_second(rate_hz: Any, sigma_hz: Any) -> str:
    """A frame rate; its sigma is that of the stamps and of the camera's own clock together."""
    both = np.hypot(sigma_hz, CRYSTAL * rate_hz) if known(rate_hz) and known(sigma_hz) else None
    return measure(rate_hz, "frames/s", None if both is None else float(both))


def _rate(content: ReportContent) -> list[Pair]:
    path = content.trajectory
    if path is None or path.t_s.size < 2:
        return [("frames in space", NOT_KNOWN)]
    if content.continuous:
        counts = f"{path.t_s.size}, of a motion fitted to {content.frames} frames"
        return [("instants of the paths", counts)]
    clock = fit_stamps(path.t_s)
    return [
        ("frame rate on the trial clock", _frames_a_second(clock.rate_hz, clock.rate_sigma_hz)),
        ("frames; missing between them", f"{path.t_s.size}; {clock.dropped.size}"),
    ]
