"""Whether a recording still is what the camera delivered: every frame against its side-car."""

from __future__ import annotations

import zlib
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from olivevib.files.capture.sidecar import Line, SideCar, read_sidecar, sidecar_of
from olivevib.files.container import open_container, video_path
from olivevib.files.packets import Packets
from olivevib.progress import Tick, silent

_MICRO = 1_000_000


@dataclass(frozen=True)
class Verified:
    """What the checksums say of a recording.

    frames: how many the side-car lists; altered: sequence numbers whose bytes changed;
    restamped: bytes whole, time stamp changed; missing: not to be found in the file any more;
    in_flight: the one that was being written when the recorder was stopped by force (it is not
    among the missing); unlisted: frames in the file that no line describes; damaged_lines of the
    side-car itself.
    """

    frames: int
    altered: tuple[int, ...] = ()
    restamped: tuple[int, ...] = ()
    missing: tuple[int, ...] = ()
    in_flight: int | None = None
    unlisted: int = 0
    damaged_lines: tuple[int, ...] = ()

    @property
    def whole(self) -> bool:
        """True where every listed frame is there, bit for bit, at its time."""
        lost = self.altered or self.restamped or self.missing or self.damaged_lines
        return not lost and self.unlisted == 0

    @property
    def suspects(self) -> tuple[int, ...]:
        """Every frame that is not as it was recorded, in order."""
        return tuple(sorted({*self.altered, *self.restamped, *self.missing}))

    @property
    def words(self) -> str:
        """For a person."""
        parts = [
            f"{name}: {frame_list(found)}"
            for name, found in (
                ("frames altered since they were recorded", self.altered),
                ("frames with another time stamp than recorded", self.restamped),
                ("frames that can no longer be found", self.missing),
            )
            if found
        ]
        if self.unlisted:
            parts.append(f"{self.unlisted} frames that the side-car does not list")
        if self.damaged_lines:
            parts.append(f"damaged lines of the side-car: {frame_list(self.damaged_lines)}")
        if not parts:
            parts = [f"{self.frames} frames, every checksum right"]
        if self.in_flight is not None:
            parts.append(f"frame {self.in_flight} was being written when the recorder was stopped")
        return "; ".join(parts)


def verify(video: Path, tick: Tick = silent) -> Verified | None:
    """Compare a recording with its side-car; None where it has none.

    Frames are found by stamp, checksum and size together, so that damage between the frames does
    not shift the blame to others. Raises InputError where either file cannot be read at all.
    """
    path = sidecar_of(video)
    sidecar = read_sidecar(path) if path.is_file() else None
    if sidecar is None:
        return None
    found, closed = _packets(video, tick)
    return compare(sidecar, found, closed=closed)


Packet = tuple[int, int, int]  # stamp µs, size, checksum


def _packets(video: Path, tick: Tick) -> tuple[list[Packet], bool]:
    """Every packet of the file, and whether the recorder closed it properly."""
    real = video_path(video)
    container, stream = open_container(real)
    out: list[Packet] = []
    with container:
        packets = Packets(real, container, stream)
        for packet, _ in packets:
            stamp = -1 if packet.pts is None else round(packet.pts * packet.time_base * _MICRO)
            out.append((stamp, packet.size, zlib.crc32(packet)))
            if len(out) % 500 == 0:
                tick(len(out), None, f"checksums of {real.name}")
        return out, packets.shortfall() is None


def compare(sidecar: SideCar, found: list[Packet], *, closed: bool) -> Verified:
    """Match lines with packets: first in everything, then by stamp alone, then by content alone."""
    lines = list(sidecar.lines)
    _, lines, left = _match(lines, found, (0, 1, 2))
    altered, lines, left = _match(lines, left, (0,))
    restamped, lines, left = _match(lines, left, (1, 2))
    missing = [line.sequence for line in lines]
    last = sidecar.lines[-1] if sidecar.lines else None
    in_flight = None
    if last is not None and not closed:
        torn = [line.sequence for line, packet in altered if packet[1] < line.size]
        if last.sequence in (*missing, *torn):
            in_flight = last.sequence
    return Verified(
        frames=len(sidecar.lines),
        altered=tuple(line.sequence for line, _ in altered if line.sequence != in_flight),
        restamped=tuple(line.sequence for line, _ in restamped),
        missing=tuple(n for n in missing if n != in_flight),
        in_flight=in_flight,
        unlisted=len(left),
        damaged_lines=sidecar.damaged,
    )


def _match(
    lines: list[Line], packets: list[Packet], by: tuple[int, ...]
) -> tuple[list[tuple[Line, Packet]], list[Line], list[Packet]]:
    """Pairs that agree in the fields ``by`` (0 stamp, 1 size, 2 checksum), and what is left."""
    at: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for number in range(len(packets) - 1, -1, -1):
        at[tuple(packets[number][k] for k in by)].append(number)
    pairs, open_lines, used = [], [], set()
    for line in lines:
        is_ = (line.stamp_us, line.size, line.crc32)
        there = at.get(tuple(is_[k] for k in by))
        if there:
            used.add(there[-1])
            pairs.append((line, packets[there.pop()]))
        else:
            open_lines.append(line)
    return pairs, open_lines, [p for k, p in enumerate(packets) if k not in used]


def frame_list(numbers: tuple[int, ...]) -> str:
    """Numbers for a person: "4, 7-9, 12", the first dozen stretches."""
    stretches: list[list[int]] = []
    for n in numbers:
        if stretches and n == stretches[-1][1] + 1:
            stretches[-1][1] = n
        else:
            stretches.append([n, n])
    words = [f"{a}" if a == b else f"{a}-{b}" for a, b in stretches[:12]]
    more = f" and more, {len(numbers)} in all" if len(stretches) > 12 else ""
    return ", ".join(words) + more
