"""Guidance over a board recording or running cameras: what is covered, what to show, enough now."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from olivevib.arrays import Bools
from olivevib.calibration.guidance import Guidance, Guide, covered
from olivevib.files.stills import open_source
from olivevib.pipeline.boards import board_finder, board_paths, trial_board
from olivevib.pipeline.capture import CaptureState
from olivevib.pipeline.recordings import SIDES
from olivevib.progress import Tick, silent
from olivevib.trial import Trial

Show = Callable[[Guidance, float], None]
EVERY_S = 0.25  # of a recording: as often as a running camera is looked at


def preview(trial: Trial, show: Show, tick: Tick = silent) -> Guidance:
    """Go through the trial's board recordings as a running camera would; returns the last word.

    ``show`` gets the guidance and the recording's time in seconds (stills: their count) whenever
    a view was taken.
    """
    board = trial_board(trial)
    paths = board_paths(trial)
    guide = Guide()
    finders = {side: board_finder(trial, board) for side in SIDES}
    with open_source(paths["left"], "left") as a, open_source(paths["right"], "right") as b:
        sources = {"left": a, "right": b}
        total = min((s.count_hint or 0) for s in sources.values())
        taken = -EVERY_S
        pairs = zip(a.frames(), b.frames(), strict=False)
        for number, frames in enumerate(pairs):
            tick(number, total or None, "looking at the board")
            video = a.kind == "video"
            now = float(frames[0].stamp_s) if video else float(number)
            if video and now - taken < EVERY_S:
                continue
            taken = now
            for side, frame in zip(SIDES, frames, strict=True):
                if frame.grey is None:
                    continue
                view = finders[side].find(frame.grey, number, now)
                if view is not None:
                    guide.add(side, view, sources[side].size_px)
            show(guide.state(), now)
    return guide.state()


def picture(told: Guidance, side: str, now: Bools | None = None) -> Iterator[str]:
    """The cells of one camera's picture as lines of text: a block where the board was seen.

    now (rows, columns): where the board is at this moment, if that is to be marked.
    """
    here = np.zeros_like(told.seen[side]) if now is None else now
    for row, at in zip(told.seen[side], here, strict=True):
        yield "".join(
            "▒▒" if a else "██" if cell else "··" for cell, a in zip(row, at, strict=True)
        )


def where_now(state: CaptureState | None, side: str) -> Bools | None:
    """The cells under the board in a camera's last picture; None where it is not in it."""
    camera = None if state is None else state.cameras.get(side)
    look = None if camera is None else camera.look
    if camera is None or look is None or look.board is None:
        return None
    return covered(look.board, camera.facts.size_px)
