"""SPECs of boards: what they mean, that they read back, and every fault told at once."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from olivevib.calibration.boards import (
    EXAMPLES,
    board_from_table,
    dictionary_names,
    own_codes,
    parse_board,
    predefined,
)
from olivevib.errors import UsageError


@pytest.mark.parametrize("spec", EXAMPLES.values())
def test_examples_read_back(spec):
    assert parse_board(spec).spec == spec


def test_charuco_corners_are_those_of_opencv():
    board = parse_board("charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000,inverted,legacy")
    theirs = cv2.aruco.CharucoBoard((4, 5), 54.0, 40.5, predefined("DICT_4X4_1000"))
    assert np.allclose(board.points_mm, theirs.getChessboardCorners())
    assert board.inverted and board.legacy
    assert "inverted" in board.name and "4x5" in board.name


@pytest.mark.parametrize("spec", [EXAMPLES["charuco"], EXAMPLES["arucogrid"]])
def test_only_the_markers_of_the_board_are_read(spec):
    board = parse_board(spec)
    count = {"charuco": 10, "arucogrid": 35}[board.kind]
    whole, own = predefined(board.dictionary), own_codes(board)
    picture = np.full((240, 480), 255, np.uint8)
    for number, x in ((count - 1, 60), (count, 280)):
        picture[60:180, x : x + 120] = whole.generateImageMarker(number, 120)
    every = cv2.aruco.ArucoDetector(whole).detectMarkers(picture)[1]
    assert sorted(np.ravel(every)) == [count - 1, count]
    assert np.ravel(cv2.aruco.ArucoDetector(own).detectMarkers(picture)[1]) == [count - 1]


def test_grid_points_are_centres_and_corners():
    board = parse_board("arucogrid:5x7,size=40,gap=10,dict=DICT_6X6_250")
    theirs = cv2.aruco.GridBoard((5, 7), 40.0, 10.0, predefined("DICT_6X6_250"))
    corners = np.array(theirs.getObjPoints())
    ours = board.points_mm.reshape(35, 5, 3)
    assert np.allclose(ours[:, 1:], corners)
    assert np.allclose(ours[:, 0], corners.mean(axis=1))


def test_chessboard_and_coded_points_run_row_by_row():
    chess = parse_board("chessboard:9x6,square=25")
    assert chess.points_mm.shape == (54, 3)
    assert chess.points_mm[1].tolist() == [25, 0, 0] and chess.points_mm[9].tolist() == [0, 25, 0]
    coded = parse_board("coded:5x4,pitch=60,size=44,first=7")
    assert coded.first == 7 and coded.points_mm[5].tolist() == [0, 60, 0]
    assert coded.half_width_mm == 120


def test_points_are_frozen():
    with pytest.raises(ValueError):
        parse_board(EXAMPLES["coded"]).points_mm[0, 0] = 1.0


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("", ["no kind of board", "charuco"]),
        ("charucco:4x5", ["did you mean charuco"]),
        ("charuco:4,square=54", ["4x5", "marker", "dict"]),
        ("charuco:4x5,square=54,marker=60,dict=DICT_4X4_50", ["marker=60", "smaller"]),
        ("charuco:4x5,sqare=54,marker=40,dict=DICT_4X4_50", ["did you mean square", "square (mm)"]),
        ("charuco:4x5,square=54,marker=40,dict=DICT_4X4_51", ["did you mean DICT_4X4_50"]),
        ("charuco:20x20,square=54,marker=40,dict=DICT_4X4_50", ["50 markers", "200"]),
        ("charuco:2x5,square=54,marker=40,dict=DICT_4X4_50", ["3 to 100"]),
        ("charuco:4x5,square=-1,marker=nan,dict=DICT_4X4_50", ["square", "marker"]),
        ("charuco:4x5,square=a,square=5,marker=4,dict=DICT_4X4_50", ["square is given twice"]),
        (
            "charuco:4x5,square=54,marker=40,dict=DICT_4X4_50,inverted=1",
            ["inverted takes no value"],
        ),
        ("arucogrid:5x7,size=40,dict=DICT_6X6_250", ["gap (mm) is missing"]),
        ("arucogrid:5x7,size=40,gap=10,dict=DICT_6X6_250,legacy", ["legacy is no key"]),
        ("chessboard:9x6,square=25,dict=DICT_4X4_50", ["dict is no key"]),
        ("chessboard:9x1,square=25", ["9x1"]),
        ("coded:5x5,pitch=40,size=44", ["size=44", "smaller"]),
        ("coded:5x5,pitch=60,size=44,first=x", ["first", "'x'"]),
        ("coded:5x5,pitch=60,size=44,,", ["(nothing)"]),
    ],
)
def test_faults_are_named(spec, words):
    with pytest.raises(UsageError) as caught:
        parse_board(spec)
    for word in words:
        assert word in str(caught.value)
    assert caught.value.exit_code == 2 and caught.value.remedy


def test_all_faults_come_at_once():
    with pytest.raises(UsageError) as caught:
        parse_board("charuco:4by5,sqare=54,marker=-1,dict=DICT,invertd")
    assert caught.value.why.count("\n- ") + 1 >= 6


def test_tables_say_the_same_as_specs():
    table = {"kind": "charuco", "columns": 4, "rows": 5, "square": 54, "marker": 40.5}
    table |= {"dict": "dict_apriltag_36h11", "inverted": True, "legacy": False}
    board = board_from_table(table)
    assert board.dictionary == "DICT_APRILTAG_36H11" and board.inverted and not board.legacy
    for broken in ({}, {"kind": "charuco"}, table | {"colour": "red"}):
        with pytest.raises(UsageError):
            board_from_table(broken)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(3, 12),
    st.integers(3, 12),
    st.floats(5, 200),
    st.floats(0.3, 0.95),
    st.booleans(),
    st.booleans(),
)
def test_any_charuco_reads_back(columns, rows, square, share, inverted, legacy):
    square, marker = float(f"{square:g}"), float(f"{square * share:g}")
    words = ",inverted" * inverted + ",legacy" * legacy
    spec = f"charuco:{columns}x{rows},square={square:g},marker={marker:g},dict=DICT_4X4_1000{words}"
    board = parse_board(spec)
    assert board.spec == spec and parse_board(board.spec) == board
    assert len(board.points_mm) == (columns - 1) * (rows - 1)


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_a_board_or_a_usage_error(text):
    for spec in (text, "charuco:" + text, "coded:5x5," + text):
        try:
            parse_board(spec)
        except UsageError as error:
            assert error.what


def test_every_dictionary_name_opens():
    assert all(len(predefined(name).bytesList) for name in dictionary_names())
