"""What is told while recording and at once after it: rate, drops, blur, light, prompts, verdict."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from boards_simulated import grid
from rendered_markers import Canvas, Look
from small_videos import make_video

from olivevib.calibration.guidance import Guide, tilts_of
from olivevib.calibration.views import BoardView
from olivevib.cli.capture import status_line
from olivevib.detection import Detector
from olivevib.files.capture import Beat, CameraFacts, Controls, Mode, Shot
from olivevib.geometry import CameraModel, rotation_from_vector
from olivevib.marker import load_library
from olivevib.pipeline.capture import (
    CameraResult,
    CapturePlan,
    Prompter,
    advise,
    capture,
    good_for,
    judge,
    rehearsal,
)
from olivevib.pipeline.capture.known import known_readout_s
from olivevib.pipeline.capture.looks import grey_of_shot, look_at
from olivevib.pipeline.capture.prompts import MotionSense
from olivevib.pipeline.capture.verdict import camera_offset_s, judge_board, known_setup
from olivevib.planning import Setup, outlook, reach
from olivevib.planning.words import frequencies
from olivevib.signals import fit_stamps
from olivevib.studies.capture.camera import jpeg
from olivevib.trial.camera_book import CameraMode, Entry, remember

LIBRARY = load_library("olive49")


# --- rate and drops


def beat_of(stamps):
    beat = Beat()
    for stamp in stamps:
        beat.add(float(stamp))
    return beat


@pytest.mark.parametrize("late", [0.0, 0.05, 0.1])
@pytest.mark.parametrize("drops", [0, 7, 60])
def test_drops_are_counted_as_they_happen(late, drops):
    rng = np.random.default_rng(drops)
    stamps = np.arange(1500) / 30 + rng.exponential(late / 30, 1500)
    stamps = np.maximum.accumulate(stamps) + np.arange(1500) * 1e-6
    kept = np.ones(1500, bool)
    kept[rng.choice(np.arange(20, 1490), drops, replace=False)] = False
    beat = beat_of(stamps[kept])
    assert beat.dropped == drops
    assert beat.period_s == pytest.approx(1 / 30, rel=2e-3)
    assert 20 < beat.fps < 30.5


def test_a_slow_change_of_the_rate_is_no_drop():
    period = np.linspace(1 / 30.3, 1 / 29.7, 3000)
    assert beat_of(np.cumsum(period)).dropped == 0


def test_nothing_is_claimed_before_there_is_something_to_go_by():
    beat = beat_of([0.0])
    assert (beat.dropped, math.isnan(beat.fps), math.isnan(beat.period_s)) == (0, True, True)


# --- pictures


def tree(psf_px=0.7, noise=2.0, white=210.0, dark=40.0, module_px=6.0):
    """Two markers, drawn with known blur and levels."""
    canvas = Canvas(320, 200, Look(psf_px=psf_px, noise=noise, white=white, dark=dark))
    for k, at in enumerate(((80, 100), (230, 100))):
        c, s = module_px * np.cos(0.2 + k), module_px * np.sin(0.2 + k)
        H = np.array([[c, -s, at[0]], [s, c, at[1]], [1e-3, 5e-4, 1.0]])
        canvas.add(LIBRARY.layout.pattern(LIBRARY.code(k + 1)), H)
    return canvas.grey()


def looked(grey):
    return look_at(grey, 1.0, Detector(LIBRARY).detect(grey), LIBRARY.layout)


@pytest.mark.parametrize("psf_px", [0.5, 0.8, 1.2, 1.7])
def test_blur_is_measured_on_the_markers_themselves(psf_px):
    look = looked(tree(psf_px))
    assert look.ids == (1, 2)
    assert look.blur_px == pytest.approx(psf_px, abs=0.12)


def test_levels_of_paper_and_print_are_measured():
    look = looked(tree(white=180.0, dark=60.0))
    assert look.white_dn == pytest.approx(182, abs=6)
    assert look.dark_dn == pytest.approx(60, abs=8)
    assert look.saturated == 0.0


def test_advice_names_what_to_change():
    assert advise(looked(tree()), Controls(2000.0, 1.0)) == ()
    assert "2 ms or less" in advise(looked(tree()), Controls(8000.0, 1.0))[0]
    assert "too bright" in advise(looked(tree(white=262.0)), Controls())[0]
    assert "dark" in advise(looked(tree(white=90.0, dark=20.0)), Controls())[0]
    assert "contrast" in advise(looked(tree(white=150.0, dark=105.0, noise=1.0)), Controls())[0]
    assert "blurred" in advise(looked(tree(psf_px=2.2, module_px=8.0)), Controls())[0]


def test_a_picture_without_markers_gives_no_blur_and_no_advice_on_markers():
    look = looked(np.full((48, 64), 90, np.uint8))
    assert look.ids == ()
    assert math.isnan(look.blur_px)
    assert advise(look, Controls()) == ()


def facts(codec="mjpeg", pixels="", size=(128, 96)):
    return CameraFacts("t", "t", "", "http", codec, pixels, size, 30.0, "host")


def test_previews_are_the_luma_as_it_was_coded(tmp_path):
    grey = grey_of_shot(Shot(jpeg(), None, 0), facts())
    assert grey.shape == (96, 128)
    assert grey_of_shot(Shot(b"\xff\xd8 torn", None, 0), facts()) is None
    raw = np.arange(64 * 48 * 2, dtype=np.uint32).astype(np.uint8)
    luma = grey_of_shot(Shot(raw.tobytes(), None, 0), facts("rawvideo", "uyvy422", (64, 48)))
    assert np.array_equal(luma, raw[1::2].reshape(48, 64))
    assert grey_of_shot(Shot(b"short", None, 0), facts("rawvideo", "gray", (64, 48))) is None


# --- prompts


WHOLE = ["rest", "start", "starting", "steady", "stop", "decay", "done"]


def prompts(moving_at, seconds=40.0, step=0.25):
    """Phase after phase, with the time at which each began."""
    prompter, out = Prompter(), []
    for t in np.arange(0, seconds, step):
        prompt = prompter.update(float(t), moving_at(float(t)))
        if not out or out[-1][0] != prompt.phase:
            out.append((prompt.phase, float(t)))
    return out


def test_prompts_follow_the_shaker():
    told = prompts(lambda t: 6 <= t < 20)
    assert [phase for phase, _ in told] == WHOLE
    began = dict(told)
    assert began["start"] == pytest.approx(2.0)
    assert began["starting"] == pytest.approx(6.0)
    assert began["steady"] == pytest.approx(7.5)
    assert began["stop"] == pytest.approx(17.5)
    assert began["decay"] == pytest.approx(20.0)
    assert began["done"] == pytest.approx(23.0)


def test_the_rest_counts_from_when_nothing_moves():
    assert dict(prompts(lambda t: t < 3))["start"] == pytest.approx(5.0, abs=0.3)


def test_a_shaker_that_stops_early_is_noticed():
    told = prompts(lambda t: 4 <= t < 9)
    assert [phase for phase, _ in told] == ["rest", "start", "starting", "steady", "decay", "done"]


def test_without_markers_the_prompts_go_by_time():
    phases = [phase for phase, _ in prompts(lambda t: None)]
    assert phases == WHOLE


def test_motion_is_told_from_noise():
    sense = MotionSense()
    rng = np.random.default_rng(1)
    for k in range(6):
        sense.add(_at(k * 0.2, rng.normal(0, 0.05, (2, 2)) + 100))
    assert sense.moving() is False
    for k in range(6, 10):
        sense.add(_at(k * 0.2, rng.normal(0, 4, (2, 2)) + 100))
    assert sense.moving() is True
    assert MotionSense().moving() is None


def _at(t_s, centres):
    look = looked(np.full((48, 64), 90, np.uint8))
    return type(look)(t_s, (1, 2), centres, math.nan, 200.0, 40.0, 0.0)


# --- the board


def view(t_s, centre, turn=(0.0, 0.0, 0.0), distance=900.0):
    """A board of 5 x 5 points, seen by a pinhole."""
    camera = CameraModel(
        (1280, 720), np.array([[950.0, 0, 640], [0, 950, 360], [0, 0, 1]]), np.zeros(5)
    )
    board = grid(5, 60.0)
    middle = np.array([(centre[0] - 640) / 950, (centre[1] - 360) / 950, 1.0]) * distance
    points = (board - board.mean(axis=0)) @ rotation_from_vector(turn).T + middle
    return BoardView(0, t_s, np.arange(25), camera.project(points), board, 0.1)


def test_tilts_are_named_by_the_nearer_side():
    assert tilts_of(view(0.0, (640, 360))) == set()
    assert tilts_of(view(0.0, (640, 360), (0.0, 0.5, 0.0))) == {"right"}
    assert tilts_of(view(0.0, (640, 360), (0.0, -0.5, 0.0))) == {"left"}
    assert tilts_of(view(0.0, (640, 360), (0.5, 0.0, 0.0))) == {"upper"}
    assert tilts_of(view(0.0, (640, 360), (-0.5, 0.0, 0.0))) == {"lower"}


def test_coverage_says_where_to_go_next_and_when_it_is_enough():
    coverage = Guide()
    assert "left picture" in coverage.state().words
    size, t = (1280, 720), 0.0
    for turn in ((0.0, 0.5, 0.0), (0.0, -0.5, 0.0), (0.5, 0.0, 0.0)):
        for x in (160, 480, 800, 1120):
            for y in (150, 360, 570):
                t, far = t + 0.5, 700.0 if x < 640 else 1100.0
                coverage.add("left", view(t, (x, y), turn, far), size)
                coverage.add("right", view(t + 0.01, (x, y), turn, far), size)
        told = coverage.state()
        if turn[1] > 0:
            assert not told.enough
            assert told.words == "show the board with its left side nearer to the cameras"
    assert told.enough
    assert told.cells == {"left": 1.0, "right": 1.0}
    assert told.pairs >= 20
    assert judge_board([_result("left"), _result("right")], told).words.endswith("calibration")


def test_views_that_show_nothing_new_are_not_counted():
    coverage = Guide()
    for k in range(50):
        coverage.add("left", view(k * 0.3, (640, 360)), (1280, 720))
        coverage.add("right", view(k * 0.3, (640, 360)), (1280, 720))
    assert coverage.state().pairs == 1
    assert not coverage.state().enough
    thin = judge_board([_result("left"), _result("right")], coverage.state())
    assert [c.code for c in thin.cautions] == ["board-coverage-thin"]


# --- the verdict


def _result(side, **more):
    late = {"left": 0.0, "right": 0.0093}[side]
    seen = dict.fromkeys(range(1, 9), 1.0)
    told = {"stamps_s": np.arange(300) / 30 + late, "promised_fps": 30.0, "seen": seen}
    told |= {"looks": 40, "losses": 0, "ended": "stopped", "blur_px": 0.8, "saturated": 0.0}
    return CameraResult(side=side, **{**told, **more})


def judged(**more):
    return judge([_result("left", **more), _result("right")], (5.0, 45.0), tuple(range(1, 9)))


def test_a_good_recording_is_praised_in_one_sentence():
    told = judged()
    start = "8 of 8 markers, 0 drops, cameras 9.3 ms apart: good for 5–29.6, 30.4–45 Hz"
    assert told.words.startswith(start)
    assert told.cautions == ()
    assert told.offset_s == pytest.approx(0.0093)


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ({"seen": {1: 1.0, 2: 0.2}}, "markers-not-in-both"),
        ({"stamps_s": np.delete(np.arange(300) / 30, [40, 41, 90])}, "dropped-frames"),
        ({"stamps_s": np.arange(150) / 15}, "frame-rate-low"),
        ({"stamps_s": np.zeros(0), "ended": "unplugged"}, "camera-delivered-nothing"),
        ({"losses": 1, "ended": "unplugged"}, "camera-vanished"),
        ({"blur_px": 2.4}, "picture-blurred"),
        ({"saturated": 0.3}, "picture-saturated"),
    ],
)
def test_what_is_wrong_with_a_recording_has_a_code_and_a_remedy(more, code):
    found = [c for c in judged(**more).cautions if c.code == code]
    assert len(found) == 1
    assert found[0].remedy


def test_a_recording_that_shows_no_marker_at_all_says_so():
    nothing = [_result(side, seen={}) for side in ("left", "right")]
    assert [c.code for c in judge(nothing, None, ()).cautions] == ["no-markers"]
    unwatched = [_result(side, seen={}, looks=0) for side in ("left", "right")]
    assert judge(unwatched, None, ()).cautions == ()


def test_the_offset_between_the_cameras_is_within_half_a_frame():
    for late in (-0.012, -0.001, 0.0, 0.0093, 0.016):
        left = fit_stamps(np.arange(200) / 30)
        right = fit_stamps(np.arange(3, 190) / 30 + late)
        assert camera_offset_s(left, right) == pytest.approx(late, abs=1e-9)


def steady(fps):
    return fit_stamps(np.arange(int(10 * fps) + 1) / fps)


def said(fps, offset_s, band_hz=None, readout_s=None):
    return good_for(known_setup((steady(fps), steady(fps)), offset_s, band_hz, readout_s))


def test_what_a_pair_of_cameras_is_good_for():
    assert said(120.0, 0.002, (5.0, 45.0)) == "good for 5–45 Hz (direct)"
    assert said(30.0, math.nan, (5.0, 14.0)) == "good for 5–14 Hz (direct)"
    step = said(30.0, 0.0)
    assert step.startswith(
        "good for no frequency of 5–45 Hz for sure; ambiguous 5–14.6, 15.4–27.4,"
    )
    assert "blind 14.7–15.3, 27.5–32.5, 44.7–45 Hz" in step
    assert "the row time is not known, and the cameras are not 8-13 ms apart" in step
    assert "a band declared below 15 Hz would be direct" in step
    known = said(30.0, 0.0, None, 0.02)  # the book knows the rows: they decide
    assert "good for 5–9.6, 10.4–14.6, 15.4–19.6, 20.4–27.4, 32.6–39.6" in known
    assert "blind 27.5–32.5 Hz" in known
    apart = said(30.0, 0.0093)
    assert "good for 5–29.6, 30.4–45 Hz (confirmable from" in apart
    assert said(30.0, math.nan).startswith("good for no frequency of 5–45 Hz")
    assert good_for(known_setup((None, None), math.nan, None, None)) == "nothing was recorded"


@pytest.mark.parametrize("offset_s", [math.nan, 0.0, 0.0093, 0.0165])
@pytest.mark.parametrize("readout_s", [None, 0.0, 0.02])
def test_the_verdict_is_that_of_the_plan(offset_s, readout_s):
    """Each line of ``olivevib plan``'s table lies in the range that the verdict names."""
    offset = None if math.isnan(offset_s) else offset_s
    planned = Setup(fps=30.0, readout_s=readout_s, offset_s=offset, seconds=10.0)
    setup = known_setup((steady(30.0), steady(30.0)), offset_s, None, readout_s)
    assert setup is not None
    ranges = reach(setup)
    for f_hz in frequencies(None):
        status = outlook(planned, f_hz).status
        holding = [s for s, spans in ranges.items() if any(a <= f_hz <= b for a, b in spans)]
        assert holding == [status], f_hz


def test_the_book_of_cameras_tells_the_verdict_the_row_times(tmp_path):
    (tmp_path / "trials/T1").mkdir(parents=True)
    mode = CameraMode("Webcam", (1280, 720), 30.0)
    facts = {
        side: CameraFacts(side, "Webcam", "", "v4l2", "mjpeg", "", (1280, 720), 30.0, "kernel")
        for side in ("left", "right")
    }
    results = [_result("left"), _result("right")]
    assert known_readout_s(tmp_path / "trials/T1", facts, results) is None
    remember(tmp_path, Entry(mode, -27.0, 0.1, "led"))
    assert known_readout_s(tmp_path / "trials/T1", facts, results) == pytest.approx(27e-6 * 720)
    facts["right"] = replace(facts["right"], title="Another")
    assert known_readout_s(tmp_path / "trials/T1", facts, results) is None


# --- all of it, live


def test_a_rehearsal_finds_the_markers_and_leads_through_the_trial(tmp_path, monkeypatch):
    monkeypatch.setattr(rehearsal, "REST_FRAMES", 3)
    monkeypatch.setattr(rehearsal, "SHAKEN_FRAMES", 1)
    states = []
    plan = CapturePlan(
        "simulated:sample", "simulated:sample", 3.5, Mode((640, 360)), markers="aruco:DICT_4X4_50"
    )
    captured = capture(tmp_path / "T", plan, states.append)
    assert "6 of 6 markers, 0 drops" in captured.verdict.words
    last = states[-1]
    assert last.cameras["left"].look.ids == (1, 2, 3, 4, 5, 6)
    assert last.cameras["right"].picture.shape == (360, 640)
    assert {s.prompt.phase for s in states if s.prompt} >= {"rest", "start"}
    line = status_line(last)
    assert line.startswith("00:03 | L 30")
    assert "6 markers" in line


def test_the_preview_is_bounded_and_stays_away_when_it_is_not_wanted(tmp_path):
    video = make_video(tmp_path / "old.nut", frames=20)
    states = []
    plan = CapturePlan(str(video), str(video), warm_up_s=0.1, preview=False)
    captured = capture(tmp_path / "T", plan, states.append)
    assert all(s.cameras["left"].look is None and s.prompt is None for s in states)
    assert captured.error is None
