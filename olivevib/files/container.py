"""Opening a recording safely: only real video containers, only this file, with errors for people.

FFmpeg would also follow network addresses, lists of other files and device names that stand in
for a file name: here a name is an existing file on this machine or it is refused.
"""

from __future__ import annotations

import re
from pathlib import Path

import av
from av.container import InputContainer
from av.video.stream import VideoStream

from olivevib.errors import InputError, UsageError

CONTAINERS = (
    "mov,mp4,m4a,3gp,3g2,mj2",
    "matroska,webm",
    *("avi", "nut", "mpegts", "mpeg", "ogg", "flv", "asf"),
    *("mjpeg", "h264", "hevc", "yuv4mpegpipe"),  # bare streams, without time stamps of their own
)
MAX_PIXELS = 100_000_000  # a picture larger than this is damage or malice, not a webcam
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.\-]+:")  # http:, concat:, file: — but not C:
_DEVICES = {"con", "prn", "aux", "nul", *(f"{p}{n}" for p in ("com", "lpt") for n in range(10))}
_MP4_TOP = (b"ftyp", b"mdat", b"free", b"wide", b"skip", b"moof", b"styp", b"uuid")
_NO_TIMESTAMPS = 0x80  # AVFMT_NOTIMESTAMPS


def video_path(path: str | Path) -> Path:
    """The resolved absolute path of an existing, non-empty video file.

    Raises UsageError for a name that is no file name (address, list, device, network share),
    InputError for a missing or empty file and for a folder.
    """
    text = str(path)
    if _SCHEME.match(text) or text.startswith(("\\\\", "//")):
        raise UsageError(
            f"{text} is not the name of a file on this machine.",
            "Recordings are read from files only, never from addresses, lists or shares.",
            "Copy the recording to this machine and give its path.",
        )
    if Path(text).stem.split(".")[0].lower() in _DEVICES:
        raise UsageError(f"{text} names a device, not a file.", "", "Rename the recording.")
    if "\x00" in text:
        raise UsageError(f"{text!r} is not a file name.", "It holds a null character.", "")
    return _existing(Path(text))


def _existing(path: Path) -> Path:
    try:
        real = path.resolve(strict=True)
        size, folder, regular = real.stat().st_size, real.is_dir(), real.is_file()
    except FileNotFoundError as error:
        raise InputError(
            f"The video {path} does not exist.", "", "Check the name, or put the file there."
        ) from error
    except (OSError, RuntimeError) as error:
        raise InputError(f"The video {path} cannot be read.", str(error), "") from error
    if folder:
        raise InputError(f"{path} is a folder, not a video.", "", "Name the video file in it.")
    if not regular:
        raise InputError(f"{path} is not a plain file.", "", "Give the path of a recording.")
    if size == 0:
        raise InputError(
            f"The video {path} is empty (0 bytes).",
            "The recording or the copy never got as far as the first frame.",
            "Copy it again from the camera, or record again.",
        )
    return real


def open_container(path: Path) -> tuple[InputContainer, VideoStream]:
    """Open a path from ``video_path`` with its first video stream; the caller closes it.

    The stream's decoder runs in one thread: then damage is reported with the frame it belongs
    to and twice the same file gives twice the same frames. Raises InputError.
    """
    options = {"protocol_whitelist": "file", "format_whitelist": ",".join(CONTAINERS)}
    try:
        container = av.open(str(path), "r", container_options=options)
    except (av.error.FFmpegError, ValueError) as error:
        raise _cannot_open(path, error) from error
    try:
        return container, _first_video(path, container)
    except InputError:
        container.close()
        raise


def has_stamps(container: InputContainer) -> bool:
    """False for bare streams, whose frames carry no time."""
    return not int(container.format.flags) & _NO_TIMESTAMPS


def _first_video(path: Path, container: InputContainer) -> VideoStream:
    if not container.streams.video:
        kinds = sorted({stream.type for stream in container.streams})
        raise InputError(
            f"{path} holds no video.",
            f"It holds: {', '.join(kinds) or 'nothing'}.",
            "Give the file with the pictures.",
        )
    stream = container.streams.video[0]
    codec = stream.codec_context
    if codec is None:
        raise InputError(
            f"The pictures of {path} are coded in a way that cannot be read here.",
            "",
            "Record as MJPEG or H.264, or convert without changing the frames or their times.",
        )
    if codec.width * codec.height > MAX_PIXELS:
        raise InputError(
            f"{path} claims pictures of {codec.width} x {codec.height} pixels.",
            f"More than {MAX_PIXELS // 1_000_000} million pixels are refused.",
            "The file is probably damaged; copy it again.",
        )
    codec.thread_count = 1
    codec.copy_opaque = True  # each frame names the packet it came from
    codec.options = {"max_pixels": str(MAX_PIXELS)}
    if codec.codec.intra_only:
        codec.options = codec.options | {"err_detect": "explode"}
    return stream


def _cannot_open(path: Path, error: Exception) -> InputError:
    if _mp4_without_index(path):
        return InputError(
            f"The video {path} is cut off: its index was never written.",
            "An MP4 file keeps the list of its frames at the end; without the end no frame can "
            "be found. The recording was interrupted or the copy is incomplete.",
            "Copy it again. If the original is cut too, record again as NUT, MKV or AVI, which "
            "survive an interruption.",
        )
    return InputError(
        f"{path} is not a video that can be read.",
        str(error).split("] ")[-1],
        "Give an MP4, MOV, MKV, AVI or NUT file as the camera wrote it.",
    )


def _mp4_without_index(path: Path) -> bool:
    """True where the top-level boxes are those of an MP4 file, but the index ("moov") is not."""
    seen: list[bytes] = []
    size = path.stat().st_size
    with path.open("rb") as handle:
        at = 0
        while at + 8 <= size and len(seen) < 1000:
            handle.seek(at)
            head = handle.read(16)
            length, kind = int.from_bytes(head[:4], "big"), head[4:8]
            if length == 1:
                length = int.from_bytes(head[8:16], "big")
            if kind not in (*_MP4_TOP, b"moov"):
                break
            seen.append(kind)
            if length < 8:
                break
            at += length
    return bool(seen) and seen[0] in (b"ftyp", b"mdat") and b"moov" not in seen
