"""Drawn boards and markers against OpenCV's own drawings, and the points of the board."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from olivevib.calibration.boards import parse_board
from olivevib.errors import UsageError
from olivevib.marker import load_library
from olivevib.simulation import board_planar, marker_planar
from olivevib.simulation.boards import RIM_MM
from olivevib.simulation.texture import Textures, draw


def raster(planar, px_per_mm, area_mm):
    """Dark cells (H, W) of an area, by the middle of each cell."""
    x0, y0, x1, y1 = area_mm
    x = np.arange(x0, x1, 1 / px_per_mm) + 0.5 / px_per_mm
    y = np.arange(y0, y1, 1 / px_per_mm) + 0.5 / px_per_mm
    dark = np.zeros((y.size, x.size), dtype=bool)
    for a, b, c, d in planar.dark_mm:
        dark |= ((y >= b) & (y < d))[:, None] & ((x >= a) & (x < c))[None]
    return dark


def book(name):
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


@pytest.mark.parametrize("words", ["", ",inverted", ",legacy"])
@pytest.mark.parametrize("counts", ["7x5", "4x6"])
def test_charuco_is_the_board_that_opencv_draws(counts, words):
    board = parse_board(f"charuco:{counts},square=50,marker=35,dict=DICT_5X5_50{words}")
    planar = board_planar(board)
    shape = (board.columns, board.rows)
    theirs = cv2.aruco.CharucoBoard(shape, 50.0, 35.0, book("DICT_5X5_50"))
    theirs.setLegacyPattern("legacy" in words)
    image = theirs.generateImage((board.columns * 40, board.rows * 40), marginSize=0)  # 0.8 px/mm
    ours = raster(planar, 0.8, (0, 0, board.columns * 50, board.rows * 50))
    assert (ours != (image < 128)).mean() < 1e-3
    assert planar.inverted == ("inverted" in words)
    assert np.allclose(board.points_mm[:, :2], theirs.getChessboardCorners()[:, :2])


def test_aruco_grid_is_the_board_that_opencv_draws():
    board = parse_board("arucogrid:4x3,size=40,gap=10,dict=DICT_6X6_250")
    theirs = cv2.aruco.GridBoard((4, 3), 40.0, 10.0, book("DICT_6X6_250"))
    image = theirs.generateImage((4 * 200 - 40, 3 * 200 - 40), marginSize=0)
    ours = raster(board_planar(board), 4.0, (0, 0, 190, 140))
    assert ours.shape == image.shape
    assert (ours != (image < 128)).mean() < 0.02  # OpenCV rounds modules of 26.7 px
    corners = np.concatenate(theirs.getObjPoints())[:, :2]
    assert np.allclose(board.points_mm.reshape(-1, 5, 3)[:, 1:, :2].reshape(-1, 2), corners)


def test_chessboard_points_are_the_inner_corners():
    board = parse_board("chessboard:9x6,square=25")
    dark = raster(board_planar(board), 1.0, (-25, -25, 9 * 25, 6 * 25))
    for x, y, _ in board.points_mm:
        i, j = int(y) + 25, int(x) + 25
        around = dark[[i - 2, i - 2, i + 1, i + 1], [j - 2, j + 1, j - 2, j + 1]]
        assert around.tolist() in ([True, False, False, True], [False, True, True, False])
    assert dark[0, 0]


def test_coded_board_carries_the_library_row_by_row():
    library = load_library("olive49")
    board = parse_board("coded:4x3,pitch=60,size=44,first=5")
    planar = board_planar(board, library)
    for place, (x, y, _) in enumerate(board.points_mm):
        cells = raster(planar, 0.25, (x - 22, y - 22, x + 22, y + 22))
        code = library.only((5 + place,)).codes[0]
        assert np.array_equal(cells, library.layout.pattern(code))
    quiet = 2 * 4.0 + RIM_MM
    assert planar.card_mm.tolist() == [-22 - quiet, -22 - quiet, 180 + 22 + quiet, 120 + 22 + quiet]
    with pytest.raises(UsageError, match="codes"):
        board_planar(board)


def test_markers_of_every_family_have_their_outer_size():
    olive = load_library("olive49")
    for library, codes, modules in (
        ("aruco:DICT_4X4_50", None, 6),
        ("apriltag:36h11", None, 8),
        ("olive49", olive, 11),
    ):
        planar = marker_planar(library, 3, 77.0, codes)
        assert planar.dark_mm.min() == pytest.approx(-38.5)
        assert planar.dark_mm.max() == pytest.approx(38.5)
        quiet = (planar.card_mm[2] - 38.5) * modules / 77.0
        assert quiet == pytest.approx(2.0 if codes else 1.0)
    drawn = cv2.aruco.generateImageMarker(book("DICT_4X4_50"), 3, 66, borderBits=1)
    ours = raster(marker_planar("aruco:DICT_4X4_50", 3, 66.0), 1.0, (-33, -33, 33, 33))
    assert np.array_equal(ours, drawn < 128)


@pytest.mark.parametrize(
    ("library", "number", "word"),
    [
        ("aruco:DICT_9X9", 1, "dictionary"),
        ("aruco:DICT_4X4_50", 50, "0 to 49"),
        ("mine", 1, "codes"),
    ],
)
def test_what_cannot_be_drawn_is_refused(library, number, word):
    with pytest.raises(UsageError, match=word):
        marker_planar(library, number, 70.0)


def test_texture_keeps_areas_and_centroids():
    planar = marker_planar("aruco:DICT_4X4_50", 7, 70.0)
    texture = draw(planar, np.array([0.37, 0.53]))
    cell = texture.texel_mm.prod()
    boxes = planar.dark_mm
    areas = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    dark = (texture.card - texture.white).astype(float)
    assert dark.sum() * cell == pytest.approx(areas.sum(), rel=1e-6)
    x = texture.origin_mm[0] + np.arange(dark.shape[1]) * texture.texel_mm[0]
    true = (areas * (boxes[:, 0] + boxes[:, 2]) / 2).sum() / areas.sum()
    # Area averages keep edges exactly and moments to second order in the texel.
    assert (dark * x).sum() / dark.sum() == pytest.approx(true, abs=1e-3 * texture.texel_mm[0])


def test_a_texture_depends_on_the_view_alone():
    one = Textures(marker_planar("aruco:DICT_4X4_50", 7, 70.0))
    two = Textures(marker_planar("aruco:DICT_4X4_50", 7, 70.0))
    for scale in np.linspace(0.3, 2.0, 40):  # more than are kept
        one.at(np.eye(2) * scale)
    assert np.array_equal(one.at(np.eye(2)).white, two.at(np.eye(2)).white)
