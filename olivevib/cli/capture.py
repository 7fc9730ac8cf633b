"""Verb capture: both cameras into a new trial, with prompts, live quality and a verdict."""

from __future__ import annotations

import argparse
import contextlib
import math
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from olivevib import values
from olivevib.cli.console import Console
from olivevib.errors import OlivevibError, UsageError
from olivevib.progress import Cancelled

if TYPE_CHECKING:
    from olivevib.pipeline.capture import CameraState, CapturePlan, CaptureState, Hold


def capture(arguments: argparse.Namespace, console: Console) -> int:
    """Record a tree or the calibration board with both cameras, and make the trial."""
    from olivevib.pipeline.capture import at_once, place_of, trial_from
    from olivevib.pipeline.capture import capture as record

    plan = _plan(arguments)
    folder = folder_of(arguments.trial)
    place = place_of(folder, plan)
    how = f"for {plan.seconds:g} s" if plan.seconds else "until Ctrl-C"
    console.say(f"Recording {'the board' if plan.board else 'the tree'} into {place} {how}.")
    with stopping() as stop:
        watch = _Watcher(console, stop)
        hold = until_enter(console) if arguments.wait else at_once
        captured = record(place, plan, watch, console.tick, hold)
    cut_short = stop.asked and plan.seconds is not None
    print(captured.verdict.words)
    warned = console.cautions(captured.cautions)
    if captured.error is not None:
        with contextlib.suppress(OlivevibError):  # the disk may have no room for trial.toml
            trial_from(folder, plan, captured, arguments.marker_size, console.tick)
        raise captured.error
    trial = trial_from(folder, plan, captured, arguments.marker_size, console.tick)
    if len(captured.videos) < 2:
        console.error("the trial was not made: not both cameras delivered pictures.")
        return 1
    if trial is not None:
        console.say(f"made {trial.folder}; describe it in {trial.folder / 'trial.toml'}")
    _next(arguments.trial, plan, made=trial is not None, console=console)
    return 130 if cut_short else 3 if warned else 0


def _next(name: str, plan: CapturePlan, *, made: bool, console: Console) -> None:
    if made:
        console.say(f"Next: olivevib run {name}")
    elif plan.board:
        console.say(f"Next: the tree: olivevib capture {name} --left … --right …")


def folder_of(name: str) -> Path:
    """The trial's folder: one that is there, or the place for a new one."""
    from olivevib.trial.workspace import find_trial, place_for_new

    try:
        return find_trial(name, Path())
    except UsageError:
        return place_for_new(name, Path())


def _plan(arguments: argparse.Namespace) -> CapturePlan:
    from olivevib.files.capture import Mode
    from olivevib.pipeline.capture import CapturePlan

    size = values.picture_size(arguments.size)
    exposure_us = None if arguments.exposure is None else arguments.exposure * 1000
    return CapturePlan(
        left=arguments.left,
        right=arguments.right,
        seconds=arguments.seconds,
        mode=Mode(size, arguments.fps, exposure_us),
        board=arguments.board,
        markers=arguments.markers,
        ids=values.id_list(arguments.ids),
        band_hz=values.band(arguments.band),
        preview=not arguments.no_preview,
    )


def until_enter(console: Console) -> Hold:
    """Hold the recording back until somebody presses Enter (or the input ends)."""
    pressed = threading.Event()

    def read() -> None:
        sys.stdin.readline()
        pressed.set()

    console.say("Both cameras run; Enter starts the recording, Ctrl-C leaves.")
    threading.Thread(target=read, name="enter", daemon=True).start()
    return lambda: not pressed.is_set()


class Stop:
    """Whether somebody wants the recording to end."""

    def __init__(self) -> None:
        self.asked = False

    def ask(self, number: int, frame: FrameType | None) -> None:
        """The handler of Ctrl-C and of the system's request to end."""
        self.asked = True


@contextlib.contextmanager
def stopping() -> Iterator[Stop]:
    """While the body runs, Ctrl-C and SIGTERM ask for the end instead of forcing it."""
    stop = Stop()
    before = {s: signal.signal(s, stop.ask) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Watcher:
    """Shows the state of a capture: one line that is drawn anew, and what is new as sentences."""

    def __init__(self, console: Console, stop: Stop) -> None:
        self._console = console
        self._stop = stop
        self._told: dict[str, str] = {}

    def __call__(self, state: CaptureState) -> None:
        if self._stop.asked:
            raise Cancelled
        for side, camera in state.cameras.items():
            self._tell(f"{side} gone", f"the {side} camera: {camera.gone}" if camera.gone else "")
            self._tell(f"{side} advice", "; ".join(camera.advice), f"the {side} camera: ")
        if state.prompt is not None:
            self._tell("prompt", state.prompt.words)
        if state.coverage is not None:
            self._tell("coverage", state.coverage.advice)
        frames = sum(camera.frames for camera in state.cameras.values())
        self._console.tick(frames, None, status_line(state))

    def _tell(self, what: str, words: str, before: str = "") -> None:
        """Say something once, when it becomes true."""
        if words and self._told.get(what) != words:
            self._console.say(f"  {before}{words}")
        self._told[what] = words


def status_line(state: CaptureState) -> str:
    """The whole state in one line."""
    minutes, seconds = divmod(int(state.elapsed_s), 60)
    parts = [f"{minutes:02d}:{seconds:02d}" if state.recording else "not recording yet"]
    parts += [f"{side[0].upper()} {_camera_words(c)}" for side, c in state.cameras.items()]
    if math.isfinite(state.offset_s):
        parts.append(f"{abs(state.offset_s) * 1000:.1f} ms apart")
    if math.isfinite(state.minutes_left) and state.minutes_left < 60:
        parts.append(f"disk {state.minutes_left:.0f} min")
    if state.prompt is not None and math.isfinite(state.prompt.left_s):
        parts.append(f"{state.prompt.phase} {state.prompt.left_s:.0f} s")
    return " | ".join(parts)


def _camera_words(camera: CameraState) -> str:
    if camera.gone or camera.ended:
        return "GONE"
    rate = "--" if math.isnan(camera.fps) else f"{camera.fps:.1f}"
    words = f"{rate} fps {camera.dropped} lost"
    if camera.look is not None and camera.look.board is None:
        words += f" {len(camera.look.ids)} markers"
    return words
