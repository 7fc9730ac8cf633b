"""A camera at an address: Motion JPEG over HTTP, as network cameras, phones and servers send it."""

from __future__ import annotations

import base64
import socket
import ssl
import threading
import time
import urllib.parse
from collections.abc import Iterator
from email.message import Message

from olivevib.errors import InputError
from olivevib.files.capture.camera import POLL_S, CameraFacts, Controls, Mode, Shot
from olivevib.files.capture.jpeg import MAX_JPEG, JpegSplitter
from olivevib.files.image_size import image_size

OPEN_S = 5.0
CHUNK = 262_144
MAX_LINE = 8192
STAMP_HEADERS = ("x-timestamp", "x-frame-timestamp")  # seconds, as mjpg-streamer writes them


class _Stopped(Exception):
    """The walk shall end."""


class _Wire:
    """Bytes of the answer, chunked transfer undone; waits in steps so that it can be stopped."""

    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        self._raw = bytearray()  # received, transfer coding still on
        self._held = bytearray()  # body bytes
        self._chunked = False
        self.stop: threading.Event | None = None
        self.deadline_s = time.monotonic() + OPEN_S

    def send(self, lines: list[str]) -> None:
        """Send a request."""
        self._socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode("latin-1"))

    def begin_body(self, *, chunked: bool) -> None:
        """The head of the answer is read; what follows is the body."""
        self._chunked = chunked
        self._raw, self._held = self._held, bytearray()

    def line(self) -> bytes:
        """The next line without its end; OSError where it never ends."""
        while (end := self._held.find(b"\n")) < 0:
            if len(self._held) > MAX_LINE:
                raise OSError("a header line of the stream never ends")
            self._more()
        out = bytes(self._held[:end]).rstrip(b"\r")
        del self._held[: end + 1]
        return out

    def exactly(self, count: int) -> bytes:
        """The next ``count`` bytes."""
        while len(self._held) < count:
            self._more()
        out = bytes(self._held[:count])
        del self._held[:count]
        return out

    def some(self) -> bytes:
        """Whatever comes next, at least a byte."""
        if not self._held:
            self._more()
        out = bytes(self._held)
        self._held.clear()
        return out

    def _more(self) -> None:
        """Wait for more of the body."""
        if not self._chunked:
            self._held += self._raw if self._raw else self._receive()
            self._raw.clear()
            return
        size = int(self._raw_line().split(b";")[0], 16)
        while len(self._raw) < size + 2:
            self._raw += self._receive()
        self._held += self._raw[:size]
        del self._raw[: size + 2]
        if size == 0:
            raise ConnectionAbortedError("the camera ended the stream")

    def _raw_line(self) -> bytes:
        while (end := self._raw.find(b"\n")) < 0:
            if len(self._raw) > MAX_LINE:
                raise OSError("the stream is not chunked as it says")
            self._raw += self._receive()
        out = bytes(self._raw[:end])
        del self._raw[: end + 1]
        return out

    def _receive(self) -> bytes:
        while True:
            if self.stop is not None and self.stop.is_set():
                raise _Stopped
            try:
                data = self._socket.recv(CHUNK)
            except TimeoutError:
                if self.stop is None and time.monotonic() > self.deadline_s:
                    raise TimeoutError("the camera does not answer") from None
                continue
            if not data:
                raise ConnectionAbortedError("the camera closed the connection")
            return data


class HttpCamera:
    """MJPEG over HTTP (multipart/x-mixed-replace, or bare JPEG pictures one after another)."""

    def __init__(self, address: str, mode: Mode) -> None:
        """Connect and wait for the first picture; InputError with the remedy where none comes."""
        self._address = address
        self._splitter: JpegSplitter | None = None
        self._ready: list[Shot] = []
        self._socket = _connect(address)
        try:
            self._wire = _Wire(self._socket)
            self._boundary = _ask(self._wire, address)
            self._first = self._next()
        except (OSError, ValueError) as error:
            self._socket.close()
            raise _unusable(address, str(error)) from error
        except InputError:
            self._socket.close()
            raise
        size = image_size(self._first.data)
        if size is None:
            self._socket.close()
            raise _unusable(address, "what it sends are no JPEG pictures")
        stamp_kind = "host" if self._first.device_ns is None else "header"
        place = urllib.parse.urlsplit(address)
        shown = place._replace(netloc=place.netloc.rpartition("@")[2]).geturl()
        self._facts = CameraFacts(
            shown, place.hostname or "", "", "http", "mjpeg", "", size, mode.fps, stamp_kind
        )

    @property
    def facts(self) -> CameraFacts:
        """What is known of it; a password in the address is left out."""
        return self._facts

    def shots(self, stop: threading.Event) -> Iterator[Shot]:
        """Pictures as they come; OSError where the camera goes away."""
        self._wire.stop = stop
        yield self._first
        while True:
            try:
                yield self._next()
            except _Stopped:
                return

    def controls(self) -> Controls:
        """Nothing: HTTP says nothing of exposure."""
        return Controls()

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def _next(self) -> Shot:
        while not self._ready:
            if self._boundary is None or self._splitter is not None:
                self._unframed()
            else:
                self._part()
        return self._ready.pop(0)

    def _part(self) -> None:
        """One part of the answer: boundary, headers, picture."""
        wire = self._wire
        while not wire.line().startswith(b"--"):
            continue
        headers: dict[str, str] = {}
        while line := wire.line():
            name, _, value = line.decode("latin-1").partition(":")
            headers[name.strip().lower()] = value.strip()
        arrived = time.monotonic_ns()
        length = headers.get("content-length", "")
        if not length.isdigit():
            self._splitter = JpegSplitter()
            return
        if int(length) > MAX_JPEG:
            raise OSError(f"a picture of {length} bytes is announced")
        data = wire.exactly(int(length))
        if data:
            self._ready.append(Shot(data, _stamp_ns(headers), arrived))

    def _unframed(self) -> None:
        """Pictures without a stated length: by their own markers."""
        if self._splitter is None:
            self._splitter = JpegSplitter()
        data = self._wire.some()
        arrived = time.monotonic_ns()
        self._ready += [Shot(jpeg, None, arrived) for jpeg in self._splitter.feed(data)]


def _stamp_ns(headers: dict[str, str]) -> int | None:
    """The camera's own stamp, ns, from a header in seconds; exact to the last digit."""
    for name in STAMP_HEADERS:
        whole, _, part = headers.get(name, "").partition(".")
        if whole.isdigit() and (part.isdigit() or not part):
            return int(whole) * 1_000_000_000 + int((part + "0" * 9)[:9])
    return None


def _connect(address: str) -> socket.socket:
    parts = urllib.parse.urlsplit(address)
    try:
        secure = parts.scheme == "https"
        port = parts.port or (443 if secure else 80)
        connection = socket.create_connection((parts.hostname or "", port), timeout=OPEN_S)
        if secure:
            connection = ssl.create_default_context().wrap_socket(
                connection, server_hostname=parts.hostname
            )
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.settimeout(POLL_S)
    except (OSError, ValueError) as error:
        raise _unusable(address, str(error)) from error
    return connection


def _ask(wire: _Wire, address: str) -> str | None:
    """Send the request and read the answer's head; the boundary, or None for bare pictures."""
    parts = urllib.parse.urlsplit(address)
    target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    lines = [f"GET {target} HTTP/1.0", f"Host: {parts.hostname}", "User-Agent: olivevib"]
    if parts.username is not None:
        user, password = (urllib.parse.unquote(v or "") for v in (parts.username, parts.password))
        secret = base64.b64encode(f"{user}:{password}".encode()).decode()
        lines.append(f"Authorization: Basic {secret}")
    wire.send(lines)
    status = wire.line().split()
    head = Message()
    while line := wire.line():
        name, _, value = line.decode("latin-1").partition(":")
        head[name.strip()] = value.strip()
    if len(status) < 2 or status[1] != b"200":
        told = " ".join(word.decode("latin-1") for word in status[1:])
        raise InputError(
            f"the camera at {parts.hostname} answered: {told or 'nothing that is HTTP'}.",
            f"It was asked for {target}.",
            "Give the address of its MJPEG stream, with user:password@ if it wants one.",
        )
    wire.begin_body(chunked="chunked" in str(head.get("transfer-encoding", "")).lower())
    if head.get_content_maintype() == "multipart":
        return str(head.get_param("boundary") or "")
    return None


def _unusable(address: str, why: str) -> InputError:
    host = urllib.parse.urlsplit(address).hostname or address
    return InputError(
        f"the camera at {host} cannot be used.",
        f"{why}.",
        "Check the address in a browser: it must show moving pictures (MJPEG).",
    )
