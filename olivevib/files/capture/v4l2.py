"""What a Linux camera says of itself: name, modes, controls (Video for Linux, ioctl by ioctl).

Source: the kernel's videodev2.h; numbers and layouts below are those of its structures.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from olivevib.files.capture.camera import Controls

Ioctl = Callable[[int, int, bytearray], object]

_READ, _BOTH = 2, 3


def _number(direction: int, number: int, size: int) -> int:
    return direction << 30 | size << 16 | ord("V") << 8 | number


_CAPABILITY = struct.Struct("<16s32s32sIII12x")
_FORMAT = struct.Struct("<III32sII12x")
_SIZE = struct.Struct("<III6I8x")
_INTERVAL = struct.Struct("<IIIII6I8x")
_CONTROL = struct.Struct("<Ii")
_QUERY = struct.Struct("<II32siiiiI8x")

QUERYCAP = _number(_READ, 0, _CAPABILITY.size)
ENUM_FMT = _number(_BOTH, 2, _FORMAT.size)
G_CTRL = _number(_BOTH, 27, _CONTROL.size)
S_CTRL = _number(_BOTH, 28, _CONTROL.size)
QUERYCTRL = _number(_BOTH, 36, _QUERY.size)
ENUM_FRAMESIZES = _number(_BOTH, 74, _SIZE.size)
ENUM_FRAMEINTERVALS = _number(_BOTH, 75, _INTERVAL.size)

_VIDEO_CAPTURE, _STREAMING, _DEVICE_CAPS = 0x1, 0x04000000, 0x80000000
_DISCRETE = 1

GAIN = 0x00980913
EXPOSURE_AUTO, EXPOSURE_ABSOLUTE, EXPOSURE_PRIORITY = 0x009A0901, 0x009A0902, 0x009A0903
FOCUS_ABSOLUTE, FOCUS_AUTO = 0x009A090A, 0x009A090C
EXPOSURE_MANUAL = 1
EXPOSURE_UNIT_US = 100.0
_DISABLED = 0x1
_MOST = 256  # entries of any list: a driver that never ends one must not hang us


@dataclass(frozen=True)
class CameraMode:
    """One mode that a camera offers; fps: the rates of this size, highest first."""

    codec: str
    size_px: tuple[int, int]
    fps: tuple[float, ...]

    @property
    def words(self) -> str:
        """Such as "MJPG 1280x720 30/24/15"."""
        rates = "/".join(f"{rate:g}" for rate in self.fps)
        return f"{self.codec} {self.size_px[0]}x{self.size_px[1]} {rates}".strip()


class V4l2Device:
    """One /dev/videoN, opened beside whoever streams from it; a context manager."""

    def __init__(self, path: str, ioctl: Ioctl | None = None) -> None:
        """Open the device; OSError where it cannot be."""
        if ioctl is None:
            import fcntl

            ioctl = fcntl.ioctl
        self._ioctl = ioctl
        self._handle = os.open(path, os.O_RDWR | os.O_NONBLOCK)

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
        """Release the device."""
        os.close(self._handle)

    @property
    def captures(self) -> bool:
        """True for a camera; False for its metadata node, an encoder or an output."""
        _, _, _, _, every, own = _CAPABILITY.unpack(self._ask(QUERYCAP, bytes(_CAPABILITY.size)))
        wanted = _VIDEO_CAPTURE | _STREAMING
        return bool((own if every & _DEVICE_CAPS else every) & wanted == wanted)

    @property
    def card(self) -> str:
        """The name of the camera."""
        raw: bytes = _CAPABILITY.unpack(self._ask(QUERYCAP, bytes(_CAPABILITY.size)))[1]
        return raw.split(b"\0")[0].decode("utf-8", "replace").strip()

    def modes(self) -> tuple[CameraMode, ...]:
        """Every discrete mode, in the order of the driver."""
        return tuple(
            CameraMode(_fourcc(code), size, tuple(sorted(self._rates(code, size), reverse=True)))
            for code in self._formats()
            for size in self._sizes(code)
        )

    def get(self, control: int) -> int | None:
        """The value of a control now; None where the camera has none."""
        try:
            return int(_CONTROL.unpack(self._ask(G_CTRL, _CONTROL.pack(control, 0)))[1])
        except OSError:
            return None

    def set(self, control: int, value: int) -> bool:
        """Set a control; False where the driver refuses."""
        try:
            self._ask(S_CTRL, _CONTROL.pack(control, value))
        except OSError:
            return False
        return True

    def has(self, control: int) -> bool:
        """Whether the camera knows the control and it is not switched off."""
        try:
            query = _QUERY.pack(control, 0, b"", 0, 0, 0, 0, 0)
            flags = int(_QUERY.unpack(self._ask(QUERYCTRL, query))[7])
        except OSError:
            return False
        return not flags & _DISABLED

    def controls(self) -> Controls:
        """Exposure and gain now."""
        exposure, gain = self.get(EXPOSURE_ABSOLUTE), self.get(GAIN)
        return Controls(
            None if exposure is None else exposure * EXPOSURE_UNIT_US,
            None if gain is None else float(gain),
        )

    def set_by_hand(self, exposure_us: float) -> bool:
        """Fix exposure, focus and frame rate; False where the exposure is not kept.

        The driver may round the exposure to its own steps, by less than a quarter.
        """
        self.set(EXPOSURE_PRIORITY, 0)
        self.set(FOCUS_AUTO, 0)
        wanted = max(1, round(exposure_us / EXPOSURE_UNIT_US))
        if not (self.set(EXPOSURE_AUTO, EXPOSURE_MANUAL) and self.set(EXPOSURE_ABSOLUTE, wanted)):
            return False
        kept = self.get(EXPOSURE_ABSOLUTE)
        return kept is not None and abs(kept - wanted) <= wanted / 4

    def manual_exposure_holds(self) -> bool | None:
        """Whether manual exposure can be set and is read back; None: there is none.

        The camera is put back as it was.
        """
        return self._holds(EXPOSURE_AUTO, EXPOSURE_MANUAL, EXPOSURE_ABSOLUTE)

    def manual_focus_holds(self) -> bool | None:
        """As ``manual_exposure_holds``, for the focus; a lens that cannot move holds (None)."""
        return self._holds(FOCUS_AUTO, 0, FOCUS_ABSOLUTE)

    def _holds(self, switch: int, manual: int, value: int) -> bool | None:
        if not self.has(switch) and not self.has(value):
            return None
        before, now = self.get(switch), self.get(value)
        if before is None or now is None:
            return False
        try:
            if not (self.set(switch, manual) and self.set(value, now)):
                return False
            return self.get(switch) == manual and self.get(value) == now
        finally:
            self.set(switch, before)

    def _ask(self, request: int, content: bytes) -> bytes:
        buffer = bytearray(content)
        self._ioctl(self._handle, request, buffer)
        return bytes(buffer)

    def _formats(self) -> Iterator[int]:
        with suppress(OSError):  # the driver ends its list with EINVAL
            for index in range(_MOST):
                blank = _FORMAT.pack(index, _VIDEO_CAPTURE, 0, b"", 0, 0)
                yield int(_FORMAT.unpack(self._ask(ENUM_FMT, blank))[4])

    def _sizes(self, code: int) -> Iterator[tuple[int, int]]:
        with suppress(OSError):
            for index in range(_MOST):
                blank = _SIZE.pack(index, code, *([0] * 7))
                _, _, kind, *values = _SIZE.unpack(self._ask(ENUM_FRAMESIZES, blank))
                if kind != _DISCRETE:
                    return
                yield int(values[0]), int(values[1])

    def _rates(self, code: int, size: tuple[int, int]) -> Iterator[float]:
        with suppress(OSError):
            for index in range(_MOST):
                blank = _INTERVAL.pack(index, code, *size, *([0] * 7))
                found = _INTERVAL.unpack(self._ask(ENUM_FRAMEINTERVALS, blank))
                if found[4] != _DISCRETE or not found[5]:
                    return
                yield round(found[6] / found[5], 3)


def _fourcc(code: int) -> str:
    return struct.pack("<I", code & 0x7FFFFFFF).decode("latin-1").strip()
