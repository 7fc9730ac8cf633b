"""Boards found in rendered pictures: all kinds, every point to a few hundredths of a pixel."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from boards_rendered import picture, pose, sample

from olivevib.calibration.boards import parse_board
from olivevib.calibration.finding import BoardFinder, crossing, find_board
from olivevib.detection.detection import Detection

CHARUCO = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000"
KINDS = [
    CHARUCO,
    CHARUCO + ",inverted",
    "charuco:6x4,square=50,marker=36,dict=DICT_5X5_100,legacy",
    "charuco:6x4,square=50,marker=36,dict=DICT_5X5_100",
    "arucogrid:4x3,size=50,gap=20,dict=DICT_6X6_250",
    "chessboard:7x5,square=40",
]


def errors(board, pictures):
    finder, out = BoardFinder(board), []
    for grey, truth in pictures:
        view = finder.find(grey, 3, 0.5)
        assert view is not None and view.frame == 3 and view.t_s == 0.5
        miss = view.px - truth[view.ids]
        if board.kind == "chessboard":  # either end may come first
            other = view.px - truth[::-1][view.ids]
            miss = min(miss, other, key=lambda m: float(np.abs(m).max()))
        out.append((view, miss))
    return out


@pytest.mark.parametrize("spec", KINDS)
def test_every_kind_is_found_and_right(spec):
    board = parse_board(spec)
    found = errors(board, sample(board, 4))
    assert np.mean([view.ids.size for view, _ in found]) > 0.9 * len(board.points_mm)
    miss = np.concatenate([m for _, m in found])
    assert np.sqrt((miss**2).mean()) < 0.03
    assert np.abs(np.median(miss, axis=0)).max() < 0.01
    assert np.abs(miss).max() < 0.2


def test_better_than_opencv_and_honest_about_it():
    board = parse_board(CHARUCO)
    pictures = sample(board, 5, seed=8, noise=4.0, blur_px=1.0)
    found = errors(board, pictures)
    ours = np.concatenate([m for _, m in found])
    sigma = np.concatenate([view.sigma_px for view, _ in found])
    finder = BoardFinder(board)
    theirs = []
    for grey, truth in pictures:
        ids, px = finder._search(grey)
        theirs.append(px - truth[ids])
    theirs = np.concatenate(theirs)
    assert np.sqrt((ours**2).mean()) < 0.5 * np.sqrt((theirs**2).mean())
    z = ours / sigma[:, None]
    assert 0.2 < np.sqrt((z**2).mean()) < 1.5


def test_a_gradient_of_light_does_not_pull():
    board = parse_board("chessboard:7x5,square=40")
    rng = np.random.default_rng(2)
    grey, truth = picture(board, *pose(rng, board), rng, noise=0.5)
    ramp = np.linspace(0.4, 1.0, grey.shape[1])
    dim = np.clip(grey * ramp, 0, 255).astype(np.uint8)
    ((_, miss),) = errors(board, [(dim, truth)])
    assert np.abs(miss).max() < 0.08


def test_a_covered_corner_is_left_out_or_right():
    board = parse_board(CHARUCO)
    rng = np.random.default_rng(4)
    grey, truth = picture(board, *pose(rng, board, tilt=0.2), rng)
    x, y = truth[5].astype(int)
    cv2.circle(grey, (x + 6, y + 4), 26, 150, -1)
    view = find_board(board, grey)
    assert view is not None and view.ids.size >= 8
    assert np.abs(view.px - truth[view.ids]).max() < 0.3


def test_missed_points_are_predicted_and_found():
    """A marker blotted out costs OpenCV its neighbours' corners, not us."""
    board = parse_board(CHARUCO)
    rng = np.random.default_rng(6)
    R, t = pose(rng, board, tilt=0.2)
    grey, truth = picture(board, R, t, rng)
    first = BoardFinder(board)
    corners, ids, _ = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
    ).detectMarkers(grey)
    for quad in np.array(corners)[ids.ravel() < 4].reshape(-1, 4, 2):
        middle = quad.mean(axis=0)
        cv2.fillConvexPoly(grey, (middle + 0.35 * (quad - middle)).astype(np.int32), 130)
    raw = first._search(grey)
    view = first.find(grey)
    assert raw is not None and view is not None
    assert view.ids.size >= raw[0].size
    assert np.abs(view.px - truth[view.ids]).max() < 0.3


def test_nothing_is_found_where_nothing_is():
    rng = np.random.default_rng(1)
    noise = rng.integers(0, 255, (480, 640), dtype=np.uint8)
    for spec in KINDS:
        assert find_board(parse_board(spec), noise) is None


def test_large_chessboards_go_by_sectors():
    board = parse_board("chessboard:7x5,square=40")
    rng = np.random.default_rng(3)
    grey, truth = picture(board, *pose(rng, board, tilt=0.3), rng)
    twice = cv2.resize(grey, None, fx=1.5, fy=1.5, interpolation=cv2.INTER_CUBIC)
    ((_, miss),) = errors(board, [(twice, (truth + 0.5) * 1.5 - 0.5)])
    assert np.abs(miss).max() < 0.15


def test_the_crossing_is_the_centre_in_perspective():
    H = np.array([[1.0, 0.2, 5], [0.1, 0.9, 3], [0.002, 0.001, 1]])
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [0, 0.0]]) * 20
    w = square @ H[:, :2].T + H[:, 2]
    image = w[:, :2] / w[:, 2:]
    assert np.allclose(crossing(image[:4]), image[4])


class Markers:
    """A reader that sees what it is told: id, centre, sigma and flags."""

    def __init__(self, marks):
        self.marks = marks

    def detect(self, grey):
        return [
            Detection(
                id=k,
                corners_px=np.zeros((4, 2)),
                corners_cov_px2=np.eye(8),
                centre_px=centre,
                centre_cov_px2=np.eye(2) * 0.03**2,
                raw_row=np.zeros(5),
                localiser="told",
                flags=flags,
            )
            for k, centre, flags in self.marks
        ]


def test_coded_boards_take_any_reader():
    board = parse_board("coded:3x2,pitch=60,size=44,first=11")
    centres = [(11 + k, np.array([30.0 * (k % 3), 50.0 + 28 * (k // 3)]), ()) for k in range(6)]
    others = [(4, np.zeros(2), ()), (17, np.ones(2), ())]
    finder = BoardFinder(board, Markers([*centres, *others]))
    view = finder.find(np.zeros((100, 100), np.uint8), 9, 1.5)
    assert view.ids.tolist() == [0, 1, 2, 3, 4, 5] and np.allclose(view.sigma_px, 0.03)
    assert np.array_equal(view.board_mm, board.points_mm)
    doubtful = [(k, c, ("occluded",)) for k, c, _ in centres[:3]] + centres[3:]
    assert BoardFinder(board, Markers(doubtful)).find(np.zeros((9, 9), np.uint8)) is None


def test_a_reader_belongs_to_coded_boards_alone():
    with pytest.raises(ValueError):
        BoardFinder(parse_board("coded:3x2,pitch=60,size=44"))
    with pytest.raises(ValueError):
        BoardFinder(parse_board(CHARUCO), Markers([]))
