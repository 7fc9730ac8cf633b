"""What to do now: rest, start, steady, stop. Led by what the cameras see, not by a clock.

Order of a good trial (knowledge of the field): a rest in which nothing moves, spin-up, ten seconds
of steady shaking, and the free decay after it.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from olivevib.arrays import Floats
from olivevib.pipeline.capture.looks import Look

REST_S, STARTING_S, STEADY_S, DECAY_S = 2.0, 1.5, 10.0, 3.0
MOVED_PX = 1.5  # a marker that goes further within MEMORY_S moves
MEMORY_S = 1.0
LEAST_LOOKS = 3


@dataclass(frozen=True)
class Prompt:
    """phase: "rest", "start", "starting", "steady", "stop", "decay" or "done"; left_s: of it."""

    phase: str
    words: str
    left_s: float = math.nan


class MotionSense:
    """Whether the markers move, from where they were in the last looks of one camera."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, dict[int, Floats]]] = deque()

    def add(self, look: Look) -> None:
        """Take the next look."""
        places = dict(zip(look.ids, look.centres_px, strict=True))
        self._seen.append((look.t_s, places))
        while self._seen and self._seen[0][0] < look.t_s - MEMORY_S:
            self._seen.popleft()

    def moving(self) -> bool | None:
        """True or False; None where too few markers were seen to tell."""
        spans = []
        for marker in {i for _, places in self._seen for i in places}:
            at = np.array([places[marker] for _, places in self._seen if marker in places])
            if len(at) >= LEAST_LOOKS:
                spans.append(float(np.ptp(at, axis=0).max()))
        return bool(np.median(spans) > MOVED_PX) if spans else None


class Prompter:
    """Says what to do next from time and motion; call ``update`` at every state of a capture."""

    def __init__(self) -> None:
        self._phase = "rest"
        self._since_s = 0.0

    def update(self, t_s: float, moving: bool | None) -> Prompt:
        """The prompt at ``t_s``; moving None (no marker seen): phases go by time alone."""
        for _ in range(len(_NEXT)):
            following = self._following(t_s, moving)
            if following is None:
                break
            self._phase, self._since_s = following, t_s
        long = _NEXT[self._phase][1]
        left = math.nan if long is None else max(0.0, long - (t_s - self._since_s))
        return Prompt(self._phase, _WORDS[self._phase], left)

    def _following(self, t_s: float, moving: bool | None) -> str | None:
        """The next phase if this one is over."""
        following, long = _NEXT[self._phase]
        over = long is not None and t_s - self._since_s >= long
        if self._phase == "rest" and moving:
            self._since_s = t_s  # the rest counts from when nothing moves
            return None
        if self._phase == "start":
            return (
                following if moving or (moving is None and t_s - self._since_s >= REST_S) else None
            )
        if self._phase == "stop":
            still = moving is False or (moving is None and t_s - self._since_s >= REST_S)
            return following if still else None
        if self._phase == "steady" and moving is False:
            return "decay" if t_s - self._since_s > STARTING_S else None
        return following if over else None


_NEXT: dict[str, tuple[str, float | None]] = {
    "rest": ("start", REST_S),
    "start": ("starting", None),
    "starting": ("steady", STARTING_S),
    "steady": ("stop", STEADY_S),
    "stop": ("decay", None),
    "decay": ("done", DECAY_S),
    "done": ("done", None),
}
_WORDS = {
    "rest": "REST: nobody touches the tree",
    "start": "START the shaker",
    "starting": "the shaker runs up",
    "steady": "STEADY: keep shaking",
    "stop": "STOP the shaker",
    "decay": "wait while the tree comes to rest",
    "done": "enough: end the recording",
}
