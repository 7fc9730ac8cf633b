"""No board found: what was wrong is named with a remedy, on rendered boards of every kind."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from boards_rendered import sample

from olivevib.calibration import diagnose, parse_board
from olivevib.calibration.diagnosis import roll_deg
from olivevib.calibration.finding import BoardFinder
from olivevib.calibration.layouts import agreement, marker_places, read_markers, rebuild

CHARUCO = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000"
GRID = "arucogrid:4x3,size=50,gap=20,dict=DICT_6X6_250"
CHESS = "chessboard:7x5,square=40"


def pictures(spec, count=4, seed=3):
    return [grey for grey, _ in sample(parse_board(spec), count, seed)]


def flip(pictures):
    return [np.ascontiguousarray(p[:, ::-1]) for p in pictures]


@pytest.mark.parametrize("spec", [CHARUCO, GRID, CHESS])
def test_sound_recordings_are_sound(spec):
    found = diagnose(parse_board(spec), pictures(spec))
    assert found.cause == "sound" and found.board == parse_board(spec)


def test_inverted_prints_both_ways():
    found = diagnose(parse_board(CHARUCO), pictures(CHARUCO + ",inverted"))
    assert found.cause == "inverted" and "inverted" in found.remedy
    back = diagnose(parse_board(CHARUCO + ",inverted"), pictures(CHARUCO))
    assert back.cause == "inverted" and "not inverted" in back.text
    assert back.board == parse_board(CHARUCO)


@pytest.mark.parametrize("spec", [CHARUCO, CHARUCO + ",inverted", GRID])
def test_mirrored_videos(spec):
    found = diagnose(parse_board(spec), flip(pictures(spec)))
    assert found.cause == "mirrored" and "mirrored" in found.text and "flip" in found.remedy


def test_mirrored_and_inverted_at_once():
    found = diagnose(parse_board(CHARUCO), flip(pictures(CHARUCO + ",inverted")))
    assert found.cause == "mirrored" and found.board == parse_board(CHARUCO + ",inverted")


def test_a_turned_camera_is_said_of_a_sound_recording():
    side = [np.ascontiguousarray(np.rot90(p)) for p in pictures(CHARUCO)]
    found = diagnose(parse_board(CHARUCO), side)
    assert found.cause == "sound" and "90 degrees" in found.text
    mirrored = diagnose(parse_board(CHARUCO), flip(side))
    assert mirrored.cause == "mirrored" and "90 degrees" in mirrored.text
    finder = BoardFinder(parse_board(CHARUCO))
    upright = [v for v in map(finder.find, pictures(CHARUCO)) if v]
    assert abs(roll_deg(upright)) < 40


@pytest.mark.parametrize(
    ("true", "declared"),
    [
        (CHARUCO, CHARUCO.replace("4x5", "5x4")),
        (CHARUCO, CHARUCO.replace("4x5", "6x6") + ",inverted"),
        (GRID, GRID.replace("4x3", "3x4")),
        ("charuco:6x4,square=50,marker=36,dict=DICT_5X5_100,legacy",
         "charuco:6x4,square=50,marker=36,dict=DICT_5X5_100"),
    ],
)  # fmt: skip
def test_wrong_columns_and_rows_are_rebuilt_from_the_ids(true, declared):
    found = diagnose(parse_board(declared), pictures(true))
    assert found.cause == "wrong-counts" and found.board == parse_board(true)
    assert parse_board(true).spec in found.remedy


def test_another_dictionary():
    declared = parse_board(CHARUCO.replace("4X4_1000", "5X5_100"))
    found = diagnose(declared, pictures(CHARUCO, 2))
    assert found.cause == "wrong-dictionary" and found.board == parse_board(CHARUCO)
    assert "DICT_4X4_1000" in found.text


def test_chessboards_counted_by_squares():
    found = diagnose(parse_board("chessboard:8x6,square=40"), pictures(CHESS))
    assert found.cause == "wrong-counts" and (found.board.columns, found.board.rows) in (
        (7, 5),
        (5, 7),
    )


def followed(declared, frames):
    """The causes of one diagnosis after the other, each with the board that the last proposed."""
    causes, board = [], parse_board(declared)
    for _ in range(4):
        found = diagnose(board, frames)
        causes.append(found.cause)
        if found.board is None or found.board == board or found.cause == "sound":
            return causes, found
        assert found.board.spec in found.remedy or found.cause in ("mirrored", "unsteady")
        board = found.board
    return causes, found


@pytest.mark.parametrize("declared", ["chessboard:8x6,square=40", CHARUCO])
def test_what_is_proposed_for_a_chessboard_is_found_then(declared):
    causes, _ = followed(declared, pictures(CHESS))
    assert causes in (["wrong-counts", "sound"], ["wrong-kind", "sound"])


@pytest.mark.parametrize("declared", [CHESS, "chessboard:5x7,square=40"])
def test_a_chessboard_that_is_never_whole_asks_for_another_recording_not_another_board(
    declared, monkeypatch
):
    """The finder that grows boards sees it, the one that measures does not: the hint went round."""
    from olivevib.calibration import finding

    monkeypatch.setitem(finding._SEARCHES, "chessboard", lambda board: lambda grey: None)
    causes, found = followed(declared, pictures(CHESS))
    assert causes == ["unsteady"]
    assert "--board" not in found.remedy and "record again" in found.remedy


@pytest.mark.parametrize("negative", ["", ",inverted"])
def test_a_charuco_board_declared_as_a_chessboard(negative):
    found = diagnose(parse_board("chessboard:9x6,square=54"), pictures(CHARUCO + negative))
    assert found.cause == "wrong-kind" and "ChArUco" in found.text
    assert f"charuco:4x5,square=54,marker=MM,dict=DICT_4X4_1000{negative}" in found.remedy


def test_nothing_there_says_all_that_was_tried():
    rng = np.random.default_rng(0)
    empty = [cv2.GaussianBlur(rng.integers(0, 255, (240, 320), dtype=np.uint8), (0, 0), 3)]
    found = diagnose(parse_board(CHARUCO), empty)
    assert found.cause == "unknown" and found.board is None
    for word in ("No board found", "inverted", "mirrored", "turned", "dictionaries"):
        assert word in found.text
    assert "inverted, mirrored" in found.tried
    dark = diagnose(parse_board(CHESS), [np.full((240, 320), 9, np.uint8)])
    assert "dark" in dark.text


class Library:
    """A reader of some fixed markers, wherever one looks."""

    def __init__(self, ids):
        self.ids = ids

    def detect(self, grey):
        from olivevib.detection.detection import Detection

        corners = np.zeros((4, 2))
        return [
            Detection(
                k, corners, np.eye(8), np.array([50.0 * (n % 3), 40.0 * (n // 3)]), np.eye(2),
                np.zeros(5), "told",
            )
            for n, k in enumerate(self.ids)
        ]  # fmt: skip


def test_other_markers_than_the_board_carries():
    board, blank = parse_board("coded:3x2,pitch=60,size=44"), [np.zeros((60, 80), np.uint8)] * 3
    found = diagnose(board, blank, Library([20, 21, 22, 23, 24, 25]))
    assert found.cause == "wrong-ids" and found.board.first == 20
    assert diagnose(board, blank, Library([1, 2, 3, 4, 5, 6])).cause == "sound"
    assert diagnose(board, blank, Library([])).cause == "unknown"


def test_layouts_place_markers_as_opencv_draws_them():
    for spec in (CHARUCO, GRID, CHARUCO.replace("4x5", "4x6") + ",legacy"):
        board = parse_board(spec)
        grey = pictures(spec, 1)[0]
        seen = read_markers(board.dictionary, grey)
        assert agreement(board, seen) == seen.id.size == len(marker_places(board))
        assert rebuild(board, [seen])[0] == board
