"""Our calibration beside cv2.calibrateCamera and cv2.stereoCalibrate: accuracy and time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.calibration import (
    BoardFinder,
    BoardView,
    CalibrationSettings,
    calibrate,
    parse_board,
)
from olivevib.calibration.boards import predefined
from olivevib.calibration.bundle import State
from olivevib.calibration.calibrate import make_pair_checked
from olivevib.calibration.holdout import HoldOut, common_pairs, measure, without
from olivevib.calibration.rigid import triangulate
from olivevib.calibration.views import common_ids, pair_views
from olivevib.geometry import CameraModel, StereoRig
from olivevib.progress import Tick
from olivevib.studies.calibration import lens_alone, scenes
from olivevib.studies.calibration.recorded import (
    FOLDER,
    SETS,
    WEBCAM,
    WEBCAM_SIZE,
    frames,
    stills,
    there,
    webcams,
)
from olivevib.studies.study import Cell, Effort, Goal, Study, Table

Views = Sequence[BoardView]


def run(effort: Effort, tick: Tick) -> Study:
    """Simulated pairs with known truth, OpenCV's own 13 pairs, recording A; then the time."""
    tables, goals = [_simulated(effort, tick)], []
    if there():
        tables.append(_recorded(effort, tick))
        timed, asked = _timed(effort, tick)
        tables.append(timed)
        goals += asked
    else:
        goals.append(Goal("recordings", "beside this checkout", "not there", None))
    return Study(
        name="calibration",
        title="Calibration beside cv2.calibrateCamera and cv2.stereoCalibrate",
        tables=tuple(tables),
        goals=tuple(goals),
        facts=(("OpenCV", cv2.__version__), ("OpenCV's model", "k1 k2; joint stereoCalibrate")),
    )


def opencv_pair(left: Views, right: Views, size: tuple[int, int]) -> StereoRig:
    """OpenCV's way: each lens alone, then both together from that guess."""
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    lenses = [lens_alone.opencv(views, size) for views in (left, right)]
    cameras = [_camera(lens, size) for lens in lenses]
    places, a, b = [], [], []
    for k, m in pair_views(left, right):
        ids = common_ids(left[k], right[m])
        if ids.size < 6:
            continue
        at = np.searchsorted(left[k].ids, ids), np.searchsorted(right[m].ids, ids)
        places.append(left[k].board_mm[at[0]].astype(np.float32))
        a.append(left[k].px[at[0]].astype(np.float32))
        b.append(right[m].px[at[1]].astype(np.float32))
    K, d = [c.K for c in cameras], [c.distortion for c in cameras]
    guess = flags | cv2.CALIB_USE_INTRINSIC_GUESS  # OpenCV writes into the arrays that it is given
    found = cv2.stereoCalibrate(
        places, a, b, K[0].copy(), d[0].copy(), K[1].copy(), d[1].copy(), size, flags=guess
    )
    _, K1, d1, K2, d2, R, t = found[:7]
    return StereoRig(
        CameraModel(size, np.asarray(K1), np.asarray(d1, np.float64).ravel()[:5]),
        CameraModel(size, np.asarray(K2), np.asarray(d2, np.float64).ravel()[:5]),
        np.asarray(R), np.asarray(t, np.float64).ravel(),
    )  # fmt: skip


def _camera(lens: Floats, size: tuple[int, int]) -> CameraModel:
    K = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1.0]])
    return CameraModel(size, K, np.array([lens[4], lens[5], 0, 0, 0]))


def _simulated(effort: Effort, tick: Tick) -> Table:
    """Errors of a point 1.2 m away and of the focal length; the board is waved, 6 frames/s."""
    rows: list[tuple[Cell, ...]] = []
    trials = effort.count(20, 2)
    cases = {
        "cameras in step": scenes.Waving(15.0, 6.0),
        "right camera 30 ms late": scenes.Waving(15.0, 6.0, lag_s=0.03),
    }
    rig = scenes.converging("0.10/-0.20")
    points = np.array([[x, y, 1200.0] for x in (-150, 0, 150) for y in (-80, 80)])
    solvers: dict[str, Callable[[Views, Views, tuple[int, int]], StereoRig]] = {
        "OpenCV": opencv_pair,
        "ours": lambda a, b, size: calibrate(a, b, size, size).rig,
    }
    for n, (case, how) in enumerate(cases.items()):
        errors: dict[str, list[Floats]] = {name: [] for name in solvers}
        seconds = dict.fromkeys(solvers, 0.0)
        for trial in range(trials):
            tick(trial, trials, f"simulated, {case}")
            left, right = scenes.waved(rig, how, effort.draws(71, n, trial))
            for name, solver in solvers.items():
                began = time.perf_counter()
                found = solver(left, right, scenes.SIZE)
                seconds[name] += time.perf_counter() - began
                errors[name].append(_errors(found, rig, points))
        for name in solvers:
            rms = np.sqrt(np.mean(np.square(errors[name]), axis=0))
            rows.append((case, name, *(round(float(v), 3) for v in rms),
                         round(seconds[name] / trials, 2)))  # fmt: skip
    columns = ("case", "by", "fx px", "x, y mm", "depth mm", "length 200 mm", "solve s")
    note = f"rms error of {trials} trials; 90 frames of 5 x 5 points, 0.1 px; ours cross-validates"
    return Table("Simulated pairs", columns, tuple(rows), note)


def _errors(found: StereoRig, true: StereoRig, points: Floats) -> Floats:
    """Focal length px; lateral and depth of points, a length of 200 mm (rms over points)."""

    def seen(X: Floats) -> Floats:
        return triangulate(found, true.left.project(X), true.right.project(true.to_right(X)))[0]

    off = seen(points) - points
    ends = np.array([[100.0, 0, 0]])
    length = np.linalg.norm(seen(points + ends) - seen(points - ends), axis=1) - 200.0
    rms = [np.sqrt(np.mean(np.square(v))) for v in (off[:, :2], off[:, 2], length)]
    return np.array([found.left.lens[0] - true.left.lens[0], *rms])


def _recorded(effort: Effort, tick: Tick) -> Table:
    """Distances on unused frames by both solvers, from the same detections."""
    network = webcams("A", tick)
    sets: dict[str, tuple[Views, Views, tuple[int, int]]] = {
        f"A {a}-{b}": (network[a].views, network[b].views, WEBCAM_SIZE)
        for a, b in ((0, 2), (0, 3), (2, 3))
    }
    chess = [
        stills("opencv_stereo_chess13", f"{side}*.jpg", "chessboard:9x6,square=25")
        for side in ("left", "right")
    ]
    sets["OpenCV's 13 pairs"] = (chess[0][0], chess[1][0], chess[0][1])
    rows = []
    for n, (name, (left, right, size)) in enumerate(sets.items()):
        tick(n, len(sets), name)
        for by, h in (
            ("OpenCV", _peer_holdout(left, right, size)),
            ("ours", _own(left, right, size)),
        ):
            if h is not None:
                rows.append((name, by, h.frames, h.pairs, round(h.rms_mm, 3),
                             round(h.rms_percent, 3), round(h.epipolar_rms_px, 3)))  # fmt: skip
    columns = ("recording", "solved by", "frames", "distances", "rms mm", "rms %", "epipolar px")
    return Table("Unused frames, from the same corners", columns, tuple(rows))


def _own(left: Views, right: Views, size: tuple[int, int]) -> HoldOut | None:
    return calibrate(left, right, size, size).holdout


def _peer_holdout(left: Views, right: Views, size: tuple[int, int]) -> HoldOut | None:
    settings = CalibrationSettings()
    pair = make_pair_checked(left, right, (size, size), settings)
    test = common_pairs(pair.left.views, pair.right.views, settings.common_points)[1::2]
    rig = opencv_pair(
        without(pair.left.views, [k for k, _ in test]),
        without(pair.right.views, [m for _, m in test]),
        size,
    )
    a, b = (replace(side, timed=False) for side in pair.sides)
    return measure(rig, _state(rig), (a, b), test)


def _state(rig: StereoRig) -> State:
    none = np.zeros(3)
    return State(
        rig.left, rig.right, rig.R_right_left, rig.t_right_left_mm, 0.0, none,
        np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(2),
    )  # fmt: skip


def _timed(effort: Effort, tick: Tick) -> tuple[Table, list[Goal]]:
    """Wall time on one core: pictures to a cross-validated pair, and cv2's detection and solve."""
    videos = [frames(FOLDER / SETS["A"] / f"cam_{k}.mp4") for k in (0, 2)]
    some = [v if effort.share >= 0.5 else v[::4] for v in videos]
    tick(0, 4, "time: ours")
    ours = _our_time(some)
    tick(1, 4, "time: OpenCV")
    peer = _peer_time(some)
    tick(2, 4, "time: 25 stills a camera")
    picks = [np.linspace(0, len(v) - 1, 25).round().astype(int) for v in videos]
    few = [[v[k] for k in p] for v, p in zip(videos, picks, strict=True)]
    stills_s = sum(_our_time(few))
    count = len(some[0])
    rows = (
        ("ours", count, round(ours[0], 2), round(ours[1], 2), round(sum(ours), 2)),
        ("OpenCV, no test on unused frames", count, round(peer[0], 2), round(peer[1], 2),
         round(sum(peer), 2)),
        ("ours, 25 stills a camera", 25, None, None, round(stills_s, 2)),
    )  # fmt: skip
    ratio = sum(ours) / sum(peer)
    goals = [
        Goal("2 x 111 frames to a tested pair, of cv2's time", "<= 5/9.5 = 0.53", f"{ratio:.2f}",
             ratio <= 5 / 9.5 if effort.share >= 0.5 else None),
        Goal("25 stills a camera", "<= 2 s", f"{stills_s:.2f} s (one thread)", stills_s <= 2.0),
    ]  # fmt: skip
    columns = ("by", "frames a camera", "detection s", "solve s", "total s")
    return Table("Time, both cameras one after the other", columns, rows), goals


def _our_time(videos: list[list[Grey]]) -> tuple[float, float]:
    began = time.perf_counter()
    views = []
    for pictures in videos:
        finder = BoardFinder(parse_board(WEBCAM))
        seen = [finder.find(grey, n, n / 6.0) for n, grey in enumerate(pictures)]
        views.append([view for view in seen if view is not None])
    found = time.perf_counter()
    calibrate(views[0], views[1], WEBCAM_SIZE, WEBCAM_SIZE)
    return found - began, time.perf_counter() - found


def _peer_time(videos: list[list[Grey]]) -> tuple[float, float]:
    board = cv2.aruco.CharucoBoard((4, 5), 54.0, 40.5, predefined("DICT_4X4_1000"))
    detector = cv2.aruco.CharucoDetector(board)
    points = np.asarray(board.getChessboardCorners(), dtype=np.float64)
    began = time.perf_counter()
    sides: list[list[BoardView]] = []
    for pictures in videos:
        views = []
        for n, grey in enumerate(pictures):
            corners, ids, _, _ = detector.detectBoard(255 - grey)
            if ids is not None and len(ids) >= 6:
                order = np.argsort(ids.ravel())
                at = ids.ravel()[order].astype(np.int64)
                px = corners.reshape(-1, 2)[order].astype(np.float64)
                views.append(BoardView(n, float("nan"), at, px, points[at], np.full(at.size, 0.2)))
        sides.append(views)
    found = time.perf_counter()
    opencv_pair(sides[0], sides[1], WEBCAM_SIZE)
    return found - began, time.perf_counter() - found
