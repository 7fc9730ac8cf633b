"""From frame to frame: every marker where it was, and the whole frame only now and then.

Source: paper, section 3.3 (location rectangles, re-initialisation).
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.detection import Detection, DetectionSettings, Detector, Wrapped
from olivevib.marker import MarkerLibrary
from olivevib.tracking.memory import as_bytes, hexed, pack_known, unhexed, unpack_known
from olivevib.tracking.rectangles import read_rectangles

SCAN_EVERY_S = 0.5  # a marker that appears for the first time is found after so long at most
PATIENCE_S = 0.25  # between whole scans while a marker stays away, at most; at first much less
FIRST_WAIT_S = 0.02


class Tracker:
    """Follows the markers of one camera from frame to frame; not to be shared between threads.

    A marker is fitted where it was; what is missing is searched in its location rectangle (the box
    of its last corners enlarged by Δscale), then in the whole frame: at once when it went, later
    ever more rarely, up to PATIENCE_S. Readers that cannot follow, such as the paper's, search
    every rectangle and scan whenever fewer than Δmarker are found. What it found depends on the
    frames alone and on ``memory()``, which ``recall`` restores.
    """

    def __init__(
        self,
        library: MarkerLibrary,
        settings: DetectionSettings | None = None,
        wrapped: Sequence[Wrapped] = (),
    ) -> None:
        self.settings = settings or DetectionSettings()
        self._detector = Detector(library, self.settings, wrapped)
        self._follower = self._detector.follower()
        self._ids = len(library.ids)
        self._last: dict[int, Floats] = {}
        self._expected = self.settings.marker
        self._scanned_s = -np.inf
        self._wait_s = FIRST_WAIT_S

    def update(self, grey: Grey, t_s: float) -> list[Detection]:
        """All markers of the next frame, sorted by id; t_s is its time, later than the last."""
        found = self._read_all(grey) if self._follower is None else self._follow(grey, t_s)
        self._last = {i: d.corners_px for i, d in found.items()}
        if not self.settings.marker:
            self._expected = max(self._expected, len(found))
        return [found[i] for i in sorted(found)]

    def memory(self) -> bytes:
        """What the tracker carries from frame to frame, to go on later as if never stopped."""
        stored = {
            "last": {str(i): hexed(c) for i, c in self._last.items()},
            "expected": self._expected,
            "scanned_s": float(self._scanned_s).hex(),
            "wait_s": self._wait_s.hex(),
        }
        if self._follower is not None:
            stored["known"] = pack_known(self._follower.known)
        return as_bytes(stored)

    def recall(self, memory: bytes) -> None:
        """Go on from a ``memory()``."""
        stored = json.loads(memory)
        self._expected = int(stored["expected"])
        self._scanned_s = float.fromhex(stored["scanned_s"])
        self._wait_s = float.fromhex(stored["wait_s"])
        self._last = {int(i): unhexed(c, (4, 2)) for i, c in stored["last"].items()}
        if self._follower is not None:
            self._follower.recall(unpack_known(stored["known"]))

    def _read_all(self, grey: Grey) -> dict[int, Detection]:
        """As the paper does it: rectangles, and the whole frame when too few are found."""
        last = self._last.values()
        found = read_rectangles(self._detector, grey, last, self.settings.scale) if last else {}
        if len(found) < max(1, self._expected):
            found |= {d.id: d for d in self._detector.detect(grey)}
        return found

    def _follow(self, grey: Grey, t_s: float) -> dict[int, Detection]:
        assert self._follower is not None
        found = self._follower.follow(grey)
        gone = [corners for i, corners in self._last.items() if i not in found]
        if gone:
            near = read_rectangles(self._detector, grey, gone, self.settings.scale)
            self._learn(found, near)
        if self._must_scan(len(found), bool(gone), t_s):
            self._scanned_s = t_s
            self._learn(found, {d.id: d for d in self._detector.detect(grey)})
            missing = len(found) < self._expected
            self._wait_s = min(2 * self._wait_s, PATIENCE_S) if missing else FIRST_WAIT_S
        return found

    def _must_scan(self, found: int, gone: bool, t_s: float) -> bool:
        if found >= self._ids:
            return False
        missing = found < max(1, self._expected)
        if missing and gone:
            return True
        return t_s - self._scanned_s >= (self._wait_s if missing else SCAN_EVERY_S)

    def _learn(self, found: dict[int, Detection], more: dict[int, Detection]) -> None:
        new = {i: d for i, d in more.items() if i not in found}
        assert self._follower is not None
        self._follower.learn(new.values())
        found |= new
