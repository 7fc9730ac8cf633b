"""Guidance over a board recording or running cameras: what is covered, what to show, enough now."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from olivevib.calibration.guidance import Guidance, Guide
from olivevib.files.stills import open_source
from olivevib.pipeline.boards import board_finder, board_paths, trial_board
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


def picture(told: Guidance, side: str) -> Iterator[str]:
    """The cells of one camera's picture as lines of text: a block where the board was seen."""
    for row in told.seen[side]:
        yield "".join("██" if cell else "··" for cell in row)
