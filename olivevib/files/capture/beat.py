"""Frame rate and dropped frames while a camera runs, at little cost."""

from __future__ import annotations

from collections import deque

import numpy as np

from olivevib.signals import fit_stamps

HEAD = 90  # stamps from which the clock is first taken
REFIT, REFIT_FROM = 600, 150  # so often, and from so many of the last stamps, it is taken anew
AHEAD = 4  # a stamp is late, not after a drop, if one of the next three makes up for it
WINDOW_S = 4.0
FOLLOW = 0.1  # share of the lateness by which the clock is corrected at each stamp


class Beat:
    """Counts what a camera dropped and how fast it runs, stamp by stamp.

    A running estimate for the screen; the verdict and the analysis fit all stamps at once
    (``signals.fit_stamps``). Not for the camera's own thread: now and then a stamp takes 0.1 s.
    """

    def __init__(self) -> None:
        self.frames = 0
        self.dropped = 0
        self.period_s = float("nan")
        self._recent: deque[float] = deque()
        self._last: deque[float] = deque(maxlen=REFIT_FROM)
        self._late: deque[float] = deque(maxlen=AHEAD)
        self._expected_s = float("nan")

    @property
    def fps(self) -> float:
        """Frames a second over the last seconds; NaN before there are two."""
        if len(self._recent) < 2 or self._recent[-1] <= self._recent[0]:
            return float("nan")
        return (len(self._recent) - 1) / (self._recent[-1] - self._recent[0])

    def add(self, stamp_s: float) -> None:
        """Take the stamp of the next frame, s, later than the last."""
        self.frames += 1
        self._last.append(stamp_s)
        self._recent.append(stamp_s)
        while self._recent[0] < stamp_s - WINDOW_S:
            self._recent.popleft()
        if self.frames == HEAD:
            self.dropped = self._fit()
        elif self.frames > HEAD:
            self._follow(stamp_s)
            if self.frames % REFIT == 0:
                self._fit()

    def _fit(self) -> int:
        """Take the clock from the last stamps; how many were dropped among them."""
        stamps = np.array(self._last, dtype=np.float64)
        fit = fit_stamps(stamps)
        self.period_s = 1.0 / fit.rate_hz
        phase = stamps - self.period_s * fit.sequence
        early = float(np.median(np.lib.stride_tricks.sliding_window_view(phase, AHEAD).min(axis=1)))
        self._expected_s = early + self.period_s * float(fit.sequence[-1] + 1)
        self._late.clear()
        return int(fit.dropped.size)

    def _follow(self, stamp_s: float) -> None:
        self._late.append((stamp_s - self._expected_s) / self.period_s)
        self._expected_s += self.period_s
        if len(self._late) < AHEAD:
            return
        least = min(self._late)
        lost = round(least)
        if lost > 0:
            self.dropped += lost
            self._late = deque((late - lost for late in self._late), maxlen=AHEAD)
        pull = min(0.5, max(-0.5, least - lost)) * FOLLOW
        self._expected_s += (max(0, lost) + pull) * self.period_s
