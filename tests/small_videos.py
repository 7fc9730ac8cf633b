"""Small videos made on the spot, whose every frame says in its pixels which one it is."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

SIZE = (128, 96)  # width, height
MICRO = Fraction(1, 1_000_000)


def picture(index: int, size: tuple[int, int] = SIZE) -> NDArray[np.uint8]:
    """A smooth pattern that moves, with the index written as eight black or white blocks."""
    width, height = size
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    grey = 128 + 60 * np.sin((x + 3 * index) / 9) * np.cos(y / 7)
    for bit in range(8):
        grey[8:24, 4 + 14 * bit : 16 + 14 * bit] = 220 if index >> bit & 1 else 30
    return grey.astype(np.uint8)


def index_of(grey: NDArray[np.uint8]) -> int:
    """Which frame a decoded picture is."""
    bits = [grey[12:20, 8 + 14 * b : 12 + 14 * b].mean() > 125 for b in range(8)]
    return sum(1 << b for b, bit in enumerate(bits) if bit)


def make_video(  # noqa: PLR0917
    path: Path,
    codec: str = "mjpeg",
    stamps_s: list[float] | None = None,
    frames: int = 30,
    pixels: str = "",
    size: tuple[int, int] = SIZE,
    options: dict[str, str] | None = None,
    rotation: int = 0,
    container: str | None = None,
) -> Path:
    """Write a video with PyAV; stamps default to 30 per second."""
    stamps = stamps_s if stamps_s is not None else [k / 30 for k in range(frames)]
    pixels = pixels or ("yuvj420p" if codec == "mjpeg" else "yuv420p")
    coding = {"g": "12"} if codec in ("libx264", "mpeg4") else {}
    with av.open(str(path), "w", format=container, options=options or {}) as out:
        stream = out.add_stream(codec, rate=30, options=coding)
        stream.width, stream.height, stream.pix_fmt = *size, pixels
        base = Fraction(1, 30) if path.suffix == ".avi" or codec == "mpeg4" else MICRO
        if codec != "mpeg4":
            stream.codec_context.time_base = stream.time_base = base
        if rotation:
            stream.set_display_rotation(rotation)
        for index, stamp in enumerate(stamps):
            grey = av.VideoFrame.from_ndarray(picture(index, size), format="gray")
            frame = grey.reformat(format=pixels)
            frame.pts, frame.time_base = round(Fraction(stamp) / base), base
            for packet in stream.encode(frame):
                out.mux(packet)
        for packet in stream.encode(None):
            out.mux(packet)
    return path


def cut(path: Path, share: float) -> Path:
    """The first ``share`` of a file, under another name."""
    data = path.read_bytes()
    short = path.with_name("cut_" + path.name)
    short.write_bytes(data[: int(len(data) * share)])
    return short


def packet_places(path: Path) -> list[tuple[int, int]]:
    """Position and size in the file of every video packet, in the order of the file."""
    with av.open(str(path)) as container:
        return [(p.pos, p.size) for p in container.demux(video=0) if p.size]


def damage(path: Path, packet: int, share: float = 0.5, count: int = 12) -> Path:
    """A copy with ``count`` bytes in the middle of one packet turned over."""
    data = bytearray(path.read_bytes())
    at, size = packet_places(path)[packet]
    begin = at + int(size * share)
    for k in range(begin, min(begin + count, at + size)):
        data[k] ^= 0xFF
    broken = path.with_name(f"broken{packet}_" + path.name)
    broken.write_bytes(data)
    return broken


def recordings(folder: Path) -> Path:
    """A workspace with two short recordings, left.avi and right.avi, and no trial yet."""
    for side in ("left", "right"):
        make_video(folder / f"{side}.avi", frames=4)
    (folder / "trials").mkdir()
    return folder
