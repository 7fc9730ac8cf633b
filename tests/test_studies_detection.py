"""The studies of detection: the renderer against itself, the bound, scores, and small runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from olivevib.geometry import apply_homography
from olivevib.studies import Effort
from olivevib.studies.detection import accuracy, clutter, follow, hardship, speed, throughput
from olivevib.studies.detection.bound import centre_bound_px
from olivevib.studies.detection.canvas import (
    CLEAR,
    Hardship,
    Look,
    Print,
    centre_of,
    lay,
    moved,
    photo,
    pose,
)
from olivevib.studies.detection.readers import Seen, everyone, ours
from olivevib.studies.detection.scenes import Cell, full_pictures, lower_limit, score, single
from olivevib.studies.detection.weather import covered, smoothed_noise
from olivevib.studies.factorial import FACTORS, mean_effects


def window(size: float, tilt: float, turn: float = 33.0) -> np.ndarray:
    H = pose(11, size, (tilt, 20.0, turn), (639.8, 359.3))
    return moved(H, (-540, -260))


def drawn(H: np.ndarray, look: Look, hard: Hardship = CLEAR) -> np.ndarray:
    light = np.full((200, 200), 120.0)
    lay(light, ours().prints[3], H, look, hard)
    return light


@pytest.mark.parametrize("turn", [0.0, 33.0])
def test_the_renderer_agrees_with_a_finer_one(turn):
    H = window(48, 40, turn)
    coarse, fine = drawn(H, Look()), drawn(H, Look(samples=20))
    assert np.sqrt(((coarse - fine) ** 2).mean()) < 0.06  # of 170 levels; noise is 2
    what = ours().prints[3]
    bound = centre_bound_px(what, H, Look(samples=3), (200, 200))
    assert bound == pytest.approx(0.0022, rel=0.1)  # knowledge: 48 px / 45 deg .0022
    step = 0.05
    slopes = [
        (drawn(moved(H, by), Look()) - drawn(moved(H, (-by[0], -by[1])), Look())) / (2 * step)
        for by in ((step, 0.0), (0.0, step))
    ]
    J = np.column_stack([s.ravel() for s in slopes])
    off = np.linalg.lstsq(J, (coarse - fine).ravel(), rcond=None)[0]
    assert np.abs(off).max() < bound / 3


def test_a_pixel_is_the_share_of_points_of_it_that_lie_on_white():
    """From the definition, without the renderer's ways: points through the inverse pose."""
    H, what = window(48, 50), ours().prints[3]
    got = drawn(H, Look(psf_px=0.0, samples=8))
    x, y = np.meshgrid(np.arange(75.0, 125), np.arange(75.0, 125))
    at = (np.arange(16) + 0.5) / 16 - 0.5
    parts = np.broadcast_arrays(x[..., None, None] + at, y[..., None, None] + at[:, None])
    px = np.stack(parts, axis=-1)
    u, v = apply_homography(np.linalg.inv(H), px.reshape(-1, 2)).T
    i, j = np.floor(u + 5.5).astype(int), np.floor(v + 5.5).astype(int)
    inside = (np.abs(u) < 5.5) & (np.abs(v) < 5.5)
    card = (np.abs(u) < 7.5) & (np.abs(v) < 7.5)
    assert inside.sum() > 100_000  # the marker is there
    dark = inside & what.dark[np.clip(j, 0, 10), np.clip(i, 0, 10)]
    want = np.where(card, np.where(dark, 40.0, 210.0), 120.0).reshape(50, 50, -1).mean(axis=2)
    off = got[75:125, 75:125] - want
    assert np.abs(off.mean()) < 0.05
    assert np.sqrt((off**2).mean()) < 1.0  # of 170 levels, without any blur


def test_bounds_of_the_knowledge_page():
    for size, tilt, bound in ((24, 0, 0.0033), (64, 60, 0.0022)):
        H = window(size, tilt)
        got = centre_bound_px(ours().prints[5], H, Look(samples=3), (200, 200))
        assert got == pytest.approx(bound, rel=0.1)


def test_covers_hide_the_share_they_state():
    rng = np.random.default_rng(1)
    at = (np.arange(400) + 0.5) / 400 * 11 - 5.5
    u, v = np.meshgrid(at, at)
    for corner in (True, False):
        mask = covered(0.15, 30.0, corner)(rng)(window(48, 0), 5.5).mask
        assert mask(u, v).mean() == pytest.approx(0.15, abs=0.01)


def test_motion_keeps_the_centre_and_the_light():
    H = window(48, 20)
    still, smeared = (drawn(H, Look(motion_px=path)) for path in ((0.0, 0.0), (9.0, 4.0)))
    assert smeared.mean() == pytest.approx(still.mean(), rel=2e-3)


def test_every_detector_reads_its_own_markers():
    for peer in everyone():
        light, marker, H = single(peer, Cell(60, (10, 30)), np.random.default_rng(4))
        (seen,) = peer.read(photo(light, 2.0, np.random.default_rng(5)))
        assert seen.id == marker
        assert np.linalg.norm(seen.centre - centre_of(H)) < 0.6


def test_a_score_counts_misses_errors_and_wrong_ids():
    truth = {1: np.eye(3), 2: np.array([[1, 0, 50.0], [0, 1, 50], [0, 0, 1]])}
    seen = [Seen(1, np.array([0.3, 0.0]), (), np.eye(2)), Seen(7, np.zeros(2))]
    got = score(seen, truth)
    assert (got.share, got.wrong, got.silent) == (0.5, 1, 1)
    assert got.inside == 1.0
    assert got.worst_px == pytest.approx(0.3)
    assert lower_limit(300, 300) == pytest.approx(0.05 ** (1 / 300))


def test_denoised_noise_is_correlated_and_as_strong():
    noise = smoothed_noise(np.full((200, 200), 120.0), 3.0, np.random.default_rng(1)) - 120.0
    assert noise.std() == pytest.approx(3.0, rel=0.05)
    assert np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1] > 0.4


def test_mean_effects_of_a_plan():
    runs = np.array([[0, 0, 0, 0.4, 10, 0.9], [10, 0, 0, 0.4, 10, 0.9]], dtype=float)
    effects = mean_effects(runs, np.array([1.0, 3.0]))
    assert list(effects) == list(FACTORS)
    assert effects["rx"][:2].tolist() == [1, 3]
    assert effects["ry"][0] == 2


FEWER = {  # cells of each study that all of its goals still need
    accuracy: {"SIZES_PX": (24, 48), "TILTS_DEG": (0, 60), "PSF_PX": (0.4, 1.5)},
    hardship: {"PATHS_PX": (0.0, 9.0)},
    clutter: {},
    speed: {"COUNTS": (0, 10, 30), "REPEATS": 1},
    throughput: {"LEAST_S": 1.0, "REPEATS": 1},
    follow: {
        "SIZES_PX": (48,), "TILTS_DEG": (0, 75), "REACH_DEG": {48: 80},
        "PATHS_PX": (9.0, 12.0, 18.0, 24.0), "SPEED_MARKERS": 3,
    },
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "run",
    [accuracy.run, hardship.blur, clutter.run, speed.run, follow.run, throughput.run],
)
def test_small_runs_measure_every_goal(run, monkeypatch):
    """Every way and every goal of a study on a few of its cells."""
    (module,) = (m for m in FEWER if m.__name__ == run.__module__)
    for name, cells in FEWER[module].items():
        monkeypatch.setattr(module, name, cells)
    study = run(Effort(0.001), lambda *_: None)
    assert study.tables and study.goals
    assert all(goal.measured for goal in study.goals)


def test_prints_have_their_corners_where_the_pose_says():
    dark = np.ones((4, 4), bool)
    light = np.full((100, 100), 210.0)
    H = np.array([[10.0, 0, 50], [0, 10, 50], [0, 0, 1]])
    lay(light, Print(dark, 1.0), H, Look(psf_px=0.1))
    corners = apply_homography(H, np.array([[-2.0, -2], [2, 2]]))
    assert light[50, int(corners[0, 0]) + 2] == pytest.approx(40, abs=1)
    assert light[50, int(corners[0, 0]) - 2] == pytest.approx(210, abs=1)
    assert light[50, int(corners[0, 0])] == pytest.approx(125, abs=10)  # the edge halves a pixel


def test_markers_at_80_degrees_are_found():
    """Lines 1.5 px thick: one of the two is often lost in the code."""
    seen = full_pictures(ours(), Cell(96.0, (80.0, 80.0)), 45, lambda k: Effort().draws(1, 88, k))
    assert seen.share == 1.0
    assert seen.wrong == 0
    assert seen.silent == 0


def test_a_smeared_marker_is_found_by_its_two_sharp_bars_however_it_is_tilted():
    """9 px of motion leave two opposite bars; at 50 deg they are 2.2 of their lengths apart."""
    cell = Cell(48.0, (0.0, 50.0), replace(Look(), motion_px=(9.0, 0.0)))
    seen = full_pictures(ours(), cell, 96, np.random.default_rng)
    assert seen.share == 1.0
    assert seen.wrong == 0
