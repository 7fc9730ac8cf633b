"""Rendered pictures of boards with known corner positions: warped drawings, blurred, noisy."""

from __future__ import annotations

import cv2
import numpy as np

from olivevib.calibration.artwork import charuco_board
from olivevib.calibration.boards import predefined
from olivevib.geometry import rotation_from_vector

SIZE = (960, 720)
FINE = 4  # fine pixels a pixel, each way
K = np.array([[900.0, 0, 479.5], [0, 900.0, 359.5], [0, 0, 1]])


def printed(board):
    """The print with a rim, its px a cell, and the mm of its first pixel's outer corner.

    So many px a cell that OpenCV draws every module on whole pixels.
    """
    modules = predefined(board.dictionary).markerSize + 2 if board.dictionary else 1
    inner = board.lengths_mm.get("marker", board.lengths_mm.get("size", 1.0))
    share = inner / board.pitch_mm
    fits = [
        c
        for c in range(64, 700, 2)
        if abs(c * share / modules - round(c * share / modules)) < 1e-6
        and abs(c * (1 - share) / 2 - round(c * (1 - share) / 2)) < 1e-6
    ]
    CELL = fits[0]
    pitch, rim = board.pitch_mm, CELL // 2
    if board.kind == "charuco":
        art = charuco_board(board).generateImage((board.columns * CELL, board.rows * CELL))
        corner = 0.0
    elif board.kind == "chessboard":
        cells = np.indices((board.rows + 1, board.columns + 1)).sum(axis=0) % 2
        art, corner = np.kron(255 * cells.astype(np.uint8), np.ones((CELL, CELL), np.uint8)), -pitch
    else:
        side = round(CELL * board.lengths_mm["size"] / pitch)
        art = np.full((board.rows * CELL, board.columns * CELL), 255, np.uint8)
        for k in range(board.rows * board.columns):
            y, x = (CELL * v for v in divmod(k, board.columns))
            marker = cv2.aruco.generateImageMarker(predefined(board.dictionary), k, side)
            art[y : y + side, x : x + side] = marker
        corner = 0.0
    if board.inverted:
        art = 255 - art
    art = np.pad(art, rim, constant_values=0 if board.inverted else 255)
    return art, CELL, corner - rim * pitch / CELL


def pose(rng, board, distance=700.0, tilt=0.5):
    """A random pose that keeps the board in the picture: R (3, 3), t (3,)."""
    turn = np.append(rng.uniform(-tilt, tilt, 2), rng.uniform(-0.3, 0.3))
    R = rotation_from_vector(turn)
    middle = board.points_mm.mean(axis=0)
    return R, np.array([*rng.uniform(-30, 30, 2), distance]) - R @ middle


def picture(board, R, t, rng, blur_px=0.7, noise=2.0, light=(200.0, 30.0)):
    """A picture (H, W) uint8 of the board and the true pixels (N, 2) of all its points."""
    art, cell, corner = printed(board)
    scale = board.pitch_mm / cell
    place = np.array([[scale, 0, corner + scale / 2], [0, scale, corner + scale / 2], [0, 0, 1]])
    H = K @ np.column_stack([R[:, 0], R[:, 1], t]) @ place  # print px to picture px
    fine = np.array([[FINE, 0, (FINE - 1) / 2], [0, FINE, (FINE - 1) / 2], [0, 0, 1.0]])
    big = (SIZE[0] * FINE, SIZE[1] * FINE)
    drawn = cv2.warpPerspective(
        art, fine @ H, big, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=110
    )
    grey = cv2.resize(drawn, SIZE, interpolation=cv2.INTER_AREA).astype(np.float64)
    grey = cv2.GaussianBlur(grey, (0, 0), blur_px) * (light[0] / 255) + light[1]
    grey = grey + noise * rng.standard_normal(grey.shape)
    points = (board.points_mm @ R.T + t) @ K.T
    return np.clip(grey.round(), 0, 255).astype(np.uint8), points[:, :2] / points[:, 2:]


def sample(spec_board, count, seed=5, **keys):
    """Several pictures with their truths."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        R, t = pose(rng, spec_board)
        out.append(picture(spec_board, R, t, rng, **keys))
    return out
