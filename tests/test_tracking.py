"""Location rectangles, re-initialisation, resumption and the states of missing samples."""

import numpy as np
import pytest
from scenes import aruco_pattern, draw_square

from olivevib.marker import load_library
from olivevib.signals import State, fit_stamps
from olivevib.tracking import FrameTimes, Tracker, assemble

SIZE = (320, 240)
SQUARE = np.array([[-22, -22], [22, -22], [22, 22], [-22, 22.0]])


@pytest.fixture(scope="module")
def library():
    return load_library("aruco:DICT_4X4_50")


def frame(places: dict[int, tuple[float, float]], seed: int) -> np.ndarray:
    """An image of markers 44 px wide at those centres on a plain card."""
    rng = np.random.default_rng(seed)
    image = np.full((SIZE[1], SIZE[0]), 210, np.uint8)
    for marker, (x, y) in places.items():
        left, top = int(x) - 40, int(y) - 40
        corners = SQUARE + np.array([x - left, y - top])
        image[top : top + 80, left : left + 80] = draw_square(
            aruco_pattern(marker), corners, (80, 80), rng
        )
    return image


def paths(k: int) -> dict[int, tuple[float, float]]:
    return {1: (90 + 3 * k, 80 + 2 * np.sin(k)), 5: (230 - 2 * k, 160.0)}


def test_follows_two_markers_and_finds_one_that_returns(library):
    tracker = Tracker(library)
    for k in range(8):
        places = paths(k)
        if k in (3, 4):
            del places[5]
        found = {d.id: d for d in tracker.update(frame(places, k), k / 30)}
        assert set(found) == set(places)
        for marker, centre in places.items():
            assert np.abs(found[marker].centre_px - centre).max() < 0.1
            assert found[marker].raw_row[0] == pytest.approx(found[marker].centre_px[1])


def test_memory_makes_a_resumed_run_identical(library):
    frames = [frame(paths(k), k) for k in range(6)]
    whole = Tracker(library)
    straight = [whole.update(f, k / 30) for k, f in enumerate(frames)]
    first = Tracker(library)
    for k in range(3):
        first.update(frames[k], k / 30)
    second = Tracker(library)
    second.recall(first.memory())
    assert second.memory() == first.memory()
    for k in range(3, 6):
        for a, b in zip(straight[k], second.update(frames[k], k / 30), strict=True):
            assert a.id == b.id
            assert (a.corners_px == b.corners_px).all()
            assert (a.corners_cov_px2 == b.corners_cov_px2).all()


def times(stamps: list[float], damaged: frozenset[int] = frozenset()) -> FrameTimes:
    return FrameTimes(fit_stamps(stamps), 0.0, 20e-6, float("nan"), SIZE, damaged)


def seen_at(tracker: Tracker, places, seed=0):
    return tracker.update(frame(places, seed), float(seed))


def test_states_tell_dropped_damaged_hidden_lost_and_outside(library):
    tracker = Tracker(library)
    middle, border = {1: (160.0, 120.0)}, {1: (279.0, 120.0)}
    here, edge = seen_at(tracker, middle), seen_at(Tracker(library), border)
    stamps = [k / 10 for k in range(32) if k != 2]
    frames = [here] * 31
    frames[4] = []  # count 5: a gap of a frame
    frames[6] = []  # count 7: the frame that would not decode
    frames[10:25] = [[]] * 15  # longer than a second
    frames[29], frames[30] = edge, []
    (track,) = assemble("left", frames, times(stamps, frozenset({6})), [1])
    assert track.frame.size == 32
    words = [State(s).word for s in track.state]
    assert words[2] == "dropped"
    assert words[5] == "hidden"
    assert words[7] == "damaged"
    assert words[15] == "lost"
    assert words[31] == "outside"
    assert words[0] == words[3] == "seen"
    assert np.isnan(track.centre_px[2]).all()
    assert np.isfinite(track.t_s).all()


def test_each_observation_has_the_time_of_its_own_row(library):
    here = seen_at(Tracker(library), {1: (160.0, 120.0)})
    (track,) = assemble("left", [here] * 5, times([k / 30 for k in range(5)]), [1])
    assert track.t_s[2] == pytest.approx(2 / 30 + 20e-6 * here[0].raw_row[0], abs=1e-12)
