"""A small workspace for the tests of the app: frozen values written as the stages write them."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from olivevib.comparison import Comparison, LineDifference, Verdict
from olivevib.errors import Caution, InputError
from olivevib.files.prints.marker import marker_picture
from olivevib.files.rig_file import write_rig
from olivevib.files.store import write_stage
from olivevib.geometry import CameraModel, StereoRig
from olivevib.marker import load_library
from olivevib.reconstruction import Reconstruction, Trajectory, TrialClock
from olivevib.signals import State
from olivevib.tracking import Track
from olivevib.trial import Trial
from olivevib.trial.records.calibration import CalibrationRecord, calibration_file
from olivevib.trial.records.comparison import comparison_file
from olivevib.trial.records.tracks import CameraRecord, StoredTracks, tracks_file
from olivevib.trial.records.trajectory import trajectory_file
from olivevib.trial.records.vibration import vibration_file
from olivevib.trial.stages import BY_NAME, write_failure
from olivevib.vibration import (
    CandidateMotion,
    Line,
    LineStatus,
    MarkerMotion,
    Phase,
    Spectrum,
    Vibration,
)
from olivevib.vibration.figures import Figures, unknown

RATE_HZ, FRAMES, F_HZ = 30.0, 240, 12.0
IDS = (1, 2, 5, 9)
PLACES = ("trunk", "trunk", "branch", "twig")
T_S = np.arange(FRAMES) / RATE_HZ
AMPLITUDE = np.array([[4.0, 1.0, 0.5], [6.0, 2.0, 1.0], [9.0, 5.0, 3.0], [14.0, 10.0, 6.0]])
PHASE = np.array([[0.0, 0.6, 1.2]]) + 0.5 * np.arange(4)[:, None]
TOML = """
[session]
date = 2026-11-20
place = "Bari, plot 7"
operator = "M. Rossi"
[tree]
cultivar = "Coratina"
[markers]
size_mm = 60.0
ids = [1, 2, 5, 9]
[[markers.marker]]
id = 1
place = "trunk"
[[markers.marker]]
id = 2
place = "trunk"
[[markers.marker]]
id = 5
place = "branch"
[[markers.marker]]
id = 9
place = "twig"
[cameras]
shutter = "global"
[cameras.left]
video = "left.avi"
[cameras.right]
video = "right.avi"
[calibration]
rig = "shared_rig.toml"
"""
SENSOR = '[[accelerometers]]\nfile = "accelerometer.csv"\nmarker = 1\n'

FAULT = InputError(
    "the recordings of the trial are swapped: left is right.",
    "Its markers fit the calibrated pair with left and right exchanged, and not as they are named.",
    "Exchange [cameras.left] and [cameras.right] in trial.toml, and run again.",
)


def rig() -> StereoRig:
    """Two equal cameras 400 mm apart."""
    K = np.array([[900.0, 0, 320], [0, 900, 240], [0, 0, 1]])
    camera = CameraModel((640, 480), K, np.zeros(5), 0.0, 0.0, "global")
    return StereoRig(camera, camera, np.eye(3), np.array([-400.0, 0, 0]))


def unsure(folder: Path) -> None:
    """Give a measured trial a rig that says how sure it is: 0.2 px of lens, 0.05 mm, 0.05 mrad."""
    sigma = np.array([*[0.2] * 4, 4e-4, 1e-3, *[0.2] * 4, 4e-4, 1e-3, *[5e-5] * 3, *[0.05] * 3])
    write_rig(folder / "rig.toml", replace(rig(), covariance=np.diag(sigma**2)), {})


def displacement() -> np.ndarray:
    """(N, M, 3) mm: rest for 1 s, then shaking."""
    ramp = np.clip((T_S - 1.0) / 0.5, 0, 1)[:, None, None]
    angle = 2 * np.pi * F_HZ * (T_S[:, None, None] - 4.0) + PHASE[None]
    return ramp * AMPLITUDE[None] * np.cos(angle)


def trajectory() -> Trajectory:
    """Four markers in space; the last one is hidden for a while."""
    n, m = FRAMES, len(IDS)
    start = np.array([[-200.0, 120, 1400], [-60, 20, 1420], [90, -60, 1460], [240, -120, 1500]])
    xyz = start[None] + displacement()
    state = np.full((n, m), int(State.SEEN))
    state[100:112, 3] = State.HIDDEN
    gone = state == State.HIDDEN
    xyz[gone] = np.nan
    sigma = np.where(np.isnan(xyz), np.nan, np.array([0.05, 0.05, 0.3]))
    empty = np.full((n, m, 3), np.nan)
    times = np.where(gone, np.nan, T_S[:, None])
    return Trajectory(
        T_S, np.array(IDS), times, xyz, sigma, np.full((n, m, 3, 3), np.nan), empty, empty,
        state, np.zeros((n, m)), "left camera", "optimal",
    )  # fmt: skip


def line(k: int, status: LineStatus) -> Line:
    """The dominant line of marker number k."""
    candidates = (5.0, 12.0, 18.0, 25.0, 42.0) if status is LineStatus.AMBIGUOUS else ()
    return Line(
        F_HZ, 0.0012, status, candidates, AMPLITUDE[k], AMPLITUDE[k] * 0.01, PHASE[k], 4.0, "mm",
        np.full((1, 3), 0.05), (), ("the declared band lies below half the frame rate",),
    )  # fmt: skip


def spectra(status: LineStatus) -> dict[str, Spectrum]:
    """Lorentz peaks over a falling floor: the same numbers on every machine."""
    f_hz = np.arange(0, 15.01, 0.125)
    shape = 1 / (1 + ((f_hz - F_HZ) / 0.15) ** 2) + 0.002 / (0.3 + f_hz) + 1e-4
    amplitude = shape[:, None, None] * AMPLITUDE[None]
    lines = tuple(line(k, status) for k in range(len(IDS)))
    known = status is LineStatus.DIRECT
    out = {}
    for n, (quantity, unit) in enumerate(
        (("displacement", "mm"), ("velocity", "mm/s"), ("acceleration", "m/s2"))
    ):
        gain = (2 * np.pi * f_hz[:, None, None]) ** n * (1e-3 if n == 2 else 1.0)
        out[quantity] = Spectrum(
            f_hz, np.array(IDS), amplitude * gain * (1.0 if n == 0 or known else math.nan),
            amplitude**2, quantity, unit, "hann", 0.125, 1.5, lines, "steady", 1.5, 7.9,
        )  # fmt: skip
    return out


def figures(quantity: str, unit: str, total: float) -> Figures:
    """Figures of which only the two that the app quotes are known."""
    values = dict(vars(unknown(quantity, unit)))
    return Figures(**(values | {"resultant_rms": total, "extent": total}))


def vibration(status: LineStatus) -> Vibration:
    """Rest, start-up, steady."""
    table = []
    for k, marker in enumerate(IDS):
        moved = 2 * float(np.linalg.norm(AMPLITUDE[k]))
        rms = 1.42 * moved if status is LineStatus.DIRECT else math.nan
        table.append(
            MarkerMotion(
                marker, "steady", 1.5, 7.9, 190, line(k, status),
                figures("displacement", "mm", moved), unknown("velocity", "mm/s"),
                figures("acceleration", "m/s2", rms),
                tuple(
                    CandidateMotion(f, AMPLITUDE[k], AMPLITUDE[k], AMPLITUDE[k], f)
                    for f in line(k, status).candidates_hz
                ),
            )
        )  # fmt: skip
    phases = (Phase("rest", 0, 1.0), Phase("start-up", 1.0, 1.5), Phase("steady", 1.5, 7.9))
    undecided = Caution(
        "frequency-undecided", "Several frequencies in the band look the same.",
        "Declare the band that the machine can reach (--band).",
    )  # fmt: skip
    cautions = (undecided,) if status is LineStatus.AMBIGUOUS else ()
    return Vibration(phases, spectra(status), tuple(table), "steady", cautions)


def tracks() -> StoredTracks:
    """Both cameras saw every marker as a square of 56 px."""
    square = np.array([[-28.0, -28], [28, -28], [28, 28], [-28, 28]])
    cameras, both = {}, {}
    for side, shift in (("left", 0.0), ("right", -40.0)):
        both[side] = []
        for k, marker in enumerate(IDS):
            centre = np.array([120.0 + shift + 130 * k, 330 - 70 * k]) + np.zeros((FRAMES, 2))
            corners = centre[:, None] + square
            both[side].append(
                Track(
                    side, marker, np.arange(FRAMES), T_S, centre[:, 1], corners,
                    np.full((FRAMES, 8, 8), np.nan), centre, np.full((FRAMES, 2, 2), np.nan),
                    np.full(FRAMES, 0.002), np.zeros(FRAMES, np.int64), "edges",
                )
            )  # fmt: skip
        cameras[side] = CameraRecord(
            f"{side}.avi", "mjpeg", (640, 480), FRAMES, 0, 0, "container", "line", RATE_HZ, 1e-4,
            3e-4, 1e-3, 0.0, 0.0, "global",
        )  # fmt: skip
    stamps = {"left": T_S, "right": T_S}
    return StoredTracks(tuple(both["left"]), tuple(both["right"]), cameras, stamps, (), "edges", ())


def marker_video(path: Path, marker: int, frames: int = 3) -> None:
    """A still recording, 640 x 480, of one printed marker in front of grey."""
    grey = np.full((480, 640), 120, np.uint8)
    card = marker_picture(load_library("olive49"), marker, 8)
    grey[180 : 180 + len(card), 260 : 260 + len(card)] = card
    with av.open(str(path), "w") as out:
        stream = out.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "gray"
        for k in range(frames):
            frame = av.VideoFrame.from_ndarray(cv2.GaussianBlur(grey, (0, 0), 0.7), format="gray")
            frame.pts = k
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))


def comparison() -> Comparison:
    """The first marker against its sensor: they agree."""
    optical = displacement()[:, 0]
    difference = LineDifference(12.0, 22.7, 0.2, 22.6, 0.1, 0.4, 0.3)
    return Comparison(
        1, "accelerometer.csv", 1.2345, 2e-5, 30.2, 5.0, 1.004, 0.01, np.eye(3), 2.4, 0.2, 0.998,
        0.999, 0.8, (difference,), T_S, optical, optical * 0.98, Verdict.AGREES,
        "the gain is within two standard deviations of one",
    )  # fmt: skip


def new_trial(folder: Path, toml: str = TOML) -> Path:
    """A trial of which nothing has run; its recordings are only names with some bytes."""
    folder.mkdir(parents=True)
    (folder / "trial.toml").write_text(toml, encoding="utf-8")
    for name in ("left.avi", "right.avi", "accelerometer.csv"):
        (folder / name).write_bytes(b"not decoded in these tests")
    write_rig(folder / "shared_rig.toml", rig(), {})
    return folder


def at_work(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of a workspace that was made once, as the current folder."""
    folder = shutil.copytree(made, tmp_path / "olive")
    monkeypatch.chdir(folder)
    return folder


def measured_trial(
    folder: Path, status: LineStatus = LineStatus.DIRECT, sensor: bool = True
) -> Path:
    """A trial of which every stage is done."""
    new_trial(folder, TOML + SENSOR if sensor else TOML)
    return remeasure(folder, status, sensor)


def remeasure(folder: Path, status: LineStatus = LineStatus.DIRECT, sensor: bool = True) -> Path:
    """Write every stage's result for the inputs as they are now."""
    trial = Trial.open(folder)

    def write(stage: str, file: str, make, *values: object) -> None:
        write_stage(folder / file, make(*values, trial.fingerprint(stage)))

    u, v = np.meshgrid(np.arange(230, 620, 30), np.arange(40, 460, 30))
    wave = 0.15 * np.sin(np.stack([u, v], axis=-1).reshape(-1, 2) / 17)
    wave[5] = 1.5
    board = np.column_stack([u.ravel(), v.ravel(), wave])
    record = CalibrationRecord(
        "rig file", "", rms_left_px=0.142, rms_right_px=0.151, epipolar_rms_px=0.21,
        holdout_rms_mm=0.31, holdout_rms_percent=0.28, verdict="taken over from shared_rig.toml",
        residuals_left=board, residuals_right=board - [200, 0, 0, 0],
    )  # fmt: skip
    write_rig(folder / "rig.toml", rig(), {})
    write("calibrate", "calibration.h5", calibration_file, record)
    write("track", "tracks.h5", tracks_file, tracks())
    clock = TrialClock(0.0021, 5e-5, 240.0, "declared", 0.0, 0.0)
    result = Reconstruction(trajectory(), clock, 1.1, 0.2, ())
    write("reconstruct", "trajectory.h5", trajectory_file, result)
    write("analyse", "vibration.h5", vibration_file, vibration(status))
    if sensor:
        write("compare", "comparison.h5", comparison_file, (comparison(),), ())
    return folder


def swapped(folder: Path) -> None:
    """Reconstruction failed on the inputs of now, and left no result."""
    for name in ("trajectory.h5", "vibration.h5", "comparison.h5"):
        (folder / name).unlink(missing_ok=True)
    trial, stage = Trial.open(folder), BY_NAME["reconstruct"]
    write_failure(folder, stage, trial.fingerprint(stage), FAULT)


def workspace(folder: Path) -> Path:
    """Three trials: measured, measured with an undecided frequency, and new."""
    for name in ("trials", "reports", "markers"):
        (folder / name).mkdir(parents=True)
    trials = folder / "trials"
    measured_trial(trials / "2026-11-20_T04")
    measured_trial(trials / "2026-11-20_T05", LineStatus.AMBIGUOUS, sensor=False)
    new_trial(trials / "2026-11-21_T06")
    return folder
