"""Foreign calibration boards and single markers on public recordings, and on rendered boards."""

from __future__ import annotations

import numpy as np

from olivevib.calibration import BoardFinder, parse_board
from olivevib.detection import Detector
from olivevib.files.stills import read_grey
from olivevib.marker import load_library
from olivevib.progress import Tick
from olivevib.studies.calibration.faults import CHARUCO, pictures
from olivevib.studies.calibration.recorded import FOLDER, SETS, WEBCAM, frames, stills, there
from olivevib.studies.study import Cell, Effort, Goal, Study, Table

LEGACY = "charuco:6x4,square=50,marker=36,dict=DICT_5X5_100,legacy"
GRID = "arucogrid:4x3,size=50,gap=20,dict=DICT_6X6_250"
CHESS = "chessboard:7x5,square=40"
SINGLES, LEAST_SINGLES = 36, 31
LEAST_A = 11  # of every fourth frame of camera 0; cv2.aruco reads so many either way


def run(effort: Effort, tick: Tick) -> Study:
    """How many pictures each kind of board is read in, with the rms of its points where known."""
    rows, goals = _rendered(effort, tick)
    if there():
        more, asked = _recorded(effort, tick)
        rows, goals = rows + more, goals + asked
    else:
        goals.append(Goal("recordings", "beside this checkout", "not there", None))
    return Study(
        name="calibration-boards",
        title="Boards of others: what is read",
        tables=(Table("Boards", ("board", "pictures", "read"), tuple(rows)),),
        goals=tuple(goals),
    )


Rows = list[tuple[Cell, ...]]


def _rendered(effort: Effort, tick: Tick) -> tuple[Rows, list[Goal]]:
    rows: Rows = []
    goals = []
    boards = {
        "ChArUco": CHARUCO, "ChArUco, inverted": CHARUCO + ",inverted", "ChArUco, legacy": LEGACY,
        "ArUco grid": GRID, "chessboard": CHESS,
    }  # fmt: skip
    for n, (name, spec) in enumerate(boards.items()):
        tick(n, len(boards), name)
        some = pictures(parse_board(spec), effort.count(6, 2), effort.draws(95, n))
        finder = BoardFinder(parse_board(spec))
        read = sum(finder.find(grey, k) is not None for k, grey in enumerate(some))
        rows.append((f"{name}, rendered", len(some), read))
        goals.append(Goal(f"{name}, rendered", "all", f"{read} of {len(some)}", read == len(some)))
    return rows, goals


def _recorded(effort: Effort, tick: Tick) -> tuple[Rows, list[Goal]]:
    rows: Rows = []
    goals = []
    video = frames(FOLDER / SETS["A"] / "cam_0.mp4")[:: 4 if effort.share >= 0.5 else 16]
    for name, spec, negative in (
        ("ChArUco inverted, recording A", WEBCAM, False),
        ("ChArUco normal, recording A inverted", WEBCAM.replace(",inverted", ""), True),
    ):
        finder = BoardFinder(parse_board(spec))
        seen = [np.asarray(255 - grey) if negative else grey for grey in video]
        read = sum(finder.find(grey, k) is not None for k, grey in enumerate(seen))
        rows.append((name, len(video), read))
        enough = read >= LEAST_A if effort.share >= 0.5 else None
        goals.append(Goal(name, f">= {LEAST_A} of 28", f"{read} of {len(video)}", enough))
    for side in ("left", "right"):
        tick(0, 1, f"chessboard, {side}")
        views, _, count = stills(
            "opencv_stereo_chess13", f"{side}*.jpg", "chessboard:9x6,square=25"
        )
        rows.append((f"chessboard, OpenCV's {side} stills", count, len(views)))
        goals.append(Goal(f"chessboard {side}", "13 of 13", f"{len(views)} of {count}",
                          len(views) == 13))  # fmt: skip
    tick(0, 1, "single markers")
    read, count = singles()
    rows.append(("single ArUco markers, sides 22-158 px", count, read))
    goals.append(Goal("single-marker stills", f">= {LEAST_SINGLES} of {SINGLES}",
                      f"{read} of {count}", read >= LEAST_SINGLES))  # fmt: skip
    return rows, goals


def singles() -> tuple[int, int]:
    """In how many of the stills of one carried marker (DICT_4X4, id 0) it is read."""
    detector = Detector(load_library("aruco:DICT_4X4_50"))
    paths = sorted((FOLDER / "aruco_single_marker_4cam").rglob("*.png")) + sorted(
        (FOLDER / "aruco_single_marker_4cam").rglob("*.jpg")
    )
    read = sum(any(d.id == 0 for d in detector.detect(read_grey(path))) for path in paths)
    return read, len(paths)
