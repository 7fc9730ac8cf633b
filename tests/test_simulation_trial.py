"""Whole simulated trials: files as a technician leaves them, exact stamps, truth apart."""

from __future__ import annotations

import hashlib
import time
from dataclasses import replace

import av
import cv2
import h5py
import numpy as np
import pytest
import tomlkit

from olivevib.errors import UsageError
from olivevib.progress import Cancelled
from olivevib.simulation import (
    SCENARIOS,
    Clock,
    Renderer,
    build,
    frames_of,
    scenario,
    simulate,
    view_of,
)
from olivevib.simulation.recording import jpeg
from olivevib.simulation.scenarios import BoardPlan, CameraPlan, Scenario
from olivevib.simulation.trial_writer import _in_us
from olivevib.simulation.truth import covered

SMALL = CameraPlan(size_px=(640, 360), focal_px=475.0)


def short(name="sample", frames=4, views=2, **changes) -> Scenario:
    """A scenario cut to a few small frames."""
    full = scenario(name)
    board = replace(full.board, views=views)
    small = replace(
        full.cameras, size_px=SMALL.size_px, focal_px=SMALL.focal_px, **changes.pop("cameras", {})
    )
    return replace(full, seconds=frames / 30, board=board, cameras=small, **changes)


def digests(folder):
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def pictures(path):
    with av.open(str(path)) as file:
        return [(f.pts, f.time_base, f.to_ndarray(format="gray")) for f in file.decode(video=0)]


def test_same_seed_same_bytes_other_seed_other_bytes(tmp_path):
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        simulate(tmp_path / name, short(), seed)
    first, again, other = (digests(tmp_path / n) for n in "abc")
    assert first == again
    assert set(first) == set(other)
    assert all(first[name] != other[name] for name in first)
    assert "recordings/left.nut" in first
    assert "truth/truth.h5" in first


def test_recordings_hold_what_the_scenario_says_and_truth_lies_apart(tmp_path):
    ticks = []
    made = simulate(tmp_path, short(), 2, lambda *t: ticks.append(t))
    assert ticks[-1][:2] == (6, 6)
    assert [t[0] for t in ticks] == list(range(1, 7))
    for path in (made.left, made.right, made.accelerometer):
        assert path.parent == made.recordings
    assert len(list(made.calibration_left.iterdir())) == 2
    assert made.truth.parent == made.recordings.parent
    names = [p.name for p in made.recordings.rglob("*")]
    assert not [n for n in names if "truth" in n]
    assert made.markers == "aruco:DICT_4X4_50"
    assert made.board == "charuco:7x5,square=50,marker=35,dict=DICT_5X5_50"
    assert made.shutter == "global"
    assert made.row_time_us is None
    assert made.exposure_ms == pytest.approx(2.0)
    assert set(made.sizes_mm) == set(made.ids) == {1, 2, 3, 4, 5, 6}


def test_stamps_in_the_file_are_exact_and_dropped_frames_leave_gaps(tmp_path):
    worn = Clock(offset_s=0.004, drift_ppm=80.0, jitter_s=0.004, drop_fraction=0.3)
    made = simulate(tmp_path, short(frames=12, views=1, cameras={"right": worn}), 9)
    frames = frames_of(made.stage, "right")
    assert 0 < (~frames.delivered).sum() < 8
    read = pictures(made.right)
    assert [int(pts * base * 1_000_000) for pts, base, _ in read] == frames.stamp_us[
        frames.delivered
    ].tolist()
    off = frames.stamp_us - np.arange(12) / 30 * 1e6
    assert np.abs(off).max() > 1000
    assert np.allclose(frames.exposed_s, 0.004 + np.arange(12) / 30 * (1 + 80e-6))
    left = pictures(made.left)
    assert [int(pts) for pts, *_ in left] == [round(n / 30 * 1e6) for n in range(12)]


def test_truth_files_repeat_the_stage(tmp_path):
    made = simulate(tmp_path, short("beyond", frames=4, cameras={}), 3)
    stage = made.stage
    with h5py.File(made.truth / "truth.h5") as file:
        for side in ("left", "right"):
            view = view_of(stage, side)
            assert np.array_equal(file[side]["centre_px"][()], view.px[:, :, 0])
            row = view.px[:, :, 0, 1]
            camera = getattr(stage.tree, side)
            expected = file[side]["exposed_s"][()][:, None] + camera.model.row_time_s * row
            assert np.abs(file[side]["centre_t_s"][()] - expected).max() < 1e-11
        t, xyz = file["t_s"][()], file["xyz_mm"][()]
        assert np.array_equal(xyz[:, 2], stage.markers[2].body.pose(t)[1])
        assert file["xyz_mm"].attrs["units"] == "mm"
    told = tomlkit.parse((made.truth / "truth.toml").read_text())
    assert told["timing"]["right_offset_s"] == 0.009
    assert told["markers"][0]["frequency_hz"] == 25.0
    assert np.allclose(told["left"]["K"], stage.tree.left.model.K)
    assert made.shutter == "rolling"
    assert made.row_time_us == pytest.approx((27.8, 26.9))


def test_cancelling_stops_at_the_next_pair(tmp_path):
    def impatient(done, total, note):
        if done == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        simulate(tmp_path, short(), 1, impatient)
    assert not (tmp_path / "truth").exists()


def test_every_scenario_can_be_staged_and_fills_both_pictures():
    assert [s.name for s in SCENARIOS if s.title] == [s.name for s in SCENARIOS]
    for one in SCENARIOS:
        stage = build(replace(one, seconds=3 / 30, board=BoardPlan(one.board.spec, 3, None)), 4)
        assert [m.id for m in stage.markers] == list(one.markers.ids)
        whole = build(one, 4)
        for side in ("left", "right"):
            camera = getattr(whole.tree, side)
            t = np.linspace(0, one.seconds, 60)
            for marker in whole.markers:
                card = marker.body.points_mm(t, marker.body.planar.card_corners_mm)
                px = camera.project(card.reshape(-1, 3))
                assert (px > 0).all(), (one.name, side, marker.id)
                assert (px < np.array(camera.model.size_px) - 1).all(), (one.name, side, marker.id)


def test_a_waved_board_stays_in_both_pictures_and_turns():
    stage = build(scenario("demo"), 1)
    (board,) = stage.board_views
    t = np.arange(stage.scenario.board.views) / 10
    for camera in (stage.tree.left, stage.tree.right):
        px = camera.project(board.points_mm(t, board.planar.card_corners_mm).reshape(-1, 3))
        inside = ((px > 0) & (px < np.array(camera.model.size_px) - 1)).all(axis=1)
        assert inside.reshape(-1, 4).all(axis=1).mean() > 0.9
    R, _ = board.pose(t)
    tilt = np.degrees(np.arccos(R[:, 2, 2]))
    assert tilt.max() > 25
    assert tilt.min() < 12


def test_lasting_keeps_the_shut_down_and_refuses_what_is_too_short():
    demo = scenario("demo")
    shorter = demo.lasting(6.0)
    assert shorter.frames == 180
    assert shorter.what.phases.stop_s == pytest.approx(demo.what.phases.stop_s - 4)
    with pytest.raises(UsageError, match="too short"):
        demo.lasting(2.0)
    with pytest.raises(UsageError, match="did you mean sample"):
        scenario("smaple")


def test_truth_tells_what_leaves_hide():
    stage = build(replace(scenario("leaves"), seconds=0.5), 1)
    share = covered(stage, "left")
    assert share.shape == (15, 8)
    assert 0 < share.mean() < 0.3
    assert np.ptp(share, axis=0).max() > 0.01  # they sway
    assert not covered(build(scenario("demo").lasting(5.0), 1), "left").any()


def detector(name):
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    book = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    return cv2.aruco.ArucoDetector(book, settings)


def check_markers(made, side):
    """OpenCV finds every marker in every frame, without a false one; corners within 0.3 px rms."""
    view, find, off = view_of(made.stage, side), detector("DICT_4X4_50"), []
    for n, (_, _, grey) in enumerate(pictures(getattr(made, side))):
        corners, ids, _ = find.detectMarkers(grey)
        assert sorted(ids.ravel().tolist()) == [1, 2, 3, 4, 5, 6]
        order = [made.ids.index(i) for i in ids.ravel()]
        off.append(np.concatenate(corners) - view.px[n, order, 1:])
    off = np.concatenate(off)
    assert np.sqrt((off**2).mean()) < 0.3
    assert np.abs(off.mean(axis=(0, 1))).max() < 0.1  # OpenCV scatters; half a pixel would show


def check_board(made, side):
    """ChArUco corners of every still within 0.1 px rms of the truth."""
    board, camera = made.stage.board, getattr(made.stage.tree, side)
    book = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    shape = (board.columns, board.rows)
    find = cv2.aruco.CharucoDetector(cv2.aruco.CharucoBoard(shape, 50.0, 35.0, book))
    stills = sorted(getattr(made, f"calibration_{side}").iterdir())
    assert len(stills) == len(made.stage.board_views)
    for path, body in zip(stills, made.stage.board_views, strict=True):
        corners, ids, _, _ = find.detectBoard(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
        true = camera.project(body.points_mm(0.0, board.points_mm[:, :2])[0])
        assert len(ids) == 24
        assert np.sqrt(((corners.reshape(-1, 2) - true[ids.ravel()]) ** 2).mean()) < 0.1


def test_numbers_of_a_trial_are_as_a_person_types_them(tmp_path):
    assert 20.3e-6 * 1e6 != 20.3  # what a product leaves behind
    assert _in_us((20.3e-6, -20.3e-6)) == (20.3, -20.3)
    made = simulate(tmp_path, short(frames=1, views=1), 1)
    told = [made.size_mm, made.exposure_ms, *(made.row_time_us or ())]
    assert all(len(str(value)) <= 6 for value in told), told


def test_opencv_reads_a_piece_of_the_sample_where_truth_says(tmp_path):
    sample = scenario("sample")
    piece = replace(sample, seconds=3 / 30, board=replace(sample.board, views=2))
    made = simulate(tmp_path, piece, 1)
    for side in ("left", "right"):
        check_markers(made, side)
        check_board(made, side)


@pytest.mark.slow
def test_the_whole_sample_is_small_and_readable(tmp_path):
    made = simulate(tmp_path, scenario("sample"), 1)
    size = sum(p.stat().st_size for p in made.recordings.rglob("*") if p.is_file())
    assert size < 6.5e6
    for side in ("left", "right"):
        check_markers(made, side)
        check_board(made, side)


@pytest.mark.slow
def test_four_stereo_pairs_a_second_on_one_core():
    """The demo's eight markers at 1280 x 720, noise and JPEG included, in processor time."""
    stage = build(scenario("demo"), 1)
    renderers = [Renderer(stage.tree, side) for side in ("left", "right")]
    for n in range(2):  # textures are drawn once
        renderers[n].frame(0, 4.0)
    before, pairs = time.process_time(), 12
    for n in range(pairs):
        for renderer in renderers:
            jpeg(renderer.frame(n, 4.0 + n / 30), 90)
    assert pairs / (time.process_time() - before) > 4


def test_whoever_waves_the_board_is_not_told_the_row_times():
    """The scenario's point is that the board shows them; they must not come from the truth."""
    told = {one.name: one.cameras.row_times_told for one in SCENARIOS}
    assert told == {name: name != "beyond-waved" for name in told}
    assert any(scenario("beyond-waved").cameras.row_time_s)
