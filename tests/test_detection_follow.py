"""Following markers: keys fitted to frames they were not drawn in, searched, smeared, hidden."""

import numpy as np
import pytest
from rendered_markers import Canvas, Look, pose

from olivevib.detection import Detector
from olivevib.detection.blur import Blur
from olivevib.detection.key import make_key
from olivevib.detection.key_fit import batches_of, fit_keys
from olivevib.detection.pixels import marker_pixels
from olivevib.detection.template import card
from olivevib.geometry import apply_homography
from olivevib.marker import load_library
from olivevib.tracking import Tracker

LIBRARY = load_library("olive49")
PATTERNS = [LIBRARY.layout.pattern(code) for code in LIBRARY.codes]


def frame(poses, seed, rows=None, look=None):
    canvas = Canvas(480, 360, look or Look(), np.random.default_rng(seed))
    for k, H in enumerate(poses):
        canvas.add(PATTERNS[k if rows is None else rows[k]], H)
    return canvas.grey()


def swaying(k, size=44.0, tilt=35.0):
    """Poses of two markers in frame k: they jump some pixels and rock a little."""
    places = np.array(
        [[120 + 3 * np.sin(2.1 * k), 130 + 2 * k % 7], [330 - k, 210 + 3 * np.cos(k)]]
    )
    return [
        pose(11, size, tilt + np.sin(k + i), 40 + 80 * i, 10 + 30 * i + np.cos(k), at)
        for i, at in enumerate(places + 0.37)
    ]


def centre(H):
    return apply_homography(H, [[0, 0]])[0]


@pytest.mark.parametrize(("size", "tilt"), [(44.0, 35.0), (30.0, 55.0)])
def test_followed_markers_are_as_good_as_their_covariance_says(size, tilt):
    follower = Detector(LIBRARY).follower()
    follower.learn(Detector(LIBRARY).detect(frame(swaying(0, size, tilt), 0)))
    pulls, errors = [], []
    for k in range(1, 31):
        poses = swaying(k, size, tilt)
        found = follower.follow(frame(poses, k))
        assert set(found) == {int(i) for i in LIBRARY.ids[:2]}
        for i, H in zip(LIBRARY.ids[:2], poses, strict=True):
            error = found[int(i)].centre_px - centre(H)
            errors.append(error)
            pulls.append(error @ np.linalg.solve(found[int(i)].centre_cov_px2, error))
            corners = apply_homography(H, LIBRARY.layout.cornerstones)
            assert np.abs(found[int(i)].corners_px - corners).max() < 0.15
    assert np.sqrt(np.mean(np.square(errors))) < 0.006
    assert 1.3 < np.mean(pulls) < 3.0  # 2 for an honest covariance; 60 pulls: +- 0.26


def test_a_key_leaves_out_even_ground_alone():
    H, layout = pose(11, 64.0, 20, 40, 10, (120.3, 130.7)), LIBRARY.layout
    white = np.zeros((5, 5), np.float32)
    white[2, 2] = 1
    card_ = card(PATTERNS[0], layout.quiet)
    key = make_key(card_, H, Blur(), layout, white, (480, 360))
    every = marker_pixels(np.zeros((360, 480), np.uint8), H, 11)
    assert key.area.sum() == pytest.approx(every.x.size, rel=1e-3)
    assert key.x.size < 0.75 * every.x.size
    left = set(zip(every.x, every.y, strict=True)) - set(zip(key.x, key.y, strict=True))
    x, y = np.array(sorted(left)).T
    by_x, by_y = (key.template.texture[..., k] for k in (1, 2))
    i, j = (((at - o) * key.template.samples).astype(int)
            for at, o in zip((x, y), key.template.origin_px, strict=True))  # fmt: skip
    slopes = by_x[j, i] ** 2 + by_y[j, i] ** 2
    assert slopes.sum() < 0.01 * (by_x**2 + by_y**2).sum() / key.template.samples**2


@pytest.mark.parametrize(("row", "column"), [(0, 1), (1, 1)], ids=["slant", "stretch"])
def test_a_slant_of_the_rows_is_told_in_full_though_the_key_is_drawn_upright(row, column):
    """The key's blur is slanted with it, the camera's is not: 0.3 % of the slant at 32 px."""
    layout, rng = LIBRARY.layout, np.random.default_rng(3)
    white = np.zeros((5, 5), np.float32)
    white[2, 2] = 1
    told = []
    for k in range(24):
        H = pose(11, 32.0, 20, *rng.uniform(0, 360, 2), 60 + rng.uniform(0, 1, 2))
        key = make_key(card(PATTERNS[k], layout.quiet), H, Blur(), layout, white, (121, 121))
        seen = []
        for slant in (0.015, -0.015):
            A = np.eye(3)
            A[row, column] += slant
            about = np.array([[1, 0, 60.2], [0, 1, 60.7], [0, 0, 1]])
            canvas = Canvas(121, 121, Look(noise=0.3, samples=8), rng)
            canvas.add(PATTERNS[k], about @ A @ np.linalg.inv(about) @ H)
            fit = fit_keys(canvas.grey(), batches_of([key]), np.zeros((1, 2), int), np.eye(3)[None])
            seen.append(np.linalg.inv(fit.W[0] / fit.W[0, 2, 2])[row, column])
        told.append((seen[0] - seen[1]) / 0.03)
    error = np.std(told) / np.sqrt(len(told))
    assert error < 0.0006
    assert np.mean(told) == pytest.approx(1, abs=max(3 * error, 0.0008))


def test_a_search_catches_a_jump_of_eight_pixels_and_after_a_miss_of_sixteen():
    H = swaying(0)
    follower = Detector(LIBRARY).follower()
    follower.learn(Detector(LIBRARY).detect(frame(H, 0)))
    follower.follow(frame(H, 1))
    move = np.array([[1, 0, 7.6], [0, 1, -7.7], [0, 0, 1.0]])
    jumped = [move @ one for one in H]
    assert len(follower.follow(frame(jumped, 2))) == 2
    assert follower.follow(np.full((360, 480), 120, np.uint8)) == {}
    again = [move @ move @ one for one in jumped]
    found = follower.follow(frame(again, 3))
    assert np.abs(found[int(LIBRARY.ids[0])].centre_px - centre(again[0])).max() < 0.02


def test_another_code_at_the_same_place_is_never_reported_under_the_old_id():
    follower = Detector(LIBRARY).follower()
    H = swaying(0)
    follower.learn(Detector(LIBRARY).detect(frame(H, 0)))
    assert len(follower.follow(frame(H, 1))) == 2
    assert follower.follow(frame(H, 2, rows=(5, 6))) == {}


def test_a_covered_corner_is_flagged_by_a_follower_too():
    follower = Detector(LIBRARY).follower()
    H = swaying(0)
    follower.learn(Detector(LIBRARY).detect(frame(H, 0)))
    follower.follow(frame(H, 1))
    grey = frame(H, 2)
    x, y = np.rint(apply_homography(H[0], [[-4, -4]])[0]).astype(int)
    grey[y - 9 : y + 9, x - 9 : x + 9] = 30
    found = follower.follow(grey)
    assert found[int(LIBRARY.ids[0])].flags == ("occluded",)
    assert found[int(LIBRARY.ids[1])].flags == ()


def smeared(H, path_px, seed):
    """A marker that moves steadily by ``path_px`` (2,) while the shutter is open, noise 2."""
    light = np.zeros((360, 480))
    steps = (np.arange(24) + 0.5) / 24 - 0.5
    for step in steps:
        move = np.array([[1, 0, step * path_px[0]], [0, 1, step * path_px[1]], [0, 0, 1.0]])
        canvas = Canvas(480, 360)
        canvas.add(PATTERNS[0], move @ H)
        light += canvas.light / steps.size
    return np.clip(np.rint(light + np.random.default_rng(seed).normal(0, 2, light.shape)), 0, 255)


@pytest.mark.parametrize(("path", "limit"), [(9.0, 0.015), (12.0, 0.02), (18.0, 0.03), (24, 0.05)])
def test_a_smeared_marker_is_held_and_as_good_as_its_covariance_says(path, limit):
    follower = Detector(LIBRARY).follower()
    start = pose(11, 48, 30, 20, 5, [240, 180.0])
    follower.learn(Detector(LIBRARY).detect(frame([start], 0)))
    follower.follow(frame([start], 1))
    for k, angle in enumerate((0.3, 0.9)):
        H = pose(11, 48, 30, 20, 5, [241.3 + k, 181.6])
        along = path * np.array([np.cos(angle), np.sin(angle)])
        found = follower.follow(smeared(H, along, k).astype(np.uint8))
        assert set(found) == {int(LIBRARY.ids[0])}
        one = found[int(LIBRARY.ids[0])]
        error = one.centre_px - centre(H)
        assert np.abs(error).max() < limit
        assert error @ np.linalg.solve(one.centre_cov_px2, error) < 13.8  # one in a thousand


def test_memory_makes_following_identical():
    frames = [frame(swaying(k), k) for k in range(7)]
    straight = Tracker(LIBRARY)
    whole = [straight.update(f, k / 30) for k, f in enumerate(frames)]
    first, second = Tracker(LIBRARY), Tracker(LIBRARY)
    for k in range(4):
        first.update(frames[k], k / 30)
    second.recall(first.memory())
    assert second.memory() == first.memory()
    for k in range(4, 7):
        for a, b in zip(whole[k], second.update(frames[k], k / 30), strict=True):
            assert (a.corners_px == b.corners_px).all()
            assert (a.corners_cov_px2 == b.corners_cov_px2).all()
    assert second.memory() == straight.memory()


def test_a_marker_that_comes_back_is_found_without_scanning_every_frame(monkeypatch):
    scans = []
    tracker = Tracker(LIBRARY)
    detect = tracker._detector.detect
    monkeypatch.setattr(
        tracker._detector, "detect", lambda grey: (scans.append(grey.shape), detect(grey))[1]
    )
    first, second = (int(i) for i in LIBRARY.ids[:2])
    seen = []
    for k in range(24):
        poses = swaying(k)
        shown = poses if k < 3 or k >= 14 else poses[:1]
        seen.append({d.id for d in tracker.update(frame(shown, k), k / 30)})
    assert all(first in ids for ids in seen)
    assert all(second not in ids for ids in seen[3:14])
    back = next(k for k in range(14, 24) if second in seen[k])
    assert back <= 14 + 8
    assert all(second in ids for ids in seen[back:])
    assert sum(shape == (360, 480) for shape in scans) <= 9
