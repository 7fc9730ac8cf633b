"""Distances between the centres of coded markers, by every corner refinement, on unused frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.calibration import BoardView, CalibrationSettings, parse_board
from olivevib.calibration.boards import predefined
from olivevib.calibration.calibrate import fit_all, make_pair_checked
from olivevib.calibration.gather import published_rig
from olivevib.calibration.holdout import HoldOut, common_pairs, measure, with_tracks, without
from olivevib.calibration.joint import JointFit, make_pair
from olivevib.calibration.layouts import marker_places
from olivevib.calibration.uncertainty import uncertainty
from olivevib.detection import Detector
from olivevib.geometry import StereoRig, diagonal_crossing
from olivevib.marker import load_library
from olivevib.progress import Tick
from olivevib.studies.calibration.recorded import (
    FOLDER,
    SETS,
    WEBCAM,
    WEBCAM_SIZE,
    frames,
    stamps,
    there,
    webcams,
)
from olivevib.studies.study import Effort, Goal, Study, Table

ASKED = {(0, 2): (0.27, 918), (0, 3): (0.29, 858), (2, 3): (0.38, 847)}
REFINEMENTS = {
    "cv2 none": cv2.aruco.CORNER_REFINE_NONE,
    "cv2 subpix": cv2.aruco.CORNER_REFINE_SUBPIX,
    "cv2 contour": cv2.aruco.CORNER_REFINE_CONTOUR,
    "cv2 apriltag": cv2.aruco.CORNER_REFINE_APRILTAG,
}
Centres = Callable[[Grey], dict[int, Floats]]


def run(effort: Effort, tick: Tick) -> Study:
    """Markers of recording A's board: even frames calibrate (corners), odd frames are measured."""
    if not there():
        goal = Goal("recordings", "beside this checkout", "not there: nothing measured", None)
        return Study("calibration-centres", "Centres of coded markers", (), goals=(goal,))
    network = webcams("A", tick)
    names = ["ours", *REFINEMENTS] if effort.share >= 0.5 else ["ours", "cv2 contour"]
    views = {
        name: {k: marker_views(k, finder(name), tick, name) for k in (0, 2, 3)} for name in names
    }
    rows, found = [], {}
    for pair in ASKED:
        tick(0, 1, f"pair {pair[0]}-{pair[1]}")
        fit, rig = trained(network[pair[0]].views, network[pair[1]].views)
        for name in names:
            h = tested(fit, rig, [views[name][k] for k in pair])
            if h is not None:
                found[pair, name] = h
                rows.append((f"{pair[0]}-{pair[1]}", name, h.frames, h.pairs,
                             round(h.rms_mm, 3), round(h.rms_percent, 3)))  # fmt: skip
    columns = ("pair", "corners by", "frames", "distances", "rms mm", "rms %")
    return Study(
        name="calibration-centres",
        title="Distances between centres of coded markers on unused frames of recording A",
        tables=(Table("Centres", columns, tuple(rows)),),
        goals=tuple(_goals(found)),
    )


def _goals(found: dict[tuple[tuple[int, int], str], HoldOut]) -> list[Goal]:
    out = []
    for pair, (most, least) in ASKED.items():
        mine = found.get((pair, "ours"))
        if mine is None:
            continue
        rivals = [h.rms_percent for (p, name), h in found.items() if p == pair and name != "ours"]
        label = f"centres {pair[0]}-{pair[1]}"
        out.append(Goal(f"{label}: distances", f">= {least}", str(mine.pairs), mine.pairs >= least))
        reached = mine.rms_percent <= most
        out.append(Goal(label, f"<= {most} %", f"{mine.rms_percent:.3f} %", reached))
        words = f"{mine.rms_percent:.3f} % against {min(rivals):.3f} %"
        out.append(Goal(f"{label}: below cv2.aruco", "all", words, mine.rms_percent < min(rivals)))
    return out


def finder(name: str) -> Centres:
    """What finds the centres of markers in an image, by the name of the method."""
    if name == "ours":
        detector = Detector(load_library("aruco:DICT_4X4_1000"))
        return lambda grey: {d.id: d.centre_px for d in detector.detect(grey)}
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = REFINEMENTS[name]
    stock = cv2.aruco.ArucoDetector(predefined("DICT_4X4_1000"), parameters)

    def centres(grey: Grey) -> dict[int, Floats]:
        corners, ids, _ = stock.detectMarkers(grey)
        if not corners:
            return {}
        return {
            int(i): diagonal_crossing(np.asarray(c, dtype=np.float64).reshape(4, 2))
            for i, c in zip(ids.ravel(), corners, strict=True)
        }

    return centres


def marker_views(camera: int, centres: Centres, tick: Tick, name: str) -> list[BoardView]:
    """Views of the board's markers (their centres as board points) by one camera of A."""
    board = parse_board(WEBCAM)
    side = board.lengths_mm["square"]
    places = side * (marker_places(board) + 0.5)
    times = stamps("A", camera)
    out = []
    pictures = frames(FOLDER / SETS["A"] / f"cam_{camera}.mp4")
    for n, grey in enumerate(pictures):
        tick(n, len(pictures), f"markers of camera {camera}, {name}")
        found = {i: p for i, p in centres(np.asarray(255 - grey)).items() if i < len(places)}
        ids = np.array(sorted(found), dtype=np.int64)
        if ids.size >= 2:
            board_mm = np.column_stack([places[ids], np.zeros(ids.size)])
            px = np.array([found[int(i)] for i in ids])
            out.append(BoardView(n, float(times[n]), ids, px, board_mm, np.full(ids.size, 0.1)))
    return out


def trained(
    left: tuple[BoardView, ...], right: tuple[BoardView, ...]
) -> tuple[JointFit, StereoRig]:
    """The fit without the odd common frames."""
    settings = CalibrationSettings()
    pair = make_pair_checked(left, right, (WEBCAM_SIZE, WEBCAM_SIZE), settings)
    test = common_pairs(pair.left.views, pair.right.views, settings.common_points)[1::2]
    rest = (
        without(pair.left.views, [k for k, _ in test]),
        without(pair.right.views, [m for _, m in test]),
    )
    cameras = (pair.left.camera, pair.right.camera)
    fit = fit_all(make_pair(*rest, cameras, settings), settings).fit
    told = {pair.left.views[k].frame for k, _ in test}
    used = replace(fit, pair=replace(pair, left=pair.left.only([k for k, _ in test])))
    assert told == {view.frame for view in used.pair.left.views}
    return used, published_rig(fit, uncertainty(fit.problem, fit.solution))


def tested(fit: JointFit, rig: StereoRig, views: list[list[BoardView]]) -> HoldOut | None:
    """Distances between markers in the test frames of ``fit`` (its pair's left views)."""
    wanted = {view.frame for view in fit.pair.left.views}
    cameras = (rig.left, rig.right)
    pair = make_pair(views[0], views[1], cameras, CalibrationSettings())
    test = [
        (k, m)
        for k, m in common_pairs(pair.left.views, pair.right.views, 2)
        if pair.left.views[k].frame in wanted
    ]
    return measure(rig, fit.state, with_tracks(pair.sides, fit.state, (1.0, 1.0)), test)
