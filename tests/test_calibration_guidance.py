"""Guidance while the board is shown, and the map of what to expect: against solved truth."""

from __future__ import annotations

from dataclasses import replace

import boards_simulated as bs
import numpy as np
import pytest

from olivevib.calibration import calibrate
from olivevib.calibration.forecast import forecast
from olivevib.calibration.guidance import Guide, covered
from olivevib.calibration.sigma_map import sigma_map
from olivevib.calibration.uncertainty import point_sigma
from olivevib.calibration.views import BoardView
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector


@pytest.fixture(scope="module")
def waved():
    left, right = bs.record(bs.rig(), np.random.default_rng(2), bs.Recording(stills=True))
    return left, right


def thinned(views, count):
    return views[:: max(1, len(views) // count)][:count]


def test_more_views_promise_less_sigma(waved):
    few, many = (forecast(*(thinned(v, n) for v in waved), bs.SIZE, bs.SIZE) for n in (12, 36))
    assert 0 < many.depth_sigma_mm < few.depth_sigma_mm
    assert many.after_mm < many.depth_sigma_mm


def test_the_hinted_pose_tells_more_than_another_look_at_the_same(waved):
    left, right = (thinned(v, 14) for v in waved)
    before = forecast(left, right, bs.SIZE, bs.SIZE)
    rig, board = bs.rig(), bs.grid()
    places = {"upper": 0.2, "middle": 0.5, "lower": 0.8, "left": 0.2, "centre": 0.5, "right": 0.8}
    where, depth, lean = before.hint.split(", ")
    row, column = where.split(" ")
    ray = rig.left.ray(np.array([[places[column] * 1280, places[row] * 720]]))[0]
    turns = {
        "left": (0, -0.6, 0),
        "right": (0, 0.6, 0),
        "upper": (0.6, 0, 0),
        "lower": (-0.6, 0, 0),
    }
    R = rotation_from_vector(turns.get(lean.split(" ")[1], (0, 0, 0)))
    at = ray / np.linalg.norm(ray) * float(depth[:-2]) * 1000
    X = (board - board.mean(axis=0)) @ R.T + at
    ids, none = np.arange(25), float("nan")
    more = [
        BoardView(999, none, ids, camera.project(points), board, 0.1)
        for camera, points in ((rig.left, X), (rig.right, rig.to_right(X)))
    ]
    after = forecast([*left, more[0]], [*right, more[1]], bs.SIZE, bs.SIZE)
    again = [replace(views[5], frame=999) for views in (left, right)]
    repeated = forecast([*left, again[0]], [*right, again[1]], bs.SIZE, bs.SIZE)
    assert after.depth_sigma_mm < 0.9 * before.depth_sigma_mm
    assert after.depth_sigma_mm < 0.9 * repeated.depth_sigma_mm


def test_views_that_determine_nothing_give_no_forecast(waved):
    assert forecast(waved[0][:2], waved[1][:2], bs.SIZE, bs.SIZE) is None


def test_cells_between_the_points_count_as_covered():
    square = np.array([[100.0, 100], [1100, 100], [1100, 600], [100, 600]])
    view = BoardView(0, 0.0, np.arange(4), square, bs.grid(2), 0.1)
    assert covered(view, bs.SIZE)[2, 4] and not covered(view, bs.SIZE)[:, -1].any()


def test_guide_says_what_a_recording_lacks(waved):
    guide = Guide()
    right = {view.frame: view for view in waved[1]}
    for n, view in enumerate(waved[0]):
        for side, seen in (("left", view), ("right", right.get(view.frame))):
            if seen is not None:
                stamped = BoardView(n, n / 6, seen.ids, seen.px, seen.board_mm, seen.sigma_px)
                guide.add(side, stamped, bs.SIZE)
    told = guide.state()
    assert told.forecast is not None and "best next" in told.advice and told.pairs > 15
    assert told.seen["left"].shape == (5, 8) and told.tilts + len(told.still) == 4


def test_the_sigma_map_is_that_of_single_points(waved):
    result = calibrate(*(thinned(v, 30) for v in waved), bs.SIZE, bs.SIZE)
    found = sigma_map(result.rig, (0.1, 0.12), 1000.0)
    alone = point_sigma(result.rig, found.xyz_mm[7:8], (0.1, 0.12))
    assert np.allclose(found.frame_mm[7], alone.frame_mm[0])
    assert np.allclose(found.rig_mm[7], alone.common_mm[0])
    for camera, points in ((result.rig.left, found.xyz_mm),
                           (result.rig.right, result.rig.to_right(found.xyz_mm))):  # fmt: skip
        px = camera.project(points)
        assert (px >= 0).all() and (px < bs.SIZE).all()
    depth = np.nanmedian(found.on_grid(found.frame_mm[:, 2]), axis=(0, 1))
    assert (np.diff(depth[np.isfinite(depth)]) > 0).all()


def test_cameras_that_look_apart_share_no_volume():
    camera = CameraModel(
        (640, 480), np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]), np.zeros(5)
    )
    away = StereoRig(camera, camera, rotation_from_vector([0, 2.5, 0]), np.array([400.0, 0, 0]))
    assert len(sigma_map(away, (0.1, 0.1), 1000.0).xyz_mm) == 0
