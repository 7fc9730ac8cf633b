"""Looks at running cameras now and then, in a thread of its own, with a bounded share of a core."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Grey
from olivevib.calibration.boards import Board
from olivevib.calibration.finding import BoardFinder
from olivevib.calibration.guidance import Guidance, Guide
from olivevib.detection import Detector
from olivevib.files.capture import CameraRunner, Shot
from olivevib.marker import MarkerLibrary
from olivevib.pipeline.capture.looks import Look, grey_of_shot, look_at
from olivevib.pipeline.capture.prompts import MotionSense

SHARE = 0.3  # of a core that looking may take
MOST_HZ = 4.0  # looks a second and camera
IDLE_S = 0.02


@dataclass(frozen=True)
class Seen:
    """What the looks at one camera found so far."""

    looks: int
    markers: Mapping[int, float]
    blur_px: float
    saturated: float


class Looker:
    """Decodes the latest pictures of both cameras, of one instant, and measures them.

    Looks before ``begin`` are shown but not counted.
    """

    def __init__(
        self, runners: Mapping[str, CameraRunner], library: MarkerLibrary, board: Board | None
    ) -> None:
        self.latest: dict[str, tuple[Look, Grey]] = {}
        self.failure: BaseException | None = None
        self._origin_ns: int | None = None
        self._runners = runners
        self._library = library
        self._detector = Detector(library)
        reader = self._detector if board is not None and board.kind == "coded" else None
        self._finder = None if board is None else BoardFinder(board, reader)
        self._coverage = None if board is None else Guide()
        self._senses = {side: MotionSense() for side in runners}
        self._counts: dict[str, Counter[int]] = {side: Counter() for side in runners}
        self._looks: dict[str, list[Look]] = {side: [] for side in runners}
        self._done: dict[str, int] = dict.fromkeys(runners, 0)  # time of the last shot looked at
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="looking", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def begin(self, origin_ns: int) -> None:
        """The recording begins: from now on looks count, and their times start at zero."""
        with self._lock:
            self._origin_ns = origin_ns
            self._senses = {side: MotionSense() for side in self._runners}

    def finish(self) -> None:
        """Stop looking."""
        self._stop.set()
        self._thread.join(2.0)

    def moving(self) -> bool | None:
        """Whether the markers move; None where none is seen."""
        with self._lock:
            said = [sense.moving() for sense in self._senses.values()]
        known = [m for m in said if m is not None]
        return any(known) if known else None

    def coverage(self) -> Guidance | None:
        """How well the board was shown; None where a tree is recorded."""
        with self._lock:
            return None if self._coverage is None else self._coverage.state()

    def seen(self, side: str) -> Seen:
        """The sum of all looks at one camera during the recording."""
        with self._lock:
            looks, counts = self._looks[side], self._counts[side]
            count = len(looks)
            return Seen(
                looks=count,
                markers={i: n / count for i, n in sorted(counts.items())},
                blur_px=_median([k.blur_px for k in looks]),
                saturated=_median([k.saturated for k in looks if k.ids]),
            )

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                began = time.monotonic()
                busy = time.thread_time()
                now = {side: runner.state().latest for side, runner in self._runners.items()}
                looked = [self._look(side, latest) for side, latest in now.items()]
                busy = time.thread_time() - busy
                rest = max(busy / SHARE, 1 / MOST_HZ) - (time.monotonic() - began)
                self._stop.wait(max(rest, IDLE_S) if any(looked) else IDLE_S)
        except BaseException as error:  # handed to the supervisor, which raises it
            self.failure = error

    def _look(self, side: str, latest: tuple[Shot, int] | None) -> bool:
        """Measure one picture; False where it is none, or was measured before."""
        if latest is None or latest[1] == self._done[side]:
            return False
        shot, placed_ns = latest
        self._done[side] = placed_ns
        grey = grey_of_shot(shot, self._runners[side].facts)
        if grey is None:
            return True
        origin = self._origin_ns
        look = self._measured(grey, (placed_ns - (origin or 0)) * 1e-9)
        with self._lock:
            self.latest[side] = (look, grey)
            if origin is not None and placed_ns >= origin:
                self._senses[side].add(look)
                self._count(side, look, (grey.shape[1], grey.shape[0]))
        return True

    def _measured(self, grey: Grey, t_s: float) -> Look:
        if self._finder is None:
            found = self._detector.detect(grey)
            return look_at(grey, t_s, found, self._library.layout)
        view = self._finder.find(grey, 0, t_s)
        return look_at(grey, t_s, [], self._library.layout, view)

    def _count(self, side: str, look: Look, size_px: tuple[int, int]) -> None:
        self._looks[side].append(look)
        self._counts[side].update(look.ids)
        if self._coverage is not None and look.board is not None:
            self._coverage.add(side, look.board, size_px)


def _median(values: list[float]) -> float:
    known = [v for v in values if math.isfinite(v)]
    return float(np.median(known)) if known else math.nan
