"""The renderer against exact geometry: places of edges, rows in time, exposure, light, noise."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d
from simulation_scenes import bar, camera, lean, marker, random_pattern, scene

from olivevib.geometry import CameraModel, apply_homography, rotation_from_vector
from olivevib.simulation import Body, Camera, Dapple, Leaf, Motion, Renderer, Surroundings
from olivevib.simulation.render import reach
from olivevib.simulation.scene import seen_at
from olivevib.simulation.surroundings import covered_share

SMALLEST_BOUND_PX = 0.0013  # Cramér-Rao, 96 px frontal marker, noise 2 DN (detection.md 7)


def card_of(cam, body, t_s=0.0):
    """White, card and the box of a body's picture without backdrop, light and noise."""
    box, path = reach(cam, body, t_s)
    white, card = Renderer(scene(cam, body), "left").card(body, t_s, box, path)
    return white.astype(float), card.astype(float), box


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_projection_agrees_with_opencv(seed):
    rng = np.random.default_rng(seed)
    focal = rng.uniform(600, 1500, 2)
    K = np.array([[focal[0], 0, rng.uniform(500, 700)], [0, focal[1], 360], [0, 0, 1.0]])
    bend = rng.normal(0, [0.1, 0.1, 0.002, 0.002, 0.03])
    turn, shift = rng.normal(0, 0.2, 3), rng.normal(0, 200, 3)
    cam = Camera(CameraModel((1280, 720), K, bend), R=rotation_from_vector(turn), t_mm=shift)
    body = marker(80, lean(30, rng.uniform(0, 6), 0.3), [*rng.uniform(-300, 300, 2), 1400])
    points = body.points_mm(0.0, body.planar.card_corners_mm)[0]
    ours = cam.project(points)
    theirs = cv2.projectPoints(points, turn, shift, K, bend)[0][:, 0]
    assert np.abs(ours - theirs).max() < 1e-6


POSES = [
    (70, lean(0, 0, 0.05), (0.0, 0.0, 1400.0)),
    (141, lean(0, 0, 0.01), (12.0, -7.0, 1400.0)),
    (94, lean(30, 0.7, 1.0), (150.0, 40.0, 1380.0)),
    (70, lean(45, 0.3, 0.2), (-210.0, 90.0, 1400.0)),
    (47, lean(60, 0.785, 0.1), (0.0, 0.0, 1400.0)),
    (94, lean(75, 0.1, 0.3), (-100.0, 0.0, 1400.0)),
]


def dark_centroid(planar, H):
    """Exact centroid of the dark area in the image, by the moments of its projected polygons."""
    area, first = 0.0, np.zeros(2)
    for x0, y0, x1, y1 in planar.dark_mm:
        p = apply_homography(H, [[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        q = np.roll(p, -1, axis=0)
        cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
        area += cross.sum() / 2
        first += ((p + q) * cross[:, None]).sum(axis=0) / 6
    return first / area


@pytest.mark.parametrize("pose", POSES)
def test_centroid_of_a_still_marker_is_where_truth_puts_it(pose):
    cam, body = camera(distortion=np.zeros(5)), marker(*pose)
    white, card, (x0, y0, x1, y1) = card_of(cam, body)
    dark = card - white
    x, y = np.arange(x0, x1), np.arange(y0, y1)
    found = np.array([(dark * x).sum(), (dark * y[:, None]).sum()]) / dark.sum()
    H = cam.model.K @ np.column_stack([body.R0[:, :2], body.t0_mm])
    assert np.abs(found - dark_centroid(body.planar, H)).max() < 5e-4  # demanded: 0.005 px


def brute_force(cam, body, box, fine=32, coarse=8):
    """White and card by counting points: no code in common with the renderer but the lens."""
    x0, y0, x1, y1 = box
    pad = 5
    pattern = np.pad(random_pattern(), 2)
    module = (body.planar.card_mm[2] - body.planar.card_mm[0]) / 15
    back = np.linalg.inv(np.column_stack([body.R0[:, :2], body.t0_mm]))
    x = (np.arange((x1 - x0 + 2 * pad) * fine) + 0.5) / fine - 0.5 + x0 - pad
    rows = []
    for row in range((y1 - y0 + 2 * pad) * coarse):
        y = ((row * fine // coarse) + np.arange(fine // coarse) + 0.5) / fine - 0.5 + y0 - pad
        px = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
        p = cam.model.ray(px) @ back.T
        at = np.floor(p[:, :2] / p[:, 2:] / module + 7.5).astype(int)
        inside = ((at >= 0) & (at < 15)).all(axis=1)
        dark = pattern[at[:, 1].clip(0, 14), at[:, 0].clip(0, 14)] & inside
        blocks = np.stack([inside & ~dark, inside]).astype(float).reshape(2, y.size, -1, y.size)
        rows.append(blocks.mean(axis=(1, 3)))
    image = np.stack(rows, axis=1)
    sigma = cam.optics.psf_px * coarse
    for axis in (1, 2):
        image = gaussian_filter1d(image, sigma, axis, truncate=6)
    h, w = y1 - y0 + 2 * pad, x1 - x0 + 2 * pad
    px = image.reshape(2, h, coarse, w, coarse).mean(axis=(2, 4))
    return px[:, pad:-pad, pad:-pad]


@pytest.mark.parametrize("pose", [POSES[0], POSES[3], POSES[4]])
def test_own_error_is_below_a_third_of_the_smallest_bound(pose):
    cam, body = camera(), marker(*pose)
    white, card, box = card_of(cam, body)
    exact_white, exact_card = brute_force(cam, body, box)
    slopes = np.gradient(exact_white)
    model = np.column_stack(
        [slopes[1].ravel(), slopes[0].ravel(), exact_white.ravel(), np.ones(white.size)]
    )
    fit = np.linalg.lstsq(model, (white - exact_white).ravel(), rcond=None)[0]
    assert np.abs(fit[:2]).max() < SMALLEST_BOUND_PX / 3
    assert (white - exact_white).std() * 170 < 0.25  # grey levels; noise is 1 to 2
    assert np.abs(card - exact_card).max() < 0.006


def row_centroids(cam, body, t_s, rows):
    white, card, (x0, y0, x1, _) = card_of(cam, body, t_s)
    dark = (card - white)[rows - y0]
    return (dark * np.arange(x0, x1)).sum(axis=1) / dark.sum(axis=1)


@pytest.mark.parametrize("row_time_s", [0.0, 27.8e-6, -21.0e-6])
def test_a_row_is_at_its_own_time(row_time_s):
    def gallop(t):  # uneven motion, so that a wrong time in either direction shows
        return np.column_stack([900.0 * t + 9000.0 * t**2, *np.zeros((5, t.size))])

    cam = camera(distortion=np.zeros(5), row_time_s=row_time_s)
    rows = np.arange(180, 300)
    at = 0.011
    found = row_centroids(cam, bar(Motion((gallop,))), at, rows)
    moved = gallop(at + row_time_s * rows)[:, 0]
    assert (
        np.abs(found - (cam.model.K[0, 0] * moved / 1400 + cam.model.K[0, 2])).max() < 0.003
    )  # one upright edge


def test_seen_at_finds_the_row_and_its_time():
    def rise(t):
        return np.column_stack([0 * t, 700.0 * t, *np.zeros((4, t.size))])

    cam = camera(row_time_s=30e-6)
    body = marker(70, np.eye(3), (0, 0, 1400), Motion((rise,)))
    px, t = seen_at(cam, body, np.array([0.0, 0.05]), np.array([[0.0, 0.0], [20.0, 30.0]]))
    for n in range(2):
        for k, point in enumerate([[0.0, 0.0], [20.0, 30.0]]):
            direct = cam.project(body.points_mm(t[n, k], [point])[0])[0]
            assert np.abs(px[n, k] - direct).max() < 1e-9
            assert abs(t[n, k] - (0.05 * n + 30e-6 * direct[1])) < 1e-11


@pytest.mark.parametrize("exposure_s", [0.002, 0.005, 0.010, 0.020])
def test_exposure_is_integrated_around_its_middle(exposure_s):
    def shake(t):
        return np.column_stack([6.0 * np.sin(2 * np.pi * 25 * t), *np.zeros((5, t.size))])

    cam = camera(distortion=np.zeros(5), exposure_s=exposure_s)
    found = row_centroids(cam, bar(Motion((shake,))), 0.01, np.array([240]))[0]
    mm = (found - cam.model.K[0, 2]) * 1400 / cam.model.K[0, 0]
    upright_edge_mm = 0.003 * 1400 / cam.model.K[0, 0]
    assert mm == pytest.approx(6.0 * np.sinc(25 * exposure_s), abs=upright_edge_mm)


def test_a_print_is_cut_at_the_picture_and_skipped_behind_the_camera():
    cam = camera()
    cut = marker(120, np.eye(3), (-470.0, 0.0, 1400.0))
    behind = marker(120, np.eye(3), (0.0, 0.0, -1400.0))
    plain = Renderer(scene(cam), "left").light(0.0)
    picture = Renderer(scene(cam, cut, behind), "left").light(0.0)
    changed = np.flatnonzero((picture != plain).any(axis=0))
    assert changed[0] == 0
    assert changed[-1] < 80
    assert reach(cam, behind, 0.0) is None


def test_noise_has_the_variance_of_the_model_and_gamma_follows():
    noisy = camera(read_noise_dn=1.5, shot_noise_dn=0.04)
    around = Surroundings(backdrop_dn=100.0)
    drawn = Renderer(scene(noisy, around=around), "left")
    clean = drawn.light(0.0)
    rest = drawn.frame(0, 0.0).astype(float) - clean
    assert rest.var() == pytest.approx((1.5**2 + 0.04 * clean + 1 / 12).mean(), rel=0.02)
    assert abs(rest.mean()) < 0.02
    curved = Renderer(scene(camera(gamma=2.2), around=around), "left").frame(0, 0.0)
    assert np.abs(curved - 255 * (clean / 255) ** (1 / 2.2)).max() <= 0.51


def test_same_frame_same_pixels_whatever_was_drawn_before():
    def shake(t):
        return np.column_stack([4 * np.sin(70 * t), *np.zeros((4, t.size)), 0.02 * np.sin(50 * t)])

    cam = camera(read_noise_dn=2.0, exposure_s=0.004)
    body = marker(70, lean(40, 1, 0.2), (0, 0, 1400), Motion((shake,)))
    one, two = (Renderer(scene(cam, body), "left") for _ in range(2))
    for n in range(4):
        one.frame(n, n / 30)
    assert np.array_equal(one.frame(7, 7 / 30), two.frame(7, 7 / 30))
    assert not np.array_equal(one.frame(7, 7 / 30), one.frame(8, 7 / 30))  # fresh noise
    assert not np.array_equal(
        one.frame(7, 7 / 30), Renderer(scene(cam, body), "right").frame(7, 7 / 30)
    )


def test_a_leaf_before_a_marker_covers_it_and_sways():
    def sway(t):
        return np.column_stack([30 * np.sin(6 * t), *np.zeros((5, t.size))])

    body = marker(70, np.eye(3), (0, 0, 1400))
    leaf = Leaf(np.array([0.0, 0.0, 1200.0]), (12.0, 5.0), 0.6, 75.0, Motion((sway,)))
    bare = Renderer(scene(camera(), body), "left").light(0.0)
    drawn = Renderer(scene(camera(), body, around=Surroundings(front=(leaf,))), "left")
    for t in (0.0, 0.25):
        covered = np.abs(drawn.light(t) - bare) > 1
        full = covered & (np.abs(drawn.light(t) - 75) < 0.5)
        centre = np.argwhere(full).mean(axis=0)[::-1]
        true = camera().project([[30 * np.sin(6 * t), 0, 1200.0]])[0]
        assert np.abs(centre - true).max() < 0.6
        assert 100 < covered.sum() < 260  # pi a b = 119 px² and its soft rim


def test_covered_share_is_the_leafs_area():
    cam = camera(distortion=np.zeros(5))
    leaf = Leaf(np.array([3.0, -2.0, 1200.0]), (12.0, 5.0), 0.6, 75.0)
    steps = (np.arange(200) + 0.5) / 200 - 0.5
    grid = 70 * np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    px = cam.project(marker(70, np.eye(3), (0, 0, 1400)).points_mm(0.0, grid)[0])
    true = np.pi * 12 * 5 / 1200**2 / (70 / 1400) ** 2
    assert covered_share((leaf, leaf), 0.0, cam.project, px) == pytest.approx(true, rel=0.01)


def test_light_is_uneven_and_dapples_wander():
    size = (640, 480)
    even = Renderer(scene(camera()), "left").light(0.0)
    sloped = Renderer(scene(camera(), around=Surroundings(gradient=0.5)), "left").light(0.0)
    assert np.allclose(sloped[:, [0, -1]] / even[:, [0, -1]], [0.5, 1.5])
    dapple = Dapple(light_in_shadow=0.35)
    shadows = Renderer(scene(camera(size_px=size), around=Surroundings(dapple=dapple)), "left")
    first, later = shadows.light(0.0) / even, shadows.light(0.3) / even
    assert first.min() == pytest.approx(0.35, abs=0.02)
    assert first.max() == pytest.approx(1.0, abs=0.02)
    assert np.abs(later - first).max() > 0.3


def test_opencv_finds_what_is_drawn_in_the_right_place():
    from olivevib.simulation import marker_planar

    body = Body(
        marker_planar("aruco:DICT_4X4_50", 7, 90.0), lean(25, 2.0, 0.5), np.array([40, -20, 1300.0])
    )
    picture = Renderer(scene(camera(), body), "left").frame(0, 0.0)
    settings_ = cv2.aruco.DetectorParameters()
    settings_.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    book = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    corners, ids, _ = cv2.aruco.ArucoDetector(book, settings_).detectMarkers(picture)
    assert ids.ravel().tolist() == [7]
    true = camera().project(body.points_mm(0.0, [[-45, -45], [45, -45], [45, 45], [-45, 45]])[0])
    assert np.abs(corners[0][0] - true).max() < 0.25  # OpenCV's own error
