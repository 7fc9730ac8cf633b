"""The paper's detector on rendered truth: places, turns, covariance, mirror, clutter, photos."""

from __future__ import annotations

import itertools
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rendered_markers import Canvas, Look, pose

from olivevib.detection.axes import axis_variances, cornerstone_covariances, shear_turns
from olivevib.detection.codes import CodeBook, square_homographies
from olivevib.detection.domains import Bars, dark_domains, principal_axes, rectangles
from olivevib.detection.loops import Candidates, candidate_loops
from olivevib.detection.paper import PaperReader
from olivevib.detection.settings import DetectionSettings
from olivevib.geometry import apply_homography
from olivevib.marker import MarkerLayout, generate_library, load_library

LIBRARY = load_library()
PLACES = [(110 + 212 * k, 100 + 174 * m) for m in range(4) for k in range(6)]


def scene(
    seed: int, size: float, tilt: float, count: int = 24, look: Look | None = None, **clutter
):
    """Markers 1…count in random azimuth and roll; the picture and H by id."""
    rng = np.random.default_rng(seed)
    canvas = Canvas(look=look or Look(), rng=rng)
    if clutter:
        canvas.clutter(**clutter)
    truth = {}
    for k in range(count):
        at = np.array(PLACES[k]) + rng.uniform(-8, 8, 2)
        H = pose(11, size, tilt, rng.uniform(0, 360), rng.uniform(0, 360), at)
        canvas.add(LIBRARY.layout.pattern(LIBRARY.codes[k]), H)
        truth[int(LIBRARY.ids[k])] = H
    return canvas.grey(), truth


def places(H: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return apply_homography(H, [[0, 0]])[0], apply_homography(H, LIBRARY.layout.cornerstones)


@pytest.mark.parametrize(("size", "tilt", "limit"), [(40, 20, 0.1), (56, 40, 0.1), (64, 0, 0.08)])
def test_every_marker_is_found_where_it_is(size, tilt, limit):
    grey, truth = scene(1, size, tilt)
    found = PaperReader(LIBRARY).detect(grey)
    assert [d.id for d in found] == sorted(truth)
    errors = np.array([d.centre_px - places(truth[d.id])[0] for d in found])
    assert np.sqrt((errors**2).mean()) < limit
    for d in found:
        assert np.abs(d.corners_px - places(truth[d.id])[1]).max() < 1.2
        assert d.raw_row == pytest.approx([d.centre_px[1], *d.corners_px[:, 1]])
        assert d.bit_errors == 0
        assert d.flags == ()
        assert d.localiser == "paper"


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_corners_turn_with_the_code(turn):
    canvas = Canvas(320, 240)
    H = pose(11, 70, 0, 0, turn + 3, (150.3, 120.8))
    canvas.add(LIBRARY.layout.pattern(LIBRARY.code(12)), H)
    (d,) = PaperReader(LIBRARY).detect(canvas.grey())
    centre, corners = places(H)
    assert d.id == 12
    assert np.abs(d.corners_px - corners).max() < 0.6
    assert np.abs(d.centre_px - centre).max() < 0.2


def test_the_mean_of_the_cornerstones_is_biased_and_the_homography_is_not():
    canvas = Canvas()
    truth, bias = [], []
    for k, at in enumerate(PLACES):
        H = pose(11, 96, 45, 90, 0, at)
        canvas.add(LIBRARY.layout.pattern(LIBRARY.codes[k]), H)
        truth.append(places(H)[0])
        bias.append(places(H)[1].mean(axis=0) - truth[-1])
    grey = canvas.grey()
    errors = {}
    for paper_centre in (False, True):
        reader = PaperReader(LIBRARY, DetectionSettings(paper_centre=paper_centre))
        found = reader.detect(grey)
        assert len(found) == 24
        errors[paper_centre] = np.array([d.centre_px for d in found]) - truth
    assert np.abs(errors[False].mean(axis=0)).max() < 0.06
    assert np.linalg.norm(np.mean(bias, axis=0)) > 0.8
    assert np.abs(errors[True].mean(axis=0) - np.mean(bias, axis=0)).max() < 0.06


def test_covariances_hold_against_sampling():
    """Pooled over sizes, tilts and pixel phases the 95 % ellipses hold about 95 % of the errors."""
    inside_centre, inside_corners, normalised = [], [], []
    reader = PaperReader(LIBRARY)
    for size, tilt in ((32, 30), (48, 0), (48, 50), (64, 30), (80, 60), (96, 20)):
        grey, truth = scene(size + tilt, size, tilt)
        for d in reader.detect(grey):
            centre, corners = places(truth[d.id])
            e, c = d.centre_px - centre, (d.corners_px - corners).ravel()
            m = e @ np.linalg.solve(d.centre_cov_px2, e)
            normalised.append(m)
            inside_centre.append(m < 5.99)
            inside_corners.append(c @ np.linalg.solve(d.corners_cov_px2, c) < 15.51)
    assert len(inside_centre) > 130
    assert 0.90 < np.mean(inside_centre) <= 0.99
    assert 0.85 < np.mean(inside_corners) <= 0.99
    assert 1.2 < np.mean(normalised) < 2.6  # ideal 2


def test_cornerstone_derivatives_against_differences():
    rng = np.random.default_rng(4)
    centre = np.array([[50, 20], [85, 52], [48, 80], [18, 49.0]]) + rng.normal(0, 1, (4, 2))
    angle = np.array([0.05, 1.6, -0.03, 1.55])
    axis = np.column_stack([np.cos(angle), np.sin(angle)])
    one = np.full(4, 40.0)
    bars = Bars(centre, axis, one, one / 7, one * 40 / 7, np.arange(4))
    loop = np.arange(4)[None]

    def corners(across: np.ndarray, turn: np.ndarray) -> np.ndarray:
        normal = np.column_stack([-axis[:, 1], axis[:, 0]])
        moved, turned = centre + across[:, None] * normal, axis + turn[:, None] * normal
        points = []
        for k in range(4):
            A = np.column_stack([turned[k - 1], -turned[k]])
            s = np.linalg.solve(A, moved[k] - moved[k - 1])
            points.append(moved[k - 1] + s[0] * turned[k - 1])
        return np.array(points)

    start = corners(np.zeros(4), np.zeros(4))
    H = square_homographies(start[None], 5.0)
    claimed = cornerstone_covariances(bars, Candidates(loop, start[None]), H, MarkerLayout())[0]
    across, turn = axis_variances(bars)
    want = np.zeros((8, 8))
    step = 1e-4
    for k in range(4):
        for variance, which in ((across, 0), (turn, 1)):
            change = np.zeros((2, 4))
            change[which, k] = step
            slope = (corners(*change) - corners(*-change)).ravel() / (2 * step)
            want += variance[k] * np.outer(slope, slope)
    rest = np.linalg.eigvalsh(claimed - want)  # what all bars share: outward and shear, rank two
    assert np.abs(rest[:6]).max() < 1e-8
    assert rest[6] > 1e-5


def test_shear_turns_the_axis_as_drawn():
    canvas = Canvas(400, 400, Look(samples=8, noise=0, psf_px=0))
    H = pose(11, 200, 60, 40, 25, (640, 360)) @ np.eye(3)
    H = np.array([[1, 0, -440], [0, 1, -160], [0, 0, 1.0]]) @ H
    canvas.add(LIBRARY.layout.pattern(LIBRARY.codes[0]), H)
    turns = shear_turns((H / H[2, 2])[None], LIBRARY.layout)[0]
    domains = dark_domains((canvas.light < 125).astype(np.uint8))
    middles = apply_homography(H, [[0, -5], [5, 0], [0, 5], [-5, 0]])
    ends = apply_homography(H, [[1, -5], [5, 1], [1, 5], [-5, 1.0]])
    for k in range(4):
        at = np.linalg.norm(domains.centre - middles[k], axis=1).argmin()
        axis = principal_axes(domains.moments[[at]])[2][0]
        side = ends[k] - middles[k]
        sine = (side[0] * axis[1] - side[1] * axis[0]) / np.linalg.norm(side)
        measured = np.arcsin(sine * np.sign(side @ axis))
        assert measured == pytest.approx(turns[k], abs=0.004)
    assert np.abs(turns).max() > 0.008


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10_000))
def test_domains_by_runs_agree_with_pixels(seed):
    rng = np.random.default_rng(seed)
    dark = (rng.random((23, 31)) < 0.35).astype(np.uint8)
    domains = dark_domains(dark)
    count, labels = cv2.connectedComponents(dark, connectivity=8)
    assert domains.area.size == count
    wanted = np.arange(1, count)
    bars = rectangles(domains, wanted)
    for k in wanted:
        y, x = np.nonzero(labels == k)
        p = np.column_stack([x, y]).astype(float)
        assert domains.area[k] == len(p)
        assert domains.centre[k] == pytest.approx(p.mean(0))
        d = p - p.mean(0)
        cov = d.T @ d / len(p) + np.eye(2) / 12
        assert domains.moments[k] == pytest.approx([cov[0, 0], cov[1, 1], cov[0, 1]])
        u = bars.axis[k - 1]
        extents = np.ptp(d @ np.column_stack([u, [-u[1], u[0]]]), axis=0) + 1
        assert bars.length[k - 1] == pytest.approx(extents.max())
        assert bars.width[k - 1] == pytest.approx(extents.min())


def test_no_domain_at_all():
    reader = PaperReader(LIBRARY)
    assert reader.detect(np.full((60, 80), 200, np.uint8)) == []
    assert reader.mirrored_ids(np.zeros((60, 80), np.uint8)) == ()


def naive_loops(bars: Bars, config: DetectionSettings, shape: tuple[int, int]) -> set[frozenset]:
    """Loops by trying all fours, each as its set of bar pairs."""

    def linked(i: int, j: int) -> bool:
        far = np.linalg.norm(bars.centre[i] - bars.centre[j])
        near = far <= config.pos * max(bars.length[i], bars.length[j])
        (a, b), (c, d) = bars.axis[i], bars.axis[j]
        return near and abs(a * d - b * c) >= np.sin(np.radians(config.angle_deg))

    def meet(i: int, j: int) -> np.ndarray:
        A = np.column_stack([bars.axis[i], -bars.axis[j]])
        return (
            bars.centre[i] + np.linalg.solve(A, bars.centre[j] - bars.centre[i])[0] * bars.axis[i]
        )

    found = set()
    for a, b, c, d in itertools.permutations(range(len(bars)), 4):
        loop = (a, b, c, d)
        if a != min(loop) or b > d or not all(linked(loop[k - 1], loop[k]) for k in range(4)):
            continue
        p = np.array([meet(loop[k - 1], loop[k]) for k in range(4)])
        between = all(
            (p[k] - bars.centre[loop[k]]) @ (p[(k + 1) % 4] - bars.centre[loop[k]]) < 0
            for k in range(4)
        )
        sides = np.roll(p, -1, axis=0) - p
        ahead = np.roll(sides, -1, axis=0)
        turns = np.sign(sides[:, 0] * ahead[:, 1] - sides[:, 1] * ahead[:, 0])
        area = abs(cv2.contourArea(p.astype(np.float32)))
        inside = (p >= 0).all() and (p <= [shape[1] - 1, shape[0] - 1]).all()
        if between and abs(turns.sum()) == 4 and area >= 30 and inside:
            found.add(frozenset(frozenset((loop[k - 1], loop[k])) for k in range(4)))
    return found


@pytest.mark.parametrize("seed", [3, 4])
def test_loops_agree_with_trying_all_fours(seed):
    grey, _ = scene(seed, 60, 30, count=2)
    bars = PaperReader(LIBRARY)._bars(grey)
    rest = np.random.default_rng(seed).permutation(np.argsort(-bars.length)[8:])[:6]
    bars = bars.only(np.sort(np.concatenate([np.argsort(-bars.length)[:8], rest])))
    config = DetectionSettings(pos=4.0)
    found = candidate_loops(bars, config, grey.shape)
    got = [
        frozenset(frozenset((int(loop[k - 1]), int(loop[k]))) for k in range(4))
        for loop in found.bars
    ]
    assert len(got) == len(set(got)) >= 2
    assert set(got) == naive_loops(bars, config, grey.shape)
    following = np.roll(found.corners, -1, axis=1)
    cross = found.corners[..., 0] * following[..., 1] - found.corners[..., 1] * following[..., 0]
    assert (cross.sum(axis=1) > 60).all()  # clockwise on the screen


def test_mirrored_markers_are_reported_not_misread():
    grey, truth = scene(5, 60, 30, count=8)
    mirror = np.ascontiguousarray(grey[:, ::-1])
    reader = PaperReader(LIBRARY)
    assert reader.detect(mirror) == []
    assert reader.mirrored_ids(mirror) == tuple(sorted(truth))
    assert reader.mirrored_ids(grey) == ()


def test_parameters_of_the_paper_do_what_they_say():
    grey, truth = scene(6, 60, 30, count=8)
    for strict in ({"fill": 0.98}, {"pos": 0.8}, {"angle_deg": 89.9}):
        assert len(PaperReader(LIBRARY, DetectionSettings(**strict)).detect(grey)) < len(truth)
    assert len(PaperReader(LIBRARY, DetectionSettings(pos=1.1)).detect(grey)) == len(truth)


def test_wrong_modules_are_counted_and_limited():
    canvas = Canvas(320, 240)
    pattern = LIBRARY.layout.pattern(LIBRARY.code(5)).copy()
    pattern[3, 3] ^= True
    pattern[6, 5] ^= True
    canvas.add(pattern, pose(11, 70, 10, 0, 30, (150, 120)))
    grey = canvas.grey()
    (d,) = PaperReader(LIBRARY).detect(grey)
    assert (d.id, d.bit_errors) == (5, 2)
    assert PaperReader(LIBRARY, DetectionSettings(conf=1 / 49)).detect(grey) == []


def test_a_marker_seen_twice_is_said_so():
    canvas = Canvas(640, 240)
    for at, size in (((150, 120), 60), ((450, 120), 80)):
        canvas.add(LIBRARY.layout.pattern(LIBRARY.code(5)), pose(11, size, 0, 0, 10, at))
    (d,) = PaperReader(LIBRARY).detect(canvas.grey())
    assert "duplicate" in d.flags
    assert d.centre_px[0] == pytest.approx(450, abs=1)


def test_a_finer_layout_is_read_too():
    layout = MarkerLayout(modules=13, code=9, bar=9)
    library = generate_library(28, mirrors=True, seed=2, layout=layout, budget=70_000)
    canvas = Canvas(640, 480)
    H = pose(13, 110, 35, 70, 120, (300, 200))
    canvas.add(layout.pattern(library.codes[3]), H)
    (d,) = PaperReader(library).detect(canvas.grey())
    assert d.id == library.ids[3]
    assert np.abs(d.corners_px - apply_homography(H, layout.cornerstones)).max() < 1
    assert np.abs(d.centre_px - apply_homography(H, [[0, 0]])[0]).max() < 0.25


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 77), st.integers(0, 3), st.integers(0, 2), st.integers(0, 1000))
def test_codes_match_in_every_turn(row, turn, wrong, seed):
    reading = np.rot90(LIBRARY.codes[row], -turn).copy()
    at = np.random.default_rng(seed).choice(49, wrong, replace=False)
    reading.ravel()[at] ^= True
    match = CodeBook(LIBRARY.codes).match(reading[None])
    assert (match.row[0], match.turn[0], match.mismatches[0]) == (row, turn, wrong)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10_000))
def test_square_homographies_map_the_corners(seed):
    rng = np.random.default_rng(seed)
    square = np.array([[0, 0], [90, 0], [90, 90], [0, 90.0]])
    corners = square + rng.uniform(-25, 25, (4, 2))
    H = square_homographies(corners[None], 5.0)[0]
    assert apply_homography(H, LIBRARY.layout.cornerstones) == pytest.approx(corners, abs=1e-6)


def test_nothing_is_read_in_clutter_and_markers_are_found_in_it():
    reader = PaperReader(LIBRARY)
    for seed in range(3):
        canvas = Canvas(rng=np.random.default_rng(seed))
        canvas.clutter()
        grey = canvas.grey()
        assert reader.detect(grey) == []
        assert reader.mirrored_ids(grey) == ()
    grey, truth = scene(9, 60, 30, count=12, leaves=1800)
    assert [d.id for d in reader.detect(grey)] == sorted(truth)


@pytest.mark.slow
def test_cost_of_a_clutter_frame_against_opencv():
    canvas = Canvas(rng=np.random.default_rng(1))
    canvas.clutter()
    grey = canvas.grey()
    peer = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000))
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    cost = {}
    for name, work in (("ours", PaperReader(LIBRARY).detect), ("cv2", peer.detectMarkers)):
        times = []
        for _ in range(5):
            start = time.process_time()
            work(grey)
            times.append(time.process_time() - start)
        cost[name] = min(times)
    cv2.setNumThreads(threads)
    assert cost["ours"] < 2.5 * cost["cv2"]


def frames(path: Path, step: int):
    import av

    with av.open(str(path)) as container:
        for number, frame in enumerate(container.decode(video=0)):
            if number % step == 0:
                plane = frame.planes[0]
                rows = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)
                yield rows[: frame.height, : frame.width].copy()


def no_marker(reader: PaperReader, grey: np.ndarray) -> None:
    assert reader.detect(grey) == []
    assert reader.mirrored_ids(grey) == ()


@pytest.mark.shared
def test_no_marker_of_ours_on_any_real_photo(shared_data):
    reader = PaperReader(LIBRARY)
    photos = sorted((shared_data / "calibration").rglob("*.jpg"))
    assert len(photos) > 50
    for photo in photos:
        no_marker(reader, cv2.imread(str(photo), cv2.IMREAD_GRAYSCALE))


@pytest.mark.shared
def test_no_marker_of_ours_in_sampled_frames_of_real_videos(shared_data):
    reader = PaperReader(LIBRARY)
    videos = sorted((shared_data / "calibration").rglob("*.mp4"))
    assert videos
    for video in videos:
        for grey in frames(video, step=30):
            no_marker(reader, grey)
