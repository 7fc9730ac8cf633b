"""One capture from the first picture to the closed files: both cameras, disk, prompts, verdict."""

from __future__ import annotations

import math
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from olivevib.errors import InputError, OlivevibError
from olivevib.files.capture import Beat, Camera, CameraRunner, DiskFull, RunnerState, join_parts
from olivevib.pipeline.capture.known import known_readout_s
from olivevib.pipeline.capture.looker import Looker
from olivevib.pipeline.capture.looks import advise
from olivevib.pipeline.capture.plan import (
    CameraState,
    CapturePlan,
    CaptureState,
    Hold,
    Watch,
    at_once,
)
from olivevib.pipeline.capture.prompts import Prompter
from olivevib.pipeline.capture.verdict import CameraResult, Verdict, judge, judge_board
from olivevib.progress import Cancelled, Tick, silent

SIDES = ("left", "right")
POLL_S = 0.1
SYNC_S = 1.0
CONTROLS_S = 0.5
SILENT_S = 0.7  # without a picture: the camera is gone, its file is closed
PUNCTUAL_S = 0.15  # of a longer pause of our own no more than this counts as the camera's silence
GONE_S = 5.0  # no camera delivers for so long: the capture ends
FIRST_S = 5.0
SWITCH_S = 0.0005  # so that stamps of arrival do not wait for other threads


class Session:
    """Two running cameras. ``start``, ``record``, ``watch_until_done``, ``finish``; then ``judge``.

    Everything here runs in the calling thread; each camera and the looking have threads of their
    own. ``finish`` must be called whatever happens; it closes every file.
    """

    def __init__(
        self,
        plan: CapturePlan,
        cameras: Mapping[str, Camera],
        looker: Callable[[Mapping[str, CameraRunner]], Looker] | None,
        reopen: Mapping[str, Callable[[], Camera]],
    ) -> None:
        self.plan = plan
        self.runners = {s: CameraRunner(s, cameras[s], reopen.get(s)) for s in SIDES}
        self.looker = looker(self.runners) if looker else None
        self.error: OlivevibError | None = None
        self._folder: Path | None = None
        self._origin_ns = 0
        self._beats = {side: Beat() for side in SIDES}
        self._prompter = Prompter()
        self._quiet_s = dict.fromkeys(SIDES, 0.0)
        self._heard: dict[str, object] = dict.fromkeys(SIDES)
        self._polled_s = time.monotonic()
        self._asked_s = 0.0
        self._switch_s = sys.getswitchinterval()
        self._stop = threading.Event()
        self._disk = threading.Thread(target=self._sync, name="disk", daemon=True)

    def start(self, watch: Watch, hold: Hold = at_once) -> None:
        """Take pictures without recording until both cameras deliver steadily and ``hold`` ends.

        What a camera had in store is let go by then. InputError where one delivers none.
        """
        sys.setswitchinterval(SWITCH_S)
        for runner in self.runners.values():
            runner.start()
        if self.looker is not None:
            self.looker.start()
        began = time.monotonic()
        while True:
            states = {side: runner.state() for side, runner in self.runners.items()}
            self._raise_failures()
            waited = time.monotonic() - began
            warm = all(s.latest for s in states.values()) and waited >= self.plan.warm_up_s
            if warm and not hold():
                return
            late = [s for s in SIDES if states[s].latest is None]
            ended = [s for s in late if states[s].ended]
            if ended or (late and waited > FIRST_S):
                side = (ended or late)[0]
                raise InputError(
                    f"the {side} camera delivers no picture.",
                    states[side].ended or states[side].gone or f"None came for {FIRST_S:g} s.",
                    "Unplug it, plug it in again, and close other programs that use it.",
                )
            watch(self.state())
            time.sleep(min(POLL_S, max(0.0, self.plan.warm_up_s - waited)) or POLL_S)

    def record(self, folder: Path) -> dict[str, Path]:
        """Begin both recordings at once, in ``folder``; returns where they go."""
        self._folder = folder
        videos = {side: folder / f"{side}.nut" for side in SIDES}
        self._origin_ns = time.monotonic_ns()
        for side in SIDES:
            self.runners[side].record(videos[side], self._origin_ns)
        if self.looker is not None:
            self.looker.begin(self._origin_ns)
        self._disk.start()
        return videos

    def watch_until_done(self, watch: Watch) -> None:
        """Until the time is over, both cameras have ended, the disk is nearly full, or ``watch``
        raises Cancelled (somebody stops it: that is how an open recording ends).
        """
        with suppress(Cancelled):
            while not self._done():
                watch(self.state())
                time.sleep(POLL_S)

    def state(self) -> CaptureState:
        """How it goes now."""
        cameras = {side: self._camera(side) for side in SIDES}
        elapsed = self._elapsed_s()
        free, minutes = self._space(cameras, elapsed)
        prompt = coverage = None
        if self.looker is not None and self._origin_ns:
            coverage = self.looker.coverage()
            if coverage is None:
                prompt = self._prompter.update(elapsed, self.looker.moving())
        return CaptureState(
            recording=bool(self._origin_ns),
            elapsed_s=elapsed,
            seconds=self.plan.seconds,
            cameras=cameras,
            offset_s=self._offset_s(),
            free_bytes=free,
            minutes_left=minutes,
            prompt=prompt,
            coverage=coverage,
        )

    def finish(self) -> None:
        """Close every file and stop every thread."""
        self._stop.set()
        for runner in self.runners.values():
            runner.finish()
        if self.looker is not None:
            self.looker.finish()
        sys.setswitchinterval(self._switch_s)
        self.error = self.error or next((r.error for r in self.runners.values() if r.error), None)

    def join(self, tick: Tick = silent) -> None:
        """Make one file of the parts of a camera that came back; parts stay where space lacks."""
        for runner in self.runners.values():
            if len(runner.parts) > 1:
                with suppress(DiskFull):
                    join_parts(runner.parts, runner.facts, tick)

    def judge(self) -> Verdict:
        """What was recorded, and what it is good for."""
        results = [self._result(side) for side in SIDES]
        if self.plan.board is not None:
            return judge_board(results, self.looker.coverage() if self.looker else None)
        facts = {side: runner.facts for side, runner in self.runners.items()}
        readout = known_readout_s(self._folder, facts, results)
        return judge(results, self.plan.band_hz, self.plan.ids, readout)

    def _result(self, side: str) -> CameraResult:
        runner = self.runners[side]
        state = runner.state()
        seen = self.looker.seen(side) if self.looker is not None else None
        return CameraResult(
            side=side,
            stamps_s=np.array(runner.stamps_s, dtype=np.float64),
            promised_fps=self.plan.mode.fps or runner.facts.fps,
            seen={} if seen is None else seen.markers,
            looks=0 if seen is None else seen.looks,
            losses=state.losses,
            ended=state.gone or state.ended,
            blur_px=math.nan if seen is None else seen.blur_px,
            saturated=math.nan if seen is None else seen.saturated,
        )

    def _done(self) -> bool:
        """Look after everything once; True where the capture is over."""
        self._raise_failures()
        states = {side: runner.state() for side, runner in self.runners.items()}
        self._follow_stamps()
        self._listen(states)
        self._ask_controls()
        self.error = self.error or self._fault()
        if self.error is not None:
            return True
        over = [s.ended or (s.gone and self._quiet_s[side] > GONE_S) for side, s in states.items()]
        seconds = self.plan.seconds
        return all(over) or (seconds is not None and self._elapsed_s() >= seconds)

    def _fault(self) -> OlivevibError | None:
        """Why it cannot go on: the disk took no more, or has nearly no room."""
        for runner in self.runners.values():
            if runner.error is not None:
                return runner.error
        assert self._folder is not None
        if _free_bytes(self._folder) < self.plan.reserve_bytes:
            return nearly_full(self._folder, self.plan.reserve_bytes)
        return None

    def _listen(self, states: Mapping[str, RunnerState]) -> None:
        """Close the file of a camera that has fallen silent; a pause of our own is none of its."""
        now = time.monotonic()
        since = min(now - self._polled_s, PUNCTUAL_S)
        self._polled_s = now
        for side, state in states.items():
            news = state.latest is not self._heard[side]
            self._heard[side] = state.latest
            self._quiet_s[side] = 0.0 if news else self._quiet_s[side] + since
            patience = max(SILENT_S, 4 * (self._beats[side].period_s or 0.0))
            if self._quiet_s[side] > patience and not state.gone and not state.ended:
                self.runners[side].silent(f"no picture for {patience:.1f} s")

    def _follow_stamps(self) -> None:
        for side in SIDES:
            beat, stamps = self._beats[side], self.runners[side].stamps_s
            for stamp in stamps[beat.frames :]:
                beat.add(stamp)

    def _ask_controls(self) -> None:
        if time.monotonic() - self._asked_s > CONTROLS_S:
            self._asked_s = time.monotonic()
            for runner in self.runners.values():
                runner.ask_controls()

    def _camera(self, side: str) -> CameraState:
        runner, beat = self.runners[side], self._beats[side]
        state = runner.state()
        look, picture = (None, None)
        if self.looker is not None and side in self.looker.latest:
            look, picture = self.looker.latest[side]
        return CameraState(
            facts=runner.facts,
            frames=state.frames,
            dropped=beat.dropped,
            fps=beat.fps if self._origin_ns else 1 / _period_s(runner.recent_ns),
            size_bytes=state.size_bytes,
            gone=state.gone,
            ended=state.ended,
            losses=state.losses,
            controls=runner.controls,
            look=look,
            picture=picture,
            advice=() if look is None else advise(look, runner.controls),
        )

    def _elapsed_s(self) -> float:
        return (time.monotonic_ns() - self._origin_ns) * 1e-9 if self._origin_ns else 0.0

    def _space(self, cameras: Mapping[str, CameraState], elapsed: float) -> tuple[int, float]:
        free = _free_bytes(self._folder or Path())
        rate = sum(c.size_bytes for c in cameras.values()) / elapsed if elapsed > 1 else 0.0
        room = max(0, free - self.plan.reserve_bytes)
        return free, room / rate / 60 if rate > 0 else math.nan

    def _offset_s(self) -> float:
        """Right minus left of the last pictures, modulo a frame."""
        left, right = (np.array(tuple(self.runners[s].recent_ns), dtype=np.int64) for s in SIDES)
        period = _period_s(left)
        if min(left.size, right.size) < 5 or not math.isfinite(period):
            return math.nan
        turns = (right - left[-1]) * 1e-9 / period
        middle = np.angle(np.mean(np.exp(2j * np.pi * turns)))
        return float(middle / (2 * np.pi) * period)

    def _raise_failures(self) -> None:
        failures = [runner.failure for runner in self.runners.values()]
        failures += [self.looker.failure] if self.looker is not None else []
        for failure in failures:
            if failure is not None:
                raise failure

    def _sync(self) -> None:
        while not self._stop.wait(SYNC_S):
            for runner in self.runners.values():
                runner.sync()


def _period_s(stamps_ns: Iterable[int]) -> float:
    """The middle time between pictures, s; NaN for too few."""
    stamps = np.array(tuple(stamps_ns), dtype=np.int64)
    return float(np.median(np.diff(stamps))) * 1e-9 if stamps.size > 4 else math.nan


def _free_bytes(folder: Path) -> int:
    return shutil.disk_usage(folder).free


def nearly_full(folder: Path, reserve: int) -> InputError:
    """The error for a disk without room."""
    return InputError(
        f"the disk is nearly full: less than {reserve / 1e6:.0f} MB are free for {folder}.",
        "Recording stopped before it was full; everything recorded is safe and can be used.",
        "Free some space, or record on another disk.",
    )
