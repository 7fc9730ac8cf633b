"""The packets of a recording, one a picture: counting them, their time stamps, and where it ends.

Nothing is decoded here, so that a recording of an hour is gone through in seconds.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream

from olivevib.arrays import Floats, floats
from olivevib.errors import Caution
from olivevib.files.container import has_stamps, open_container, video_path
from olivevib.progress import Tick, silent

_NUT_INDEX = bytes.fromhex("4e58dd672f23e64e")  # start code of the index, NUT specification


@dataclass(frozen=True)
class Slip:
    """What is known of one packet before it is decoded.

    index: count in the order of the file; order: what sorts pictures as they are shown; stamp_s:
    container time, NaN if it has none; shown: False for packets that only help others (they are
    no frames); key: can be decoded alone; corrupt: the container says that bytes are missing.
    """

    index: int
    order: int
    stamp_s: float
    shown: bool
    key: bool
    corrupt: bool


class Packets:
    """Goes once through the packets of a video stream and then knows how much of it was there."""

    def __init__(self, path: Path, container: InputContainer, stream: VideoStream) -> None:
        self.path = path
        self.stamped = has_stamps(container)
        self.reorders = self.stamped and not stream.codec_context.codec.intra_only
        self.shown = 0
        self._container = container
        self._stream = stream
        self._count = 0
        self._first_s = np.inf
        self._last_s = self._end_s = -np.inf
        self._last_cut = False
        self._broke = ""

    def __iter__(self) -> Iterator[tuple[Any, Slip]]:
        """Packets with pictures in the order of the file, each with its Slip."""
        last = 0
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets, None)
            except (av.error.FFmpegError, OSError) as error:
                self._broke = str(error).split("] ")[-1]
                return
            if packet is None:
                return
            if not packet.size:  # the end, or an AVI's mark for "no new picture"
                continue
            slip = self._slip(packet, last)
            last = slip.order
            self._count += 1
            self.shown += slip.shown
            yield packet, slip

    def _slip(self, packet: Any, last: int) -> Slip:
        pts = packet.pts if self.stamped else None
        stamp = float("nan") if pts is None else _seconds(pts, packet.time_base)
        if pts is not None:
            lasts = _seconds(packet.duration or 0, packet.time_base)
            self._first_s = min(self._first_s, stamp)
            self._last_s = max(self._last_s, stamp)
            self._end_s = max(self._end_s, stamp + lasts)
        self._last_cut = packet.is_corrupt
        order = (last if pts is None else pts) if self.reorders else self._count
        return Slip(
            self._count, order, stamp, _is_shown(packet), packet.is_keyframe, self._last_cut
        )

    def shortfall(self) -> Caution | None:
        """After the walk: what is missing at the end of the recording, or None."""
        name = self._container.format.name
        exact = self._stream.frames if name != "avi" else 0  # an AVI counts its empty slots too
        expected = exact or self._expected_by_duration() or 0
        unclosed = name == "nut" and not _nut_is_closed(self.path)
        if not (self._count < expected or self._last_cut or self._broke or unclosed):
            return None
        about = "" if exact else "about "
        meant = f" of {about}{expected} expected" if self._count < expected else ""
        why = f" ({self._broke})" if self._broke else ""
        return Caution(
            "video-truncated",
            f"{self.path} ends early: {self.shown} frames{meant} are there{why}.",
            "The recording was interrupted or the copy is incomplete. Copy it again if the "
            "original is longer; otherwise the frames up to the cut are used.",
        )

    def _expected_by_duration(self) -> int | None:
        """Frames that the declared duration stands for, where it is this stream's own."""
        declared = _declared_s(self._container, self._stream)
        if declared is None or not np.isfinite(self._last_s) or self._count < 2:
            return None
        step = (self._last_s - self._first_s) / (self._count - 1)
        if not declared - self._end_s > 1.5 * step > 0:
            return None
        return max(self._count + 1, round((declared - self._first_s) / step))


def _declared_s(container: InputContainer, stream: VideoStream) -> float | None:
    """When this stream ends according to its header, s on the clock of its stamps."""
    if container.format.name == "avi" and stream.frames:
        return _seconds(stream.frames, stream.time_base or Fraction(1))
    if "matroska" not in container.format.name:
        return None
    tag = stream.metadata.get("DURATION", "")
    parts = tag.split(":")
    if len(parts) == 3 and all(part.replace(".", "", 1).isdigit() for part in parts):
        hours, minutes, seconds = (float(part) for part in parts)
        return 3600 * hours + 60 * minutes + seconds
    if len(container.streams) == 1 and container.duration:
        return container.duration / av.time_base
    return None


def _nut_is_closed(path: Path) -> bool:
    """True where a NUT file ends with its index, which is written when the recorder closes it."""
    with path.open("rb") as handle:
        size = handle.seek(0, 2)
        handle.seek(max(0, size - 12))
        back = int.from_bytes(handle.read(8), "big")
        if not 0 < back <= size:
            return False
        handle.seek(size - back)
        return handle.read(8) == _NUT_INDEX


def _seconds(count: int, base: Fraction) -> float:
    return float(Fraction(count) * base)


def _is_shown(packet: Any) -> bool:
    """False for packets outside the edit list, and for VP8's hidden reference pictures."""
    if packet.is_discard:
        return False
    if packet.stream.codec_context.codec.canonical_name == "vp8":
        return bool(memoryview(packet)[0] & 0x10)
    return True


@dataclass(frozen=True)
class VideoScan:
    """A recording gone through without decoding: stamps_s (N,) as shown, and a truncation."""

    stamps_s: Floats
    truncated: Caution | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamps_s", floats("stamps_s", self.stamps_s, (None,), nan=True))

    @property
    def frames(self) -> int:
        """How many frames there are, damaged ones included."""
        return self.stamps_s.size


def scan_video(path: str | Path, tick: Tick = silent) -> VideoScan:
    """Count the frames of a recording and read their time stamps, without decoding.

    Frame k of ``Video.frames`` has stamp k here. Raises InputError as ``Video.open`` does.
    """
    real = video_path(path)
    container, stream = open_container(real)
    with container:
        packets = Packets(real, container, stream)
        order, stamps = array("q"), array("d")
        for count, (_, slip) in enumerate(packets):
            if slip.shown:
                order.append(slip.order)
                stamps.append(slip.stamp_s)
            if count % 500 == 0:
                tick(count, stream.frames or None, f"reading the time stamps of {real.name}")
        as_shown = np.argsort(np.array(order, np.int64), kind="stable")
        return VideoScan(np.asarray(stamps, np.float64)[as_shown], packets.shortfall())


def frame_stamps(path: str | Path, tick: Tick = silent) -> Floats:
    """Container time stamps (N,) of all frames as they are shown, s; NaN where there are none."""
    return scan_video(path, tick).stamps_s
