"""Which cameras are at this computer, in which modes, and which of them a name means."""

from __future__ import annotations

import contextlib
import importlib
import platform
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av

from olivevib.errors import UsageError
from olivevib.files.capture.v4l2 import CameraMode, V4l2Device

SYSTEM = Path("/sys/class/video4linux")
_DSHOW = re.compile(
    r"(?:vcodec|pixel_format)=(\S+)\s+min s=\d+x\d+ fps=\S+ max s=(\d+)x(\d+) fps=([\d.]+)"
)
_AVFOUNDATION = re.compile(r"(\d+)x(\d+)@\[[\d.]+ ([\d.]+)\]fps")


@dataclass(frozen=True)
class Listed:
    """One camera at this computer: how FFmpeg opens it (kind, address) and what it is called."""

    kind: str
    address: str
    title: str
    serial: str = ""
    modes: tuple[CameraMode, ...] = ()


def list_cameras() -> tuple[Listed, ...]:
    """Every camera that the system shows, in its order; empty where there are none."""
    system = platform.system()
    if system == "Linux":
        return tuple(_linux(SYSTEM))
    return tuple(_enumerated("dshow" if system == "Windows" else "avfoundation"))


def find_camera(name: str, known: Iterable[Listed] | None = None) -> Listed:
    """The camera that a name means: its address, its number in the list, or part of its title.

    UsageError, naming what there is, where none or several fit.
    """
    cameras = list(list_cameras() if known is None else known)
    if name.isdigit() and int(name) < len(cameras):
        return cameras[int(name)]
    exact = [c for c in cameras if name in (c.address, c.title, c.serial)]
    if not exact and name.startswith("/dev/"):
        real = str(Path(name).resolve())
        exact = [c for c in cameras if c.address == real]
    found = exact or [c for c in cameras if name.lower() in c.title.lower()]
    if len(found) == 1:
        return found[0]
    listed = "; ".join(f"{k}: {c.title} ({c.address})" for k, c in enumerate(cameras))
    raise UsageError(
        f"{name!r} names {'several cameras' if found else 'no camera'}.",
        f"Cameras here: {listed or 'none'}.",
        "Give a number or an address of the list, http://… for a stream, the file of a recording, "
        "or simulated:demo to rehearse.",
    )


def _linux(system: Path) -> Iterable[Listed]:
    for place in sorted(system.glob("video*"), key=lambda p: int(p.name[5:] or 0)):
        address = f"/dev/{place.name}"
        try:
            with V4l2Device(address) as device:
                if device.captures:
                    yield Listed("v4l2", address, device.card, _serial(place), device.modes())
        except OSError as error:
            title = f"{_text(place / 'name')} (not usable: {error.strerror})"
            yield Listed("v4l2", address, title.strip())


def _serial(place: Path) -> str:
    """The serial number of a USB camera: the device above the interface has it."""
    return _text(place / "device" / ".." / "serial")


def _text(path: Path) -> str:
    try:
        return path.read_text("utf-8", errors="replace").strip()
    except OSError:
        return ""


def _enumerated(kind: str) -> Iterable[Listed]:
    """What FFmpeg lists on Windows and macOS."""
    try:
        devices = importlib.import_module("av.device").enumerate_input_devices(kind)
    except (ImportError, ValueError, OSError, av.error.FFmpegError):
        return
    for device in devices:
        if "video" not in device.media_types and device.media_types:
            continue
        prefix = "video=" if kind == "dshow" else ""
        address = prefix + device.name
        yield Listed(kind, address, device.description or device.name, "", _modes(kind, address))


def _modes(kind: str, address: str) -> tuple[CameraMode, ...]:
    """Modes as FFmpeg prints them while it refuses to open the device."""
    asked = {"list_options": "true"} if kind == "dshow" else {"framerate": "0.001"}
    level = av.logging.get_level()
    av.logging.set_level(av.logging.INFO)
    try:
        refused = contextlib.suppress(av.error.FFmpegError, OSError, ValueError)
        with av.logging.Capture() as logged, refused:  # the list is in what FFmpeg prints
            av.open(address, format=kind, container_options=asked).close()
        return modes_in("".join(entry[2] for entry in logged))
    finally:
        av.logging.set_level(level)


def modes_in(printed: str) -> tuple[CameraMode, ...]:
    """The modes in FFmpeg's own words, for dshow and avfoundation; each size with its top rate."""
    best: dict[tuple[str, tuple[int, int]], float] = {}
    found: list[tuple[str, Any]] = [(m[1], m.groups()[1:]) for m in _DSHOW.finditer(printed)]
    found += [("raw", m.groups()) for m in _AVFOUNDATION.finditer(printed)]
    for codec, (width, height, fps) in found:
        key = (codec, (int(width), int(height)))
        best[key] = max(best.get(key, 0.0), round(float(fps), 2))
    return tuple(CameraMode(codec, size, (fps,)) for (codec, size), fps in best.items())
