"""Camera stamps on the computer's monotonic clock, so that both cameras share one."""

from __future__ import annotations

from olivevib.files.capture.camera import Shot

SAME_CLOCK_NS = 1_000_000_000  # a stamp that is older by less than this may be the computer's own
JUMP_NS = 5_000_000_000  # a camera whose clock leaves ours by more was set anew


class StampClock:
    """Places the shots of one camera on the computer's clock, in whole nanoseconds.

    A camera whose first stamp is a little before the computer's time keeps the computer's own
    clock (Linux drivers do): its stamps are taken as they are. Any other clock is shifted, once, so
    that the first stamp falls on the first arrival; its intervals stay exact. Shots without a stamp
    get their time of arrival. Times always increase, by a microsecond at least.
    """

    def __init__(self) -> None:
        self._shift_ns: int | None = None
        self._last_ns: int | None = None
        self.restarts = 0  # how often the camera's clock was set anew

    @property
    def shared(self) -> bool:
        """True where the camera stamps by the computer's own clock."""
        return self._shift_ns == 0

    def place(self, shot: Shot) -> int:
        """When the shot was taken, ns on the computer's monotonic clock."""
        placed = self._placed(shot)
        if self._last_ns is not None and placed < self._last_ns + 1000:
            placed = self._last_ns + 1000
        self._last_ns = placed
        return placed

    def _placed(self, shot: Shot) -> int:
        if shot.device_ns is None:
            return shot.host_ns
        if self._shift_ns is None:
            late = shot.host_ns - shot.device_ns
            self._shift_ns = 0 if 0 <= late < SAME_CLOCK_NS else late
        placed = shot.device_ns + self._shift_ns
        backward = self._last_ns is not None and placed <= self._last_ns
        if backward or abs(placed - shot.host_ns) > JUMP_NS:
            self.restarts += 1
            self._shift_ns = shot.host_ns - shot.device_ns
            placed = shot.host_ns
        return placed
