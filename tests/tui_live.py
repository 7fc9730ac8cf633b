"""Fixed states of a capture for the tests of the app."""

from __future__ import annotations

import numpy as np

from olivevib.calibration.guidance import Guide
from olivevib.calibration.views import BoardView
from olivevib.files.capture import CameraFacts, Controls
from olivevib.pipeline.capture import CameraState, CaptureState, Look, Prompt

SIZE = (640, 480)


def camera(side: str, look: Look) -> CameraState:
    """One camera that runs well but for its exposure."""
    facts = CameraFacts(side, f"[HD] {side}", "", "v4l2", "mjpeg", "", SIZE, 30.0, "kernel")
    grey = np.full((480, 640), 120, np.uint8)
    grey[100:300, 200:400] = 40
    advice = ("exposure 5 ms smears fast motion: set 2 ms or less, add light",)
    return CameraState(
        facts, 118, 1, 29.97, 9_000_000, "", "", 0, Controls(5000.0, 3.0), look, grey,
        advice if side == "left" else (),
    )  # fmt: skip


def state(elapsed_s: float, look: Look, **more: object) -> CaptureState:
    both = {side: camera(side, look) for side in ("left", "right")}
    values = {"offset_s": 0.0093, "free_bytes": 75_000_000_000, "minutes_left": 210.0}
    values |= {"prompt": None, "coverage": None} | more
    return CaptureState(elapsed_s > 0, elapsed_s, 20.0, both, **values)  # type: ignore[arg-type]


def live(elapsed_s: float) -> CaptureState:
    """A tree with one marker in view."""
    square = np.array([[200.0, 100], [400, 100], [400, 300], [200, 300]])
    look = Look(1.0, (7,), square.mean(axis=0)[None], 1.1, 180.0, 40.0, 0.01, None, square[None])
    prompt = Prompt("steady", "STEADY: keep shaking", 6.4) if elapsed_s else None
    return state(elapsed_s, look, prompt=prompt)


def board() -> CaptureState:
    """A board that both cameras have seen once."""
    u, v = np.meshgrid(np.arange(5.0), np.arange(5.0))
    mm = np.column_stack([u.ravel() * 60, v.ravel() * 60, np.zeros(25)])
    px = 100 + mm[:, :2] * 1.2
    view = BoardView(0, 1.0, np.arange(25), px, mm, np.full(25, 0.1))
    guide = Guide()
    for side in ("left", "right"):
        guide.add(side, view, SIZE)
    look = Look(1.0, (), np.empty((0, 2)), float("nan"), 180.0, 40.0, 0.01, view)
    return state(7.0, look, coverage=guide.state())
