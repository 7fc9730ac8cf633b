"""The fine detector: the template against the renderer, fits against the bound, markers found."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from rendered_markers import Canvas, Look, pose
from scipy.special import ndtr
from test_detection_paper import LIBRARY, PLACES, no_marker, places, scene

from olivevib.detection.blur import PIXEL_VARIANCE, Blur
from olivevib.detection.card_fit import fit_card
from olivevib.detection.domains import Bars
from olivevib.detection.fitted_points import point_jacobian
from olivevib.detection.hypotheses import frame_hypotheses
from olivevib.detection.pixels import marker_pixels
from olivevib.detection.refine import fit_template
from olivevib.detection.template import card, draw_template
from olivevib.detection.template_reader import TemplateReader
from olivevib.geometry import apply_homography, homography

STONES = LIBRARY.layout.cornerstones


def one_marker(size: float, tilt: float, seed: int, samples: int = 8, noise: float = 2.0):
    """Noise-free levels (200, 200) of one marker, its H and row."""
    rng = np.random.default_rng(seed)
    canvas = Canvas(200, 200, Look(samples=samples, noise=noise), rng=rng)
    at = np.array([639.5, 359.5]) + rng.uniform(-0.5, 0.5, 2)
    H = pose(11, size, tilt, rng.uniform(0, 360), rng.uniform(0, 360), at)
    H = np.array([[1, 0, -540], [0, 1, -260], [0, 0, 1.0]]) @ H
    row = int(rng.integers(len(LIBRARY.ids)))
    canvas.add(LIBRARY.layout.pattern(LIBRARY.codes[row]), H / H[2, 2])
    return canvas, H / H[2, 2], row


def noisy(levels: np.ndarray, rng: np.random.Generator, sigma: float = 2.0) -> np.ndarray:
    return np.clip(np.rint(levels + rng.normal(0, sigma, levels.shape)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("size", "tilt"), [(24, 0), (32, 60), (64, 30)])
def test_the_drawing_agrees_with_the_renderer(size, tilt):
    canvas, H, row = one_marker(size, tilt, 1, samples=8)
    white = card(LIBRARY.layout.pattern(LIBRARY.codes[row]), 2)
    template = draw_template(white, H, Blur(0.49 + PIXEL_VARIANCE))
    y, x = np.mgrid[40:160, 40:160]
    on = (np.array([x, y]).reshape(2, -1).T - template.origin_px) * template.samples
    maps = on.astype(np.float32).reshape(120, 120, 2)
    level = cv2.remap(
        template.texture, maps, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    inside = np.abs(apply_homography(np.linalg.inv(H), np.column_stack([x.ravel(), y.ravel()])))
    inside = (inside.max(axis=1) < 6.1).reshape(120, 120)
    want = (canvas.light[40:160, 40:160] - 40) / 170
    assert np.sqrt(((level[..., 0] - want)[inside] ** 2).mean()) < 0.004  # 0.7 of 170 levels


@pytest.mark.parametrize(
    ("size", "tilt", "limit"),
    [
        (24, 0, 0.0033),
        pytest.param(48, 0, 0.002, marks=pytest.mark.slow),
        pytest.param(64, 60, 0.0022, marks=pytest.mark.slow),
    ],
)
def test_centres_reach_the_bound_and_their_ellipses_hold(size, tilt, limit):
    """Bounds of the knowledge page (noise 2): rmse within sampling error of 1.10 times."""
    rng = np.random.default_rng(size)
    errors, normalised, claimed = [], [], []
    for seed in range(12):
        canvas, H, row = one_marker(size, tilt, seed, samples=8)
        white = card(LIBRARY.layout.pattern(LIBRARY.codes[row]), 2)
        corners = apply_homography(H, STONES)
        for _ in range(12):
            grey = noisy(canvas.light, rng)
            fit = None
            start, blur = homography(STONES, corners + rng.normal(0, 0.3, (4, 2))), Blur(0.7)
            for _ in range(2):
                pixels = marker_pixels(grey, start, 11)
                fit = fit_template(draw_template(white, start, blur), pixels)
                start, blur = fit.H, Blur(blur.variance_px2 + fit.further[0])
            assert fit.converged
            e = apply_homography(fit.H, [[0, 0]])[0] - apply_homography(H, [[0, 0]])[0]
            J = point_jacobian(fit.H, fit.to_template, np.zeros((1, 2)), (fit.centre, fit.scale))[0]
            C = J @ fit.covariance @ J.T
            errors.append(e)
            claimed.append(np.trace(C) / 2)
            normalised.append(e @ np.linalg.solve(C, e))
            assert np.sqrt(blur.variance_px2 - PIXEL_VARIANCE) == pytest.approx(0.7, abs=0.03)
    assert np.sqrt(np.mean(claimed)) == pytest.approx(limit, rel=0.12)
    assert np.sqrt((np.array(errors) ** 2).mean()) < 1.10 * limit * (1 + 2 / np.sqrt(4 * 144))
    assert 0.88 <= (np.array(normalised) < 5.99).mean() <= 0.99


def exact(white: np.ndarray, at: np.ndarray, module: float, turn: float, psf: float, side: int):
    """Light (side, side) of a marker seen straight on: normal integrals and Gauss nodes a pixel."""
    nodes, weights = leggauss(4)
    y, x = np.mgrid[:side, :side] + 0.0
    n = len(white)
    edges = np.concatenate([[-1e3], np.arange(1, n) - n / 2, [1e3]])[:, None]
    out = np.zeros(side * side)
    for a, wa in zip(nodes / 2, weights / 2, strict=True):
        for b, wb in zip(nodes / 2, weights / 2, strict=True):
            dx, dy = (x + a - at[0]) / module, (y + b - at[1]) / module
            u, v = np.cos(turn) * dx + np.sin(turn) * dy, np.cos(turn) * dy - np.sin(turn) * dx
            across, down = (
                np.diff(ndtr((edges - c.ravel()) * module / psf), axis=0) for c in (u, v)
            )
            out += wa * wb * ((white @ across) * down).sum(axis=0)
    return 40 + 170 * out.reshape(side, side)


@pytest.mark.parametrize(
    ("size", "turn_deg", "psf"),
    [(24, 0.0, 0.7), (32, 0.0, 0.4), (32, 89.0, 0.7), (48, 1.0, 0.7), (48, 45.0, 0.4)],
)
def test_no_bias_where_edges_lie_along_the_pixels(size, turn_deg, psf):
    """Reading points of a ramp was 1 to 3 thousandths of a pixel off here, as much as the noise."""
    rng = np.random.default_rng(size)
    off = []
    for row in range(4):
        white = card(LIBRARY.layout.pattern(LIBRARY.codes[row]), 2)
        side, module, turn = int(2 * np.ceil(0.75 * size + 8)), size / 11, np.radians(turn_deg)
        at = side / 2 + rng.uniform(-0.5, 0.5, 2)
        c, s = module * np.cos(turn), module * np.sin(turn)
        H = np.array([[c, -s, at[0]], [s, c, at[1]], [0, 0, 1.0]])
        start = H.copy()
        start[:2, 2] += 0.05, -0.05
        light = exact(white, at, module, turn, psf, side)
        one = fit_card(light.astype(np.float32), white, start, LIBRARY.layout)
        assert np.sqrt(one.blur.variance_px2 - PIXEL_VARIANCE) == pytest.approx(psf, abs=0.005)
        off.append(one.fit.H[:2, 2] - at)
    assert np.sqrt(np.mean(np.square(off))) < 0.0003


def test_a_colour_sensor_moves_no_centre():
    """A demosaiced picture's blur alternates from pixel to pixel: 0.01 px if it is not fitted."""
    rng = np.random.default_rng(0)
    off, claimed = [], []
    for seed in range(12):
        canvas, H, row = one_marker(24, 45, seed, samples=8)
        colour = cv2.cvtColor(noisy(canvas.light, rng, 0.5), cv2.COLOR_BayerBG2BGR)
        grey = cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY)
        one = fit_card(grey, card(LIBRARY.layout.pattern(LIBRARY.codes[row]), 2), H, LIBRARY.layout)
        off.append(one.fit.H[:2, 2] - H[:2, 2])
        J = point_jacobian(
            one.fit.H, one.fit.to_template, np.zeros((1, 2)), (one.fit.centre, one.fit.scale)
        )[0]
        claimed.append(np.trace(J @ one.fit.covariance @ J.T) / 2)
        assert one.fit.further.size == 1
    rmse = np.sqrt(np.mean(np.square(off)))
    assert rmse < 0.004
    assert rmse < 1.6 * np.sqrt(np.mean(claimed))


def test_derivatives_of_points_against_refitting():
    canvas, H, row = one_marker(64, 40, 5)
    white = card(LIBRARY.layout.pattern(LIBRARY.codes[row]), 2)
    grey = noisy(canvas.light, np.random.default_rng(0))
    fit = fit_template(draw_template(white, H, Blur()), marker_pixels(grey, H, 11))
    points = np.vstack([[[0, 0]], STONES])
    J = point_jacobian(fit.H, fit.to_template, points, (fit.centre, fit.scale))
    N = np.array([[1, 0, -fit.centre[0]], [0, 1, -fit.centre[1]], [0, 0, fit.scale]]) / fit.scale
    key = N @ fit.H

    def moved(change: np.ndarray) -> np.ndarray:
        W = fit.to_template.copy()
        W.ravel()[:8] += change
        on_key = fit.to_template @ key  # module to template, fixed
        return apply_homography(np.linalg.inv(N) @ np.linalg.inv(W) @ on_key, points)

    for k in range(8):
        step = np.zeros(8)
        step[k] = 1e-5
        slope = (moved(step) - moved(-step)) / 2e-5
        assert J[:, :, k] == pytest.approx(slope, abs=1e-4 * (1 + np.abs(slope).max()))


@pytest.mark.parametrize(
    ("size", "tilt"), [(24, 50), (32, 60), (48, 70), (64, 75), (64, 0), (96, 75)]
)
def test_steep_and_small_markers_are_found_and_measured(size, tilt):
    grey, truth = scene(size + tilt, size, tilt, look=Look())
    found = TemplateReader(LIBRARY).detect(grey)
    assert [d.id for d in found] == sorted(truth)
    errors = np.array([d.centre_px - places(truth[d.id])[0] for d in found])
    claimed = np.mean([np.trace(d.centre_cov_px2) / 2 for d in found])
    assert np.sqrt((errors**2).mean()) < 1.5 * np.sqrt(claimed)
    assert np.abs(errors).max() < 0.05
    for d in found:
        assert np.abs(d.corners_px - places(truth[d.id])[1]).max() < 0.15
        assert d.flags == ()
        assert d.localiser == "template"


@pytest.mark.parametrize("azimuth", [0, 90, 180, 270])
def test_of_a_steep_marker_one_line_and_the_blobs_beside_its_ends_are_enough(azimuth):
    """The other line is lost in the code, and blobs as long as wide point nowhere."""
    H = pose(11, 96, 80, azimuth, 0, np.array([639.5, 359.5]))
    ends = np.array([[[-3.5, -5], [3.5, -5]], [[-5, -3.5], [-5, 3.5]], [[5, -3.5], [5, 3.5]]])
    px = np.array([apply_homography(H, pair) for pair in ends])
    length = np.linalg.norm(px[:, 1] - px[:, 0], axis=1)
    if length[0] < length[1]:  # tilted the other way: the upright bars are the long ones
        px = np.array([apply_homography(H, pair[:, ::-1]) for pair in ends])
        length = np.linalg.norm(px[:, 1] - px[:, 0], axis=1)
    axis = (px[:, 1] - px[:, 0]) / length[:, None]
    axis[1:] = [np.sqrt(0.5), np.sqrt(0.5)]
    length[1:], width = 11.0, np.array([1.7, 10.0, 10.0])
    bars = Bars(px.mean(axis=1), axis, length, width, length * width, np.arange(3))
    frames = frame_hypotheses(bars, LIBRARY.layout)
    off = np.linalg.norm(frames.centre - [639.5, 359.5], axis=1)
    best = frames.only(off < 3.0)
    assert len(best) == 1
    area = np.linalg.det(np.stack([best.a[0], best.b[0]]))
    assert area == pytest.approx((96 / 11) ** 2 * np.cos(np.radians(80)), rel=0.1)


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_corners_turn_with_the_code(turn):
    canvas = Canvas(320, 240)
    H = pose(11, 70, 20, 30, turn + 3, (150.3, 120.8))
    canvas.add(LIBRARY.layout.pattern(LIBRARY.code(12)), H)
    (d,) = TemplateReader(LIBRARY).detect(canvas.grey())
    assert d.id == 12
    assert np.abs(d.corners_px - places(H)[1]).max() < 0.05


def test_mirrored_markers_are_reported_not_misread():
    grey, truth = scene(5, 60, 30, count=8)
    mirror = np.ascontiguousarray(grey[:, ::-1])
    reader = TemplateReader(LIBRARY)
    assert reader.detect(mirror) == []
    assert reader.mirrored_ids(mirror) == tuple(sorted(truth))
    assert reader.mirrored_ids(grey) == ()


def test_nothing_is_read_in_clutter_and_markers_are_found_in_it():
    reader = TemplateReader(LIBRARY)
    for seed in range(3):
        canvas = Canvas(rng=np.random.default_rng(seed))
        canvas.clutter()
        no_marker(reader, canvas.grey())
    grey, truth = scene(9, 60, 30, count=12, leaves=1800)
    assert [d.id for d in reader.detect(grey)] == sorted(truth)


@pytest.mark.shared
def test_no_marker_of_ours_on_any_real_photo(shared_data):
    reader = TemplateReader(LIBRARY)
    photos = sorted((shared_data / "calibration").rglob("*.jpg"))
    assert len(photos) >= 90
    for photo in photos:
        no_marker(reader, cv2.imread(str(photo), cv2.IMREAD_GRAYSCALE))


def test_empty_images_are_empty():
    reader = TemplateReader(LIBRARY)
    assert reader.detect(np.full((60, 80), 200, np.uint8)) == []
    assert reader.mirrored_ids(np.zeros((60, 80), np.uint8)) == ()
    assert len(PLACES) == 24
