"""From decoded pictures to frames in the order shown, with damaged ones kept in their places.

A decoder hands out pictures late and in another order than it was fed; a damaged packet may give
no picture at all, and a picture that was predicted from a damaged one is damaged too. Here every
packet gets exactly one place, and whatever rests on damage says so.
"""

from __future__ import annotations

from collections import deque
from typing import Generic, NamedTuple, TypeVar

from olivevib.files.packets import Slip

HOLD = 32  # pictures; H.264 and HEVC reorder at most 16

Picture = TypeVar("Picture")


class Placed(NamedTuple, Generic[Picture]):
    """A packet's place among the frames, with its picture, or None where it is damaged."""

    slip: Slip
    picture: Picture | None


class FrameOrder(Generic[Picture]):
    """Sorts one stream's pictures; holds no more of them than the decoder reorders.

    Call ``sent`` for every packet, ``decoded`` for every picture, then ``ended``; the last two
    return the places that are settled by then. Damage spreads from a packet, in the order of
    decoding, to the next key picture; also to pictures shown before that key picture but decoded
    after it, because these may use both sides. known_order False (bare streams without stamps):
    pictures are taken as they come, and a missing one is only noticed at the end.
    """

    def __init__(self, *, known_order: bool) -> None:
        self._known_order = known_order
        self._pending: dict[int, Slip] = {}
        self._ready: deque[tuple[Slip, Picture | None]] = deque()
        self._group: dict[int, int] = {}  # packet -> count of key packets so far
        self._groups = 0
        self._key_order: dict[int, int] = {}  # group -> order of its key picture
        self._first_bad: dict[int, int] = {}  # group -> first damaged packet

    def sent(self, slip: Slip) -> None:
        """Note that a packet is about to be decoded."""
        if slip.key:
            self._groups += 1
            self._key_order[self._groups] = slip.order
            for old in [g for g in self._key_order if g < self._groups - HOLD]:
                self._key_order.pop(old)
                self._first_bad.pop(old, None)
        if slip.shown:
            self._group[slip.index] = self._groups
            self._pending[slip.index] = slip
        if slip.corrupt:
            self.damaged(slip)

    def damaged(self, slip: Slip) -> None:
        """Note that decoding this packet failed, or gave a picture with flaws."""
        group = self._group.get(slip.index, self._groups)
        self._first_bad[group] = min(slip.index, self._first_bad.get(group, slip.index))

    def decoded(self, index: int, picture: Picture, *, flawed: bool) -> list[Placed[Picture]]:
        """Take the picture of packet ``index``; one whose place was already given up is left."""
        slip = self._pending.pop(index, None)
        if slip is None:
            return []
        if flawed:
            self.damaged(slip)
        self._give_up_before(slip)
        self._ready.append((slip, picture))
        return self._settled()

    def ended(self) -> list[Placed[Picture]]:
        """The rest, after the last picture: packets that never gave one are damaged."""
        left = sorted(self._pending.values(), key=lambda s: (s.order, s.index))
        self._pending.clear()
        self._ready.extend((slip, None) for slip in left)
        return self._settled()

    def _give_up_before(self, slip: Slip) -> None:
        """Packets that should have been shown before this one will not come any more."""
        if not self._known_order:
            return
        late = [s for s in self._pending.values() if s.order < slip.order]
        for lost in sorted(late, key=lambda s: (s.order, s.index)):
            self._pending.pop(lost.index)
            self._ready.append((lost, None))

    def _settled(self) -> list[Placed[Picture]]:
        """Places whose damage is known: nothing that was decoded before them is still to come."""
        out: list[Placed[Picture]] = []
        oldest = min(self._pending, default=None)
        while self._ready and (
            oldest is None
            or self._ready[0][0].index < oldest
            or len(self._ready) > HOLD
            or not self._known_order
        ):
            slip, picture = self._ready.popleft()
            out.append(Placed(slip, None if self._is_tainted(slip) else picture))
            self._group.pop(slip.index, None)
        return out

    def _is_tainted(self, slip: Slip) -> bool:
        group = self._group.get(slip.index, self._groups)
        if self._first_bad.get(group, slip.index + 1) <= slip.index:
            return True
        leading = slip.order < self._key_order.get(group, slip.order)
        return leading and group - 1 in self._first_bad
