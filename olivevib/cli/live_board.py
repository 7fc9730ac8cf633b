"""``calibrate --preview`` on running cameras: wave the board, end when it is enough."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from olivevib import values
from olivevib.cli.capture import Stop, folder_of, status_line, stopping, until_enter
from olivevib.cli.console import Console
from olivevib.errors import OlivevibError, UsageError
from olivevib.progress import Cancelled

if TYPE_CHECKING:
    from olivevib.calibration.guidance import Guidance
    from olivevib.pipeline.capture import CapturePlan, CaptureState

AFTER_S = 3.0  # the recording goes on for so long once it is enough: the last view is whole
BELL = "\a"


def live_preview(arguments: argparse.Namespace, console: Console) -> int:
    """Record the board with both cameras and guide whoever waves it.

    Everything is recorded by the recorder of ``olivevib capture`` into TRIAL/calibration, so that
    ``olivevib calibrate TRIAL`` can run on it. Ends by itself once it is enough, after --seconds,
    or with Ctrl-C; 3 where it was not enough.
    """
    from olivevib.pipeline.capture import at_once, board_trial, capture, place_of

    folder = folder_of(arguments.trials[0])
    plan = _plan(arguments, folder)
    place = place_of(folder, plan)
    how = f"for {plan.seconds:g} s" if plan.seconds else "until it is enough (or Ctrl-C)"
    console.say(f"Wave the board before both cameras: tilted, near and far. Into {place}, {how}.")
    with stopping() as stop:
        watch = BoardWatch(console, stop, ends=plan.seconds is None)
        hold = until_enter(console) if arguments.wait else at_once
        captured = capture(place, plan, watch, console.tick, hold)
    console.paint([])
    if watch.last is not None:
        print("\n".join(board_lines(watch.last)))
    print(captured.verdict.words)
    warned = console.cautions(captured.cautions)
    trial = None
    with _kept(captured.error):
        trial = board_trial(folder, plan, captured)
    if captured.error is not None:
        raise captured.error
    if trial is None:
        console.error("the board was not recorded: not both cameras delivered pictures.")
        return 1
    console.say(f"Next: olivevib calibrate {arguments.trials[0]}")
    enough = watch.last is not None and watch.last.enough
    return 3 if warned or not enough else 0


@contextlib.contextmanager
def _kept(error: OlivevibError | None) -> Iterator[None]:
    """Where the capture failed already, what fails after it (a full disk) is not told as well."""
    with contextlib.suppress(OlivevibError) if error is not None else contextlib.nullcontext():
        yield


def _plan(arguments: argparse.Namespace, folder: Path) -> CapturePlan:
    from olivevib.files.capture import Mode
    from olivevib.pipeline.capture import CapturePlan

    for side in ("left", "right"):
        if getattr(arguments, side) is None:
            raise UsageError(
                f"the {side} camera is not named.",
                "With --left or --right the preview runs on cameras, and needs both.",
                "Name both, as olivevib doctor lists them; name none to go through the recordings.",
            )
    exposure_us = None if arguments.exposure is None else arguments.exposure * 1000
    return CapturePlan(
        left=arguments.left,
        right=arguments.right,
        seconds=arguments.seconds,
        mode=Mode(values.picture_size(arguments.size), arguments.fps, exposure_us),
        board=arguments.board or _known_board(folder),
        markers=arguments.markers,
    )


def _known_board(folder: Path) -> str:
    """The board that the trial names already."""
    from olivevib.files.trial_folders import FILE
    from olivevib.trial import Trial

    spec = Trial.open(folder).settings.calibration.board if (folder / FILE).is_file() else None
    if spec is None:
        raise UsageError(
            "the calibration board is not known.",
            "",
            "Name it with --board SPEC; olivevib new --help lists them.",
        )
    return spec


class BoardWatch:
    """Draws coverage, tilts, distances and the next pose; ends the recording when it is enough.

    On a terminal the picture is drawn over itself and rings once; elsewhere new advice is a line.
    """

    def __init__(self, console: Console, stop: Stop, *, ends: bool) -> None:
        self.last: Guidance | None = None
        self._console, self._stop, self._ends = console, stop, ends
        self._told = ""
        self._enough_s: float | None = None

    def __call__(self, state: CaptureState) -> None:
        """Take a state of the capture; Cancelled ends it, everything recorded is kept."""
        if self._stop.asked:
            raise Cancelled
        told = self.last = state.coverage or self.last
        if told is None:
            self._console.tick(0, None, status_line(state))
            return
        if not self._console.paint([status_line(state), *board_lines(told, state)]):
            self._say(told)
        if told.enough and self._enough_s is None:
            self._enough_s = state.elapsed_s
            self._console.ring(BELL)
        waited = 0.0 if self._enough_s is None else state.elapsed_s - self._enough_s
        if self._ends and waited >= AFTER_S:
            raise Cancelled

    def _say(self, told: Guidance) -> None:
        said = told.words.split(" (")[0]  # a count alone is nothing new
        if said != self._told:
            self._told = said
            self._console.say(f"  {told.pairs} common views; {told.advice}")


def board_lines(told: Guidance, state: CaptureState | None = None) -> list[str]:
    """The guidance as lines of text: both pictures side by side, tilts, distances, what is next."""
    from olivevib.pipeline.preview import picture, where_now

    now = {side: where_now(state, side) for side in told.seen}
    maps = [list(picture(told, side, now[side])) for side in told.seen]
    width = len(maps[0][0])
    lines = ["  " + "  ".join(f"{side + ' camera':<{width}}" for side in told.seen)]
    lines += ["  " + "  ".join(row) for row in zip(*maps, strict=True)]
    shares = "  ".join(f"{f'{share:.0%} covered':<{width}}" for share in told.cells.values())
    lines.append(f"  {shares}")
    lines += [f"  {part}" for part in told.measures.split(" · ")]
    lines.append(f"  {told.words.upper() if told.enough else 'NEXT: ' + told.words}")
    if told.forecast is not None:
        lines += [f"  {part}" for part in told.forecast.words.split("; ")]
    return lines
