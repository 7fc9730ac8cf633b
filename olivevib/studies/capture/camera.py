"""A camera to measure with: Motion JPEG over HTTP on 127.0.0.1, every picture with its number.

``python -m olivevib.studies.capture.camera --fps 30 --log FILE`` serves in a process of its own,
prints its address and a picture's size, and writes number and checksum of what it sent to FILE.
"""

from __future__ import annotations

import argparse
import contextlib
import socket
import threading
import time
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import cv2
import numpy as np

BOUNDARY = b"picture"


def jpeg(size: tuple[int, int] = (128, 96), seed: int = 0, quality: int = 70) -> bytes:
    """A smooth picture with some noise, as a camera would compress it."""
    rng = np.random.default_rng(seed)
    small = (rng.random((9, 16)) * 160 + 40).astype(np.float32)
    grey = cv2.resize(small, size) + rng.normal(0, 4, size[::-1])
    coded = cv2.imencode(
        ".jpg", np.clip(grey, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    return bytes(coded[1])


def numbered(picture: bytes, number: int) -> bytes:
    """The picture with its number in a comment segment: no two have the same bytes."""
    text = b"frame %08d" % number
    return picture[:2] + b"\xff\xfe" + (len(text) + 2).to_bytes(2, "big") + text + picture[2:]


def number_of(data: bytes) -> int:
    """The number that ``numbered`` wrote."""
    at = data.index(b"frame ") + 6
    return int(data[at : at + 8])


@dataclass
class Plan:
    """How the camera sends; framing: "length", "bare", "unframed" or "chunked"."""

    fps: float = 100.0
    size: tuple[int, int] = (128, 96)
    framing: str = "length"
    stamps: bool = True
    limit: int = 1_000_000
    drop: frozenset[int] = frozenset()
    first_s: float = 5000.0  # the camera's own clock at frame 0
    picture: bytes = b""
    pictures: list[bytes] = field(default_factory=list)


class MjpegServer:
    """Serves one client after another; frame n is due n / fps after the client came."""

    def __init__(self, plan: Plan | None = None, port: int = 0) -> None:
        self.plan = plan or Plan()
        self._pictures = self.plan.pictures or [
            self.plan.picture or jpeg(self.plan.size, seed=k) for k in range(4)
        ]
        self.sent: list[tuple[int, int]] = []  # number, checksum
        self.pause = threading.Event()
        self._stop = threading.Event()
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.settimeout(0.1)
        self._client: socket.socket | None = None
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """Where it serves."""
        return f"http://127.0.0.1:{self._listener.getsockname()[1]}/video"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.vanish()

    def vanish(self) -> None:
        """Unplug: the connection breaks and nobody answers any more."""
        self._stop.set()
        if self._client is not None:
            with contextlib.suppress(OSError):
                self._client.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join(5)

    def stamp_ns(self, number: int) -> int:
        """The camera's own stamp of a frame, whole microseconds."""
        return round((self.plan.first_s + number / self.plan.fps) * 1e6) * 1000

    def data(self, number: int) -> bytes:
        """The coded picture with this number."""
        return numbered(self._pictures[number % len(self._pictures)], number)

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                self._client, _ = self._listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            with self._client, contextlib.suppress(OSError):
                self._client.settimeout(5)
                self._answer(self._client)

    def _answer(self, client: socket.socket) -> None:
        request = b""
        while b"\r\n\r\n" not in request:
            request += client.recv(4096)
        kind = b"multipart/x-mixed-replace;boundary=" + BOUNDARY
        kind = b"video/x-motion-jpeg" if self.plan.framing == "bare" else kind
        chunked = b"Transfer-Encoding: chunked\r\n" if self.plan.framing == "chunked" else b""
        client.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: " + kind + b"\r\n" + chunked + b"\r\n")
        start = time.monotonic()
        for number in range(self.plan.limit):
            wait = start + number / self.plan.fps - time.monotonic()
            if wait > 0 and self._stop.wait(wait):
                return
            while self.pause.is_set() and not self._stop.wait(0.02):
                continue
            if self._stop.is_set():
                return
            if number in self.plan.drop:
                continue
            data = self.data(number)
            client.sendall(self._framed(number, data))
            self.sent.append((number, zlib.crc32(data)))

    def _framed(self, number: int, data: bytes) -> bytes:
        if self.plan.framing == "bare":
            return data
        head = b"--" + BOUNDARY + b"\r\nContent-Type: image/jpeg\r\n"
        if self.plan.framing != "unframed":
            head += b"Content-Length: %d\r\n" % len(data)
        if self.plan.stamps:
            micros = self.stamp_ns(number) // 1000
            head += b"X-Timestamp: %d.%06d\r\n" % divmod(micros, 1_000_000)
        whole = head + b"\r\n" + data + b"\r\n"
        if self.plan.framing == "chunked":
            half = len(whole) // 2
            parts = (whole[:half], whole[half:])
            return b"".join(b"%x\r\n" % len(p) + p + b"\r\n" for p in parts)
        return whole


def shaken_tree() -> list[bytes]:
    """Pictures of the demo's eight markers, for a preview to find."""
    from olivevib.simulation import Renderer, build, scenario
    from olivevib.simulation.recording import jpeg as coded
    from olivevib.simulation.truth import frames_of

    stage = build(scenario("demo"), 1)
    renderer, exposed = Renderer(stage.tree, "left"), frames_of(stage, "left").exposed_s
    return [coded(renderer.frame(n, float(exposed[n])), 90) for n in range(120, 126)]


def main() -> None:
    """Serve until killed."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--log", required=True)
    parser.add_argument("--markers", action="store_true")
    told = parser.parse_args()
    pictures = shaken_tree() if told.markers else [jpeg((1280, 720), k, 80) for k in range(6)]
    server = MjpegServer(Plan(fps=told.fps, pictures=pictures))
    print(server.address, len(pictures[0]), flush=True)  # noqa: T201 (read by who started it)
    done = 0
    with Path(told.log).open("w", buffering=1, encoding="ascii") as log:
        while True:
            time.sleep(0.002)
            new = server.sent[done:]
            done += len(new)
            log.writelines(f"{number} {crc}\n" for number, crc in new)


if __name__ == "__main__":
    main()
