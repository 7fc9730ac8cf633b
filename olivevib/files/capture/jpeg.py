"""JPEG pictures out of a stream of bytes, handed on as soon as their last byte is there."""

from __future__ import annotations

from olivevib.errors import InputError

MAX_JPEG = 50_000_000  # bytes; what is longer is no picture of a webcam
_SOI, _EOI, _SCAN = b"\xff\xd8", b"\xff\xd9", 0xDA
_ALONE = {0x01, *range(0xD0, 0xD9)}  # markers without a length


class JpegSplitter:
    """Cuts a stream into JPEG pictures by their own markers; bytes between them are left out.

    A thumbnail inside a header segment is not taken for a picture: segments are skipped by length.
    """

    def __init__(self) -> None:
        self._held = bytearray()
        self._at = 0  # where to go on reading in the picture that began at byte 0
        self._in_scan = False

    def feed(self, data: bytes) -> list[bytes]:
        """Take the next bytes of the stream; returns the pictures that they complete.

        Raises InputError where no picture ends within MAX_JPEG bytes.
        """
        self._held += data
        done = []
        while (end := self._end()) is not None:
            done.append(bytes(self._held[:end]))
            del self._held[:end]
            self._at, self._in_scan = 0, False
        if len(self._held) > MAX_JPEG:
            raise InputError(
                "the stream holds no JPEG pictures.",
                f"No picture ended within {MAX_JPEG // 1_000_000} MB.",
                "Let the camera or program send Motion JPEG.",
            )
        return done

    def _end(self) -> int | None:
        """Where the picture at the beginning ends; None if its end is not there yet."""
        if self._at == 0 and not self._begin():
            return None
        while not self._in_scan:
            if not self._skip_segment():
                return None
        found = self._held.find(_EOI, self._at)
        if found < 0:
            self._at = max(self._at, len(self._held) - 1)
            return None
        return found + 2

    def _begin(self) -> bool:
        """Drop what stands before the next picture."""
        start = self._held.find(_SOI)
        if start < 0:
            del self._held[: max(0, len(self._held) - 1)]
            return False
        del self._held[:start]
        self._at = 2
        return True

    def _skip_segment(self) -> bool:
        """Go past one header segment; False where it is not complete yet."""
        held, at = self._held, self._at
        if at + 4 > len(held):
            return False
        if held[at] != 0xFF or held[at + 1] in _ALONE:
            self._at += 1 if held[at] != 0xFF else 2
            return True
        if held[at + 1] == 0xFF:  # fill byte
            self._at += 1
            return True
        length = int.from_bytes(held[at + 2 : at + 4], "big")
        if at + 2 + length > len(held):
            return False
        self._in_scan = held[at + 1] == _SCAN
        self._at += 2 + max(2, length)
        return True
