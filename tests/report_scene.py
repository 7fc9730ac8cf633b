"""A made-up trial for the tests of the report: every value frozen and known, nothing measured."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from olivevib.comparison import Comparison, LineDifference, Verdict
from olivevib.errors import Caution
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.reconstruction.trajectory import Trajectory
from olivevib.report.content import ReportContent
from olivevib.signals import State
from olivevib.tracking import Track
from olivevib.trial.records.calibration import CalibrationRecord
from olivevib.vibration import (
    CandidateMotion,
    Line,
    LineStatus,
    MarkerMotion,
    Phase,
    SamplingFacts,
    Spectrum,
    Vibration,
    largest,
    survey,
)
from olivevib.vibration.figures import NO_LINE, figures, unknown

PLACES = {
    1: "trunk, clamp height",
    2: "trunk, fork",
    3: "branch, first third",
    4: "branch, middle",
    5: "branch, tip",
    8: "twig",
    9: "twig, far",
    17: "fixed post",
}


def rig() -> StereoRig:
    """Two webcams 420 mm apart that look at a point 1.4 m away."""
    K = np.array([[990.0, 0, 637], [0, 991, 358], [0, 0, 1]])
    lens = np.diag([2.1, 2.2, 1.4, 1.6, 0.004, 0.02]) ** 2
    cameras = [
        CameraModel((1280, 720), K, np.array([0.1, -0.2, 0, 0, 0]), row, 4e-7, source, lens)
        for row, source in ((27.8e-6, "led"), (0.0, "unknown"))
    ]
    R = rotation_from_vector([0.01, 0.28, 0.004])
    sigma = [2.1, 2.2, 1.4, 1.6, 0.004, 0.02] * 2 + [1e-4, 2e-4, 1e-4, 0.11, 0.12, 0.4]
    t = -R @ np.array([420.0, 3.0, 40.0])
    return StereoRig(cameras[0], cameras[1], R, t, np.diag(sigma) ** 2)


def trajectory(ids: list[int], seconds: float = 10.0, f_hz: float = 12.003) -> Trajectory:
    """Each marker on its own orbit at ``f_hz`` with sway, noise, a gap and flagged samples."""
    rng = np.random.default_rng(5)
    n, m = round(30 * seconds), len(ids)
    t = np.arange(n) / 30.0
    seen_t = t[:, None] + 0.004 * np.arange(m) / max(1, m)
    start = np.stack(
        [np.linspace(-320, 330, m), -220 * np.sin(np.arange(m) * 1.1), 1250 + 60.0 * np.arange(m)],
        axis=1,
    )
    size = np.stack([1.5 + 0.5 * np.arange(m), 0.8 + 0.2 * np.arange(m), 0.5 + 0.1 * np.arange(m)])
    ramp = np.clip((seen_t - 1.0) / 0.8, 0, 1) * np.clip((seconds - 0.8 - seen_t) / 0.8, 0, 1)
    xyz = np.empty((n, m, 3))
    for k in range(3):
        wave = size[k] * np.cos(2 * np.pi * f_hz * seen_t + 0.7 * k + 0.4 * np.arange(m))
        sway = 0.6 * np.sin(2 * np.pi * 0.7 * seen_t + k)
        since = np.clip(seen_t - (seconds - 0.83), 0, None)
        free = size[k] * np.exp(-2.4 * since) * np.sin(2 * np.pi * 4.0 * since)
        xyz[:, :, k] = start[:, k] + ramp * wave + sway + free
    sigma = np.broadcast_to([0.05, 0.05, 0.31], (n, m, 3)) * rng.uniform(0.8, 1.5, (n, m, 1))
    xyz = xyz + sigma * rng.standard_normal((n, m, 3))
    if ids[-1] == 17:
        xyz[:, -1] = start[-1] + sigma[:, -1] * rng.standard_normal((n, 3))
    state = np.full((n, m), int(State.SEEN))
    state[n // 3 : n // 3 + n // 12, m // 2] = State.HIDDEN
    state[n // 2 : n // 2 + 4, 0] = State.FLAGGED
    state[-n // 8 :, m - 2] = State.OUTSIDE
    state[n // 5] = State.DROPPED
    gone = state > State.FLAGGED
    xyz[gone], sigma = np.nan, np.where(gone[..., None], np.nan, sigma)
    times = np.where(gone, np.nan, seen_t)
    nothing = np.full((n, m, 3), np.nan)
    return Trajectory(
        t, np.array(ids), times, xyz, sigma, np.full((n, m, 3, 3), np.nan), nothing, nothing,
        state, np.full((n, m), np.nan), "left camera", "optimal",
    )  # fmt: skip


def tracks(path: Trajectory) -> tuple[Track, ...]:
    """A track a camera and marker, with the states of the trajectory and one more loss."""
    out = []
    n = path.t_s.size
    for camera in ("left", "right"):
        for m, marker_id in enumerate(path.ids):
            state = path.state[:, m].copy()
            if camera == "right" and m == 1:
                state[n // 4 : n // 4 + 6] = State.LOST
            if camera == "left" and m == 2:
                state[n // 6 : n // 6 + 2] = State.DAMAGED
            out.append(
                Track(
                    camera, int(marker_id), np.arange(n), path.t_s, np.full(n, 300.0),
                    np.full((n, 4, 2), np.nan), np.full((n, 8, 8), np.nan),
                    np.full((n, 2), np.nan), np.full((n, 2, 2), np.nan), np.full(n, np.nan),
                    state, "edges",
                )
            )  # fmt: skip
    return tuple(out)


def line(status: LineStatus, f_hz: float, m: int = 0, unit: str = "mm") -> Line:
    """A line of each status with amplitudes that grow with ``m``."""
    open_status = status in (LineStatus.AMBIGUOUS, LineStatus.ALIASED)
    none = status is LineStatus.NONE
    amplitude = np.full(3, np.nan) if none else np.array([1.5 + 0.5 * m, 0.8 + 0.2 * m, 0.5])
    return Line(
        f_hz=float("nan") if none else f_hz,
        f_sigma_hz=float("nan") if none else 0.0016,
        status=status,
        candidates_hz=(f_hz, 30 - f_hz, 30 + f_hz) if open_status else (),
        amplitude=amplitude,
        amplitude_sigma=amplitude * 0.004,
        phase_rad=np.array([0.0, 0.7, 1.4]) + 0.4 * m + 2 * np.pi * f_hz * 5.0,
        t_ref_s=5.0,
        unit=unit,
        harmonics=np.full((1, 3), 0.05),
        probabilities=(0.4, 0.5, 0.1) if status is LineStatus.AMBIGUOUS else (),
        reasons=("the declared band of 5 to 14 Hz lies below half the frame rate",),
    )


def spectrum(path: Trajectory, statuses: list[LineStatus], f_hz: float = 12.003) -> Spectrum:
    """Hann spectra of the trajectory's displacement, gaps filled with the mean for the drawing."""
    xyz = path.xyz_mm - np.nanmean(path.xyz_mm, axis=0)
    filled = np.where(np.isnan(xyz), 0.0, xyz)
    n = len(filled)
    window = np.hanning(n)[:, None, None]
    raw = np.fft.rfft(filled * window, axis=0)
    amplitude = 2 * np.abs(raw) / window.sum()
    psd = 2 * np.abs(raw) ** 2 / (30.0 * np.sum(window**2))
    lines = tuple(line(s, f_hz, m) for m, s in enumerate(statuses))
    return Spectrum(
        np.fft.rfftfreq(n, 1 / 30), path.ids, amplitude, psd, "displacement", "mm", "Hann",
        30 / n, 1.5, lines,
    )  # fmt: skip


def recording(side: str) -> dict[str, Any]:
    """What the stored recording of one camera says of itself."""
    return {
        "video": f"{side}.mkv", "codec": "mjpeg", "frames": 300, "dropped": 1, "damaged": 2,
        "stamp_kind": "container", "rate_hz": 29.9987, "rate_sigma_hz": 4e-4, "jitter_s": 3.1e-4,
        "worst_s": 1.2e-3,
    }  # fmt: skip


def vibration(path: Trajectory, spectra: Spectrum) -> Vibration:
    """Phases of a shaken trial and the figures of every marker in the steady one."""
    end = float(path.t_s[-1])
    limits = {
        "rest": (0.0, 1.0), "start-up": (1.0, 1.8), "steady": (1.8, end - 1.6),
        "shut-down": (end - 1.6, end - 0.8), "decay": (end - 0.8, end),
    }  # fmt: skip
    phases = tuple(Phase(name, *span) for name, span in limits.items())
    table = []
    for marker_id, each in zip(path.ids, spectra.lines, strict=True):
        samples = path.samples(int(marker_id))
        moved = figures(samples.values, "displacement", "mm", 6.6, np.full(3, 0.05), NO_LINE)
        nothing = unknown("acceleration", "m/s2")
        candidates = tuple(
            CandidateMotion(
                f, each.amplitude, each.amplitude * 6.28 * f,
                each.amplitude * (6.28 * f) ** 2 / 1000,
                float(np.linalg.norm(each.amplitude)) * (6.28 * f) ** 2 / 1414,
            )
            for f in each.candidates_hz
        )  # fmt: skip
        table.append(
            MarkerMotion(int(marker_id), "steady", 1.8, end - 1.6, samples.t_s.size, each, moved,
                         unknown("velocity", "mm/s"), nothing, candidates)
        )  # fmt: skip
    known = all(line.status is not LineStatus.AMBIGUOUS for line in spectra.lines)
    factor = (2 * np.pi * spectra.f_hz[:, None, None]) ** 2 / 1000 if known else np.nan
    rates = {
        quantity: replace(spectra, quantity=quantity, unit=unit, amplitude=a, psd=a**2)
        for quantity, unit, a in (
            ("velocity", "mm/s", np.full_like(spectra.amplitude, np.nan)),
            ("acceleration", "m/s2", spectra.amplitude * factor),
        )
    }
    motion = {int(i): path.samples(int(i)) for i in path.ids}
    lines = {int(i): each for i, each in zip(path.ids, spectra.lines, strict=True)}
    told = survey(motion, {}, lines, phases, phases[2], SamplingFacts(30.0, band_hz=(5.0, 14.0)))
    return Vibration(phases, {"displacement": spectra} | rates, tuple(table), "steady", survey=told)


def comparison() -> Comparison:
    """An overlay of 9 s in which the sensor sees what the camera sees, less a little noise."""
    rng = np.random.default_rng(3)
    t = np.arange(270) / 30.0
    wave = np.stack([2.0 * np.cos(75.4 * t), 1.0 * np.sin(75.4 * t), 0.5 * np.cos(75.4 * t)], 1)
    optical = wave + rng.normal(0, [0.05, 0.05, 0.3], (270, 3))
    optical[100:108] = np.nan
    difference = LineDifference(12.003, 11.52, 0.05, 11.49, 0.02, 0.6, 0.4)
    return Comparison(
        2, "accelerometer.csv", 1.23456, 9e-6, 30.2, 5.0, 1.0026, 0.0018, np.eye(3), 1.2, 0.4,
        0.997, 0.9994, 0.81, (difference,), t, optical, wave, Verdict.AGREES,
        "the gain is within two standard deviations of one and no rival lag comes near",
    )  # fmt: skip


def calibration() -> CalibrationRecord:
    """Residuals over both pictures and distance errors of a board with 25 corners."""
    rng = np.random.default_rng(9)
    sides = [
        np.column_stack([rng.uniform(100, 1180, 500), rng.uniform(60, 660, 500),
                         rng.normal(0, 0.12, (500, 2))])
        for _ in range(2)
    ]  # fmt: skip
    true = rng.choice([54.0, 76.4, 108.0, 152.7, 194.7], 800)
    return CalibrationRecord(
        source="board",
        board="charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000,inverted",
        right_offset_s=-0.0281,
        right_offset_sigma_s=0.0004,
        verdict="Distances on unused frames are right to 0.35 mm.",
        residuals_left=sides[0],
        residuals_right=sides[1],
        holdout_mm=np.column_stack([true, rng.normal(0, 0.35, 800)]),
        facts={
            "views": 62,
            "bow_mm": [-0.11123, 0.2],
            "halves": [{"name": "odd", "largest_z": 1.23456}, {"name": "even", "usable": True}],
        },
        dropped_views=("view 12: blurred", "view 40: moved"),
    )


def summary(path: Trajectory, lines: tuple[Line, ...]) -> dict[str, Any]:
    """The content of ``show --json`` for this trial."""
    camera = {"fx": 990.0, "fy": 991.0, "cx": 637.0, "cy": 358.0, "rms_px": 0.171}
    markers = []
    for m, (marker_id, each) in enumerate(zip(path.ids, lines, strict=True)):
        number = [None if np.isnan(v) else float(v) for v in each.amplitude]
        sigma = [None if np.isnan(v) else float(v) for v in each.amplitude_sigma]
        surely = each.status in (LineStatus.DIRECT, LineStatus.CONFIRMED)
        markers.append({
            "id": int(marker_id), "seen_fraction": float(path.seen[:, m].mean()),
            "frequency_hz": each.f_hz if surely else None,
            "frequency_sigma_hz": each.f_sigma_hz if surely else None,
            "frequency_status": str(each.status),
            "frequency_candidates_hz": list(each.candidates_hz),
            "amplitude_mm": dict(zip("xyz", number, strict=True)),
            "amplitude_sigma_mm": dict(zip("xyz", sigma, strict=True)),
            "acceleration_rms_m_s2": 9.8 + m if surely else None,
            "amplitude_largest_mm": None if number[0] is None else largest(each)[0],
            "amplitude_largest_sigma_mm": None if number[0] is None else largest(each)[1],
            "displacement_pp_mm": 4.2 + m,
        })  # fmt: skip
    return {
        "trial": "2026-11-20_T04",
        "stages": {
            "calibrate": {"state": "done", "reason": ""}, "track": {"state": "done", "reason": ""},
            "compare": {"state": "skipped", "reason": "no accelerometer file"},
        },
        "calibration": {
            "left": camera, "right": camera, "baseline_mm": 421.9, "epipolar_rms_px": 0.42,
            "holdout_rms_mm": 0.35, "holdout_rms_percent": 0.38,
        },
        "timing": {
            "right_offset_source": "calibration",
            "right_offset_s": 0.00912, "right_offset_sigma_s": 5e-5, "reference_row": 360.0,
            "left": {"row_time_s": 27.8e-6, "row_time_sigma_s": 4e-7, "source": "led"},
            "right": {"row_time_s": 0.0, "row_time_sigma_s": None, "source": "unknown"},
        },
        "markers": markers,
        "comparison": {
            "clock_offset_s": 1.23456, "clock_offset_sigma_s": 9e-6, "clock_drift_ppm": 30.2,
            "gain": 1.0026, "rotation_deg": 1.2, "coherence": 0.997, "verdict": "agrees",
        },
        "warnings": [],
    }  # fmt: skip


def content(
    ids: list[int] | None = None,
    status: LineStatus = LineStatus.DIRECT,
    seconds: float = 10.0,
    **changes: Any,
) -> ReportContent:
    """A whole trial whose first markers have ``status`` and whose last shows no line."""
    ids = ids or list(PLACES)
    f_hz = 12.003 if status is LineStatus.DIRECT else 5.0
    path = trajectory(ids, seconds, f_hz)
    statuses = [status] * (len(ids) - 1) + [LineStatus.NONE]
    spectra = spectrum(path, statuses, f_hz)
    values: dict[str, Any] = {
        "name": "2026-11-20_T04",
        "record": {
            "session": {"date": "2026-11-20", "place": "Bari, plot 7", "operator": "M. Rossi",
                        "notes": "light wind"},
            "tree": {"id": "A-12", "cultivar": "Coratina", "training": "vase",
                     "trunk_diameter_mm": 182.0, "clamp_height_mm": 760.0},
            "machine": {"make": "Pellenc", "type": "trunk shaker", "set_frequency_hz": 12.0,
                        "shaking_time_s": None},
            "outcome": {"removed_kg": 31.4, "left_kg": 4.2, "damage": ""},
        },
        "summary": summary(path, spectra.lines),
        "places": {i: PLACES.get(i, f"branch {i}") for i in ids},
        "rig": rig(),
        "calibration": calibration(),
        "tracks": tracks(path),
        "recordings": {side: recording(side) for side in ("left", "right")},
        "trajectory": path,
        "vibration": vibration(path, spectra),
        "comparisons": (comparison(),),
        "cautions": (Caution("row-time-unknown", "The right camera's row time is not known.",
                             "Measure it once with an LED: olivevib rowtime FILE --led HZ"),),
        "provenance": {"command": "olivevib report 2026-11-20_T04", "olivevib": "0.1.0",
                       "settings_sha256": "9f2c" * 16, "left video sha256": "ab12" * 16},
    }  # fmt: skip
    return ReportContent(**(values | changes))
