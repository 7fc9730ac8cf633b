"""Both cameras in threads or in turn: everything is collected, errors wait, cancelling closes."""

import threading

import cv2
import pytest

from olivevib.pipeline.two_cameras import both
from olivevib.progress import Cancelled, silent


@pytest.fixture(params=["threads", "turn"])
def way(request, monkeypatch) -> str:
    monkeypatch.setattr(cv2, "getNumThreads", lambda: 2 if request.param == "threads" else 1)
    return request.param


def test_every_item_is_collected_in_the_order_of_its_camera(way):
    got = {"left": [], "right": []}
    ticks = []
    makers = {"left": lambda: iter(range(40)), "right": lambda: iter(range(100, 150))}
    both(
        makers,
        lambda side, item: got[side].append(item),
        lambda done, total, note: ticks.append((done, total, note)),
        95,
        "reading",
        5,
    )
    assert got == {"left": list(range(40)), "right": list(range(100, 150))}
    assert list(dict.fromkeys(ticks)) == [(n, 95, "reading") for n in range(5, 96)]


def test_an_error_of_one_camera_waits_for_the_other(way):
    def broken():
        yield 1
        raise ValueError("the left one broke")

    got = []
    with pytest.raises(ValueError, match="the left one broke"):
        both(
            {"left": broken, "right": lambda: iter(range(30))},
            lambda side, item: got.append(side),
            silent,
            None,
            "",
        )
    assert got.count("left") == 1
    assert got.count("right") == 30


def test_a_tick_that_raises_closes_both_recordings(way):
    closed = []

    def recording(side):
        try:
            yield from range(1000)
        finally:
            closed.append(side)

    def impatient(done, total, note):
        if done == 7:
            raise Cancelled

    makers = {side: lambda side=side: recording(side) for side in ("left", "right")}
    with pytest.raises(Cancelled):
        both(makers, lambda side, item: None, impatient, None, "")
    assert sorted(closed) == ["left", "right"]


def test_a_wish_to_stop_is_heard_within_a_frame_and_no_other_is_begun(monkeypatch):
    monkeypatch.setattr(cv2, "getNumThreads", lambda: 2)
    begun, got = {"left": 0, "right": 0}, []
    end = threading.Event()

    def recording(side):
        while True:
            begun[side] += 1
            assert begun[side] == 1 or end.wait(20), "the tick was not called during a frame"
            yield side

    def impatient(done, total, note):
        if begun == {"left": 2, "right": 2} and done == 2:  # both are at their second frame
            threading.Timer(0.1, end.set).start()
            raise Cancelled

    makers = {side: lambda side=side: recording(side) for side in ("left", "right")}
    with pytest.raises(Cancelled):
        both(makers, lambda side, item: got.append(item), impatient, None, "")
    assert begun == {"left": 2, "right": 2}
    assert sorted(got) == ["left", "left", "right", "right"]  # what was finished is kept
