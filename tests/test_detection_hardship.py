"""The fine detector in shadow, dappled sun, motion, behind leaves, and in bad pictures."""

from __future__ import annotations

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from rendered_markers import Canvas, Look, cover, dapple, motion, pose, shadow_edge
from test_detection_paper import LIBRARY, PLACES, places

from olivevib.detection.blur import Blur
from olivevib.detection.card_fit import blurred_pixels, fit_card
from olivevib.detection.fitted_points import fitted_points
from olivevib.detection.noise import autocorrelation, edge_noise, noise_covariance
from olivevib.detection.template import card, draw_template
from olivevib.detection.template_reader import TemplateReader
from olivevib.files.prints import marker_modules
from olivevib.geometry import apply_homography, homography
from olivevib.marker import (
    MarkerLayout,
    MarkerLibrary,
    false_match_probability,
    generate_library,
    load_library,
)


def scene(seed: int, size: float = 48, look: Look | None = None):
    rng = np.random.default_rng(seed)
    canvas = Canvas(look=look or Look(), rng=rng)
    truth = {}
    for k, place in enumerate(PLACES):
        at = np.array(place) + rng.uniform(-5, 5, 2)
        H = pose(11, size, rng.uniform(0, 50), rng.uniform(0, 360), rng.uniform(0, 360), at)
        canvas.add(LIBRARY.layout.pattern(LIBRARY.codes[k]), H)
        truth[int(LIBRARY.ids[k])] = H
    return canvas, truth


def measured(grey: np.ndarray, truth: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Errors (n, 2) of the centres, whether flagged, and normalised squares; no id is wrong."""
    found = TemplateReader(LIBRARY).detect(grey)
    assert {d.id for d in found} <= set(truth)
    errors = np.array([d.centre_px - places(truth[d.id])[0] for d in found])
    normalised = [
        e @ np.linalg.solve(d.centre_cov_px2, e) for d, e in zip(found, errors, strict=True)
    ]
    return errors, np.array([bool(d.flags) for d in found]), np.array(normalised)


def rms(errors: np.ndarray) -> float:
    return float(np.sqrt((errors**2).mean()))


def test_a_hard_shadow_across_the_marker():
    canvas, truth = scene(1)
    for H in truth.values():
        shadow_edge(canvas, H, 0.35, canvas.rng.uniform(-12, 12))
    errors, flagged, _ = measured(canvas.grey(), truth)
    assert len(errors) >= 23
    assert rms(errors) < 0.03
    assert flagged.all()


def test_dappled_sun():
    canvas, truth = scene(2)
    dapple(canvas)
    errors, flagged, normalised = measured(canvas.grey(), truth)
    assert len(errors) >= 23
    assert rms(errors) < 0.05
    assert flagged[np.abs(errors).max(axis=1) > 0.1].all()
    assert (normalised < 5.99).mean() > 0.8


@pytest.mark.parametrize("level", [30.0, 220.0])
@pytest.mark.parametrize("corner", [True, False])
def test_a_cover_of_15_percent(level, corner):
    canvas, truth = scene(3)
    for H in truth.values():
        cover(canvas, H, 0.15, level, corner)
    errors, flagged, _ = measured(canvas.grey(), truth)
    assert len(errors) == 24
    assert rms(errors) < 0.02
    assert np.abs(errors).max() < 0.05
    assert flagged.mean() > 0.85


@pytest.mark.slow
def test_errors_under_a_cover_of_25_percent_are_flagged():
    for corner in (True, False):
        for level in (30.0, 220.0):
            canvas, truth = scene(4)
            for H in truth.values():
                cover(canvas, H, 0.25, level, corner)
            errors, flagged, _ = measured(canvas.grey(), truth)
            if len(errors):
                assert flagged[np.abs(errors).max(axis=1) > 0.1].all()


@pytest.mark.parametrize(("path", "share", "limit"), [(6, 1.0, 0.010), (9, 0.85, 0.012)])
def test_motion_blur(path, share, limit):
    canvas, truth = scene(5)
    motion(canvas, path)
    errors, _, _ = measured(canvas.grey(), truth)
    assert len(errors) >= share * 24
    assert rms(errors) < limit


@pytest.mark.slow
@pytest.mark.parametrize("psf", [0.4, 1.0, 1.5])
def test_an_unknown_point_spread(psf):
    canvas, truth = scene(6, look=Look(samples=8, psf_px=psf))
    errors, flagged, normalised = measured(canvas.grey(), truth)
    assert len(errors) == 24
    assert not flagged.any()
    assert rms(errors) < {0.4: 0.0022, 1.0: 0.0038, 1.5: 0.0050}[psf]
    assert (normalised < 5.99).mean() > 0.8


def jpeg(canvas: Canvas) -> np.ndarray:
    packed = cv2.imencode(".jpg", canvas.grey(), [cv2.IMWRITE_JPEG_QUALITY, 50])[1]
    return cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE)


def demosaiced(canvas: Canvas) -> np.ndarray:
    noise = cv2.GaussianBlur(canvas.rng.normal(0, 5, canvas.light.shape), (0, 0), 0.7)
    return np.clip(np.rint(canvas.light + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("spoilt", [jpeg, demosaiced])
def test_ellipses_hold_where_noise_is_correlated(spoilt):
    canvas, truth = scene(7, look=Look())
    errors, flagged, normalised = measured(spoilt(canvas), truth)
    assert len(errors) == 24
    assert not flagged.any()
    assert rms(errors) < 0.008
    assert (normalised < 5.99).mean() >= 0.83  # 20 of 24; 95 % expected
    assert np.mean(normalised) < 4


def test_a_finer_layout_and_close_codes():
    layout = MarkerLayout(modules=13, code=9, bar=9)
    library = generate_library(28, mirrors=True, seed=2, layout=layout, budget=70_000)
    canvas = Canvas(640, 480)
    H = pose(13, 70, 35, 70, 120, (300, 200))
    canvas.add(layout.pattern(library.codes[3]), H)
    (d,) = TemplateReader(library).detect(canvas.grey())
    assert d.id == library.ids[3]
    assert np.abs(d.corners_px - apply_homography(H, layout.cornerstones)).max() < 0.05
    codes = LIBRARY.codes[:2].copy()
    codes[1] = codes[0]
    codes[1, 3, 3] ^= True  # a library of distance 1: nothing may be corrected
    close = MarkerLibrary("close", np.array([1, 2]), codes, LIBRARY.layout, 1)
    for row in (0, 1):
        canvas = Canvas(320, 240)
        canvas.add(LIBRARY.layout.pattern(codes[row]), pose(11, 60, 20, 0, 30, (150, 120)))
        assert [d.id for d in TemplateReader(close).detect(canvas.grey())] == [row + 1]


def test_a_foreign_square_is_fitted_as_well():
    """The template takes any pattern: an ArUco marker's centre to a few thousandths of a pixel."""
    library = load_library("aruco:DICT_4X4_50")
    errors = []
    for k in range(6):
        rng = np.random.default_rng(k)
        canvas = Canvas(200, 200, Look(samples=8), rng=rng)
        H = pose(6, 50, 30, rng.uniform(0, 360), rng.uniform(0, 360), (639.5, 359.5))
        H = np.array([[1, 0, -540.2], [0, 1, -259.7], [0, 0, 1.0]]) @ H
        dark = marker_modules(library, k)
        canvas.add(dark, H / H[2, 2], quiet=1.5)
        corners = apply_homography(H, library.layout.cornerstones) + rng.normal(0, 0.4, (4, 2))
        start = homography(library.layout.cornerstones, corners)
        one = fit_card(canvas.grey(), card(dark, 1), start, library.layout)
        px, covariance = fitted_points(one.fit, np.zeros((1, 2)))
        errors.append((px[0] - apply_homography(H, [[0, 0]])[0]) / np.sqrt(np.diag(covariance)))
        assert np.sqrt(covariance[0, 0]) < 0.004
    assert 0.4 < rms(np.array(errors)) < 1.7


def test_autocorrelation_of_white_and_of_smoothed_noise():
    rng = np.random.default_rng(1)
    noise = np.zeros((84, 84), np.float32)
    seen = np.zeros_like(noise)
    seen[2:-2, 2:-2] = 1
    white = rng.normal(0, 3, (80, 80))
    noise[2:-2, 2:-2] = white
    kernel = autocorrelation(noise, seen)
    assert kernel[2, 2] == pytest.approx(9, rel=0.05)
    assert np.count_nonzero(kernel) == 1
    noise[2:-2, 2:-2] = cv2.GaussianBlur(white, (0, 0), 0.8)
    kernel = autocorrelation(noise, seen)
    assert np.count_nonzero(kernel) > 8
    assert kernel[2, 3] / kernel[2, 2] == pytest.approx(np.exp(-1 / (4 * 0.64)), abs=0.08)
    assert np.array_equal(kernel, kernel[::-1, ::-1])


def test_what_a_fit_takes_out_of_smooth_noise_is_given_back():
    """A fit of slow waves to few pixels leaves residuals quieter than the noise was."""
    rng = np.random.default_rng(4)
    n = 24
    y, x = (part.ravel() for part in np.mgrid[:n, :n])
    waves = [np.cos(np.pi * (a * x + b * y) / n) for a in range(4) for b in range(4)]
    J = np.array(waves, np.float32)
    E = np.asarray(np.linalg.solve(J @ J.T, J), dtype=np.float32)
    pixels, clear, flat = SimpleNamespace(x=x, y=y), np.ones(n * n, bool), np.zeros_like(J[0])
    stated, true, left = [], [], []
    for _ in range(100):
        noise = cv2.GaussianBlur(rng.normal(0, 3, (n + 10, n + 10)), (0, 0), 0.7)[5:-5, 5:-5]
        noise = noise.ravel().astype(np.float32)
        residual = noise - (E @ noise) @ J
        stated.append(np.trace(noise_covariance(pixels, (J, E), residual, clear, flat)[0]))
        true.append(((E @ noise)[:8] ** 2).sum())
        left.append(residual.var() / noise.var())
    assert np.mean(left) < 0.9  # what is to be given back
    assert np.mean(stated) == pytest.approx(np.mean(true), rel=0.1)


def test_noise_that_grows_with_the_slope_is_seen_and_white_noise_left_alone():
    rng = np.random.default_rng(2)
    slope2 = rng.exponential(1.0, 4000).astype(np.float32)
    clear = np.ones(4000, bool)
    white = rng.normal(0, 2, 4000).astype(np.float32)
    assert (edge_noise(white, slope2, clear) == 1).all()
    louder = (white * np.sqrt(1 + 2 * slope2)).astype(np.float32)
    noise = edge_noise(louder, slope2, clear)
    assert np.sqrt((noise**2).mean()) == pytest.approx(1, rel=1e-3)
    assert noise == pytest.approx(np.sqrt((1 + 2 * slope2) / 3), rel=0.2)


def test_false_matches_are_as_rare_as_stated():
    """Random readings of a small code match as often as the formula says."""
    from olivevib.detection.codes import CodeBook

    library = LIBRARY.only(tuple(range(1, 65)))
    assert false_match_probability(library, 4) == pytest.approx(
        1.1e-7, rel=0.1
    )  # knowledge: N = 64
    rng = np.random.default_rng(3)
    read = rng.integers(0, 2, (40_000, 7, 7)).astype(bool)
    matches = (CodeBook(library.codes).match(read).mismatches <= 11).mean()
    assert matches == pytest.approx(false_match_probability(library, 11), rel=0.15)


def test_a_pixel_counts_where_its_whole_path_lies_on_the_card():
    grey = np.zeros((200, 200), np.uint8)
    H = np.array([[5.0, 0, 100], [0, 5.0, 100], [0, 0, 1]])
    blur = Blur(1.0, (12.0, 0.0))
    still, moved = (blurred_pixels(grey, H, b, LIBRARY.layout) for b in (Blur(1.0), blur))
    edge = 5 * (5.5 + 2) - 2 * 1.0  # card, less two sigma
    assert abs(still.x - 100).max() == abs(still.y - 100).max() == 30  # 0.6 modules about it
    assert abs(moved.x - 100).max() == int(edge - 6)
    assert abs(moved.y - 100).max() == 30  # nothing is lost across the motion


def test_a_path_is_drawn_with_its_own_derivatives():
    """The textures by the path's x and y say what a slightly longer path looks like."""
    white = card(LIBRARY.layout.pattern(LIBRARY.codes[0]), 2)
    H = np.array([[4.4, 0.3, 60], [-0.4, 4.2, 60], [0, 0, 1]])
    drawn = draw_template(white, H, Blur(motion_px=(9.0, 5.0)))
    assert drawn.moving
    for axis, longer in enumerate(((9.6, 5.0), (9.0, 5.6))):
        change = draw_template(white, H, Blur(motion_px=longer)).texture[..., 0]
        change = (change - drawn.texture[..., 0])[8:-8, 8:-8]
        linear = 0.6 * drawn.texture[8:-8, 8:-8, 4 + axis]
        assert np.abs(change - linear).max() < 0.25 * np.abs(change).max()
        assert np.vdot(change, linear) > 0.97 * np.linalg.norm(change) * np.linalg.norm(linear)


def test_a_gradient_of_light_is_blurred_with_the_marker():
    """Light falls on the marker before the lens smears it: 3:1 across it moves no centre."""
    errors, squares = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        canvas = Canvas(200, 200, Look(25, 130, psf_px=1.0, samples=8), rng=rng)
        H = pose(11, 48, 20, rng.uniform(0, 360), rng.uniform(0, 360), (639.8, 359.1))
        H = np.array([[1, 0, -540.0], [0, 1, -260], [0, 0, 1]]) @ H
        canvas.add(LIBRARY.layout.pattern(LIBRARY.codes[seed]), H / H[2, 2], slope=(0.02, 0.0))
        (d,) = TemplateReader(LIBRARY).detect(canvas.grey())
        e = d.centre_px - apply_homography(H, [[0, 0]])[0]
        errors.append(e)
        squares.append(e @ np.linalg.solve(d.centre_cov_px2, e))
        assert d.flags == ()
    assert rms(np.array(errors)) < 0.006
    assert np.mean(squares) < 5


def test_a_strip_that_hides_most_of_a_bar_moves_no_centre():
    canvas, truth = scene(8)
    for H in truth.values():
        cover(canvas, H, 0.10, 30.0, corner=False)
    errors, flagged, normalised = measured(canvas.grey(), truth)
    assert len(errors) >= 23
    assert rms(errors) < 0.006
    assert flagged.all()
    assert (normalised < 5.99).mean() > 0.7
