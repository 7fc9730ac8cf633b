"""A recording as grey frames with their time stamps, streamed from the disk.

Grey is the luma plane as the camera coded it, never converted: on limited-range video a
conversion moves levels by up to 20.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal, NamedTuple, Self

import av
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from olivevib.arrays import Grey
from olivevib.errors import Caution, InputError
from olivevib.files.container import has_stamps, open_container, video_path
from olivevib.files.frame_order import FrameOrder, Placed
from olivevib.files.packets import Packets
from olivevib.values import counted

_PACKED_LUMA = {"yuyv422": 0, "yvyu422": 0, "uyvy422": 1}  # offset of the luma bytes, step 2


class Frame(NamedTuple):
    """One frame of a recording, in the order shown.

    index: count from 0, damaged frames included; stamp_s: container time stamp, NaN if there is
    none; grey: (H, W) uint8 in raw sensor rows, or None where the frame is damaged.
    """

    index: int  # type: ignore[assignment]  # hides tuple.index, which a frame has no use for
    stamp_s: float
    grey: Grey | None


@dataclass(frozen=True)
class VideoInfo:
    """What a recording says of itself.

    size_px (width, height) of the stored picture; frame_count_hint: what the header promises,
    None if it says nothing (``scan_video`` counts); stamps: "container", or "none" for bare
    streams; rotation_deg: how far a player would turn the picture counter-clockwise (0, 90, 180
    or 270) — it is never turned here, because rows are instants.
    """

    path: Path
    size_px: tuple[int, int]
    codec: str
    container: str
    frame_count_hint: int | None
    stamps: Literal["container", "none"]
    pixel_format: str
    rotation_deg: int


class Video:
    """One recording, opened for reading; use it as a context manager and walk ``frames()``.

    Memory does not grow with the length. One Video belongs to one thread at a time.
    """

    def __init__(self, info: VideoInfo) -> None:
        self.info = info
        self._cautions: tuple[Caution, ...] = ()
        self._playing: list[InputContainer] = []

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a recording and decode its first sound frame, to see that there is one.

        Raises UsageError for a name that is no file name; InputError, each with its remedy, for
        a missing or empty file, a folder, something that is no video, an MP4 cut before its
        index, and a video without one sound frame.
        """
        real = video_path(path)
        container, stream = open_container(real)
        with container:
            first = _first_picture(real, container, stream)
            return cls(_describe(real, container, stream, first))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release the file, also where a walk was left half way."""
        while self._playing:
            self._playing.pop().close()

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """What the last complete walk found: video-truncated, video-damaged."""
        return self._cautions

    @property
    def truncated(self) -> Caution | None:
        """The caution video-truncated of the last complete walk, or None."""
        return next((c for c in self._cautions if c.code == "video-truncated"), None)

    def frames(self, start: int = 0) -> Iterator[Frame]:
        """Frames in the order shown, from frame ``start``; earlier ones are decoded all the same.

        So the frames of a resumed walk are bit for bit those of an uninterrupted one. A damaged
        frame keeps its place with grey None; with predicting codecs (H.264, MPEG-4) also the
        frames that rest on it, up to the next key frame. Raises InputError where the picture
        size changes on the way.
        """
        container, stream = open_container(self.info.path)
        self._playing.append(container)
        try:
            packets = Packets(self.info.path, container, stream)
            damaged = 0
            for index, (slip, picture) in enumerate(_play(packets, stream)):
                damaged += picture is None
                if index >= start:
                    yield Frame(index, slip.stamp_s, self._grey(picture, index))
            self._cautions = tuple(
                c for c in (packets.shortfall(), _damage(self.info.path, damaged)) if c
            )
        finally:
            if container in self._playing:
                self._playing.remove(container)
                container.close()

    def _grey(self, picture: VideoFrame | None, index: int) -> Grey | None:
        if picture is None:
            return None
        if (picture.width, picture.height) != self.info.size_px:
            width, height = self.info.size_px
            raise InputError(
                f"{self.info.path} changes its picture size at frame {index}.",
                f"From {width} x {height} to {picture.width} x {picture.height} pixels.",
                "Record with one fixed size; cut the recording before this frame.",
            )
        return grey_of(picture)


def grey_of(picture: VideoFrame) -> Grey:
    """The luma plane (H, W) uint8 of a decoded picture, as coded; RGB is converted to grey.

    Planes deeper than 8 bits keep their upper 8.
    """
    name, luma = picture.format.name, picture.format.components[0]
    if name in _PACKED_LUMA:
        return _plane(picture, 2 * picture.width)[:, _PACKED_LUMA[name] :: 2].copy()
    alone = luma.is_luma and (picture.format.is_planar or len(picture.format.components) == 1)
    if alone and luma.bits == 8:
        return _plane(picture, picture.width).copy()
    if alone and name.endswith("le") and name.startswith(("yuv", "gray")):
        wide = np.ascontiguousarray(_plane(picture, 2 * picture.width)).view("<u2")
        return (wide >> (luma.bits - 8)).astype(np.uint8)
    return grey_of(picture.reformat(format="gray"))


def _plane(picture: VideoFrame, width: int) -> Grey:
    """The first ``width`` bytes of each row of plane 0, top row first; still the decoder's own."""
    plane = picture.planes[0]
    stride = abs(plane.line_size)
    data = np.frombuffer(memoryview(plane), np.uint8, stride * picture.height)
    rows: Grey = data.reshape(-1, stride)[:, :width]
    return rows[::-1] if plane.line_size < 0 else rows


def _play(packets: Packets, stream: VideoStream) -> Iterator[Placed[VideoFrame]]:
    """Every shown packet with its decoded picture, or None where it is damaged."""
    codec = stream.codec_context
    known = packets.stamped or codec.codec.intra_only
    order: FrameOrder[VideoFrame] = FrameOrder(known_order=known)
    for packet, slip in packets:
        packet.opaque = _Origin(slip.index)
        order.sent(slip)
        try:
            pictures = codec.decode(packet)
        except (av.error.FFmpegError, ValueError):
            order.damaged(slip)
            continue
        for picture in pictures:
            yield from order.decoded(_origin(picture), picture, flawed=picture.is_corrupt)
    try:
        pictures = codec.decode(None)
    except (av.error.FFmpegError, ValueError):
        pictures = []
    for picture in pictures:
        yield from order.decoded(_origin(picture), picture, flawed=picture.is_corrupt)
    yield from order.ended()


@dataclass(frozen=True)
class _Origin:
    """The count of a packet, as an object of its own.

    PyAV keeps what rides on a packet under its address, for the whole process: an int shared by
    two videos that are read at the same time would be taken from one when the other is done.
    """

    index: int


def _origin(picture: VideoFrame) -> int:
    """The count of the packet that a picture was decoded from; -1 where it does not say."""
    return picture.opaque.index if isinstance(picture.opaque, _Origin) else -1


def _first_picture(path: Path, container: InputContainer, stream: VideoStream) -> VideoFrame:
    packets = Packets(path, container, stream)
    for _, picture in _play(packets, stream):
        if picture is not None:
            return picture
    raise InputError(
        f"{path} holds no frame that can be decoded.",
        f"All {packets.shown} frames are damaged, or there are none.",
        "Copy it again from the camera, or record again.",
    )


def _describe(
    path: Path, container: InputContainer, stream: VideoStream, first: VideoFrame
) -> VideoInfo:
    return VideoInfo(
        path=path,
        size_px=(first.width, first.height),
        codec=stream.codec_context.codec.canonical_name,
        container=container.format.name,
        frame_count_hint=stream.frames or None,
        stamps="container" if has_stamps(container) else "none",
        pixel_format=first.format.name,
        rotation_deg=int(first.rotation) % 360,
    )


def _damage(path: Path, damaged: int) -> Caution | None:
    if not damaged:
        return None
    return Caution(
        "video-damaged",
        f"{path}: {counted(damaged, 'frame')} left out: damaged, or resting on damaged ones.",
        "Copy the recording again from the camera; check its memory card or cable.",
    )
