"""Parts of a recording whose camera went away and came back: named in order, joined at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from olivevib.files.capture.camera import CameraFacts, Controls, Shot
from olivevib.files.capture.recording import Recording
from olivevib.files.capture.sidecar import Line, read_sidecar, sidecar_of
from olivevib.files.container import open_container
from olivevib.files.packets import Packets
from olivevib.progress import Tick, silent


def part_path(video: Path, number: int) -> Path:
    """Where a part stands: left.nut, then left-2.nut, left-3.nut and so on."""
    return video if number == 1 else video.with_name(f"{video.stem}-{number}{video.suffix}")


def join_parts(parts: Sequence[Path], facts: CameraFacts, tick: Tick = silent) -> Path:
    """Make one recording of all parts in the place of the first; the others are removed.

    Coded pictures, stamps and lines are copied as they are; the numbers of the frames go on. Raises
    InputError (disk full) with all parts left as they were.
    """
    first = parts[0]
    if len(parts) == 1:
        return first
    beside = first.with_name(f".{first.stem}.joining{first.suffix}")
    joined = Recording(beside, facts, origin_ns=0)
    try:
        for part in parts:
            _copy(part, joined, tick)
        joined.close()
    except BaseException:
        joined.close()
        for path in (beside, sidecar_of(beside)):
            path.unlink(missing_ok=True)
        raise
    beside.replace(first)
    sidecar_of(beside).replace(sidecar_of(first))
    for part in parts[1:]:
        for path in (part, sidecar_of(part)):
            path.unlink()
    return first


def _copy(part: Path, joined: Recording, tick: Tick) -> None:
    sidecar = read_sidecar(sidecar_of(part))
    lines = {} if sidecar is None else {line.stamp_us: line for line in sidecar.lines}
    container, stream = open_container(part)
    with container:
        for packet, slip in Packets(part, container, stream):
            stamp_us = round(slip.stamp_s * 1e6)
            line = lines.get(stamp_us)
            if line is None:  # not acknowledged: it was in flight
                continue
            joined.append(_shot(bytes(packet), line), stamp_us * 1000, _controls(line))
            tick(joined.frames, None, f"joining {part.name}")


def _shot(data: bytes, line: Line) -> Shot:
    return Shot(data, line.device_ns, line.host_ns)


def _controls(line: Line) -> Controls:
    return Controls(line.exposure_us, line.gain)
