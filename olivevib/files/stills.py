"""Still pictures, and one door for a calibration path: a video, or a folder of stills."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import cv2
import numpy as np

from olivevib.arrays import Grey
from olivevib.errors import Caution, InputError
from olivevib.files.container import MAX_PIXELS
from olivevib.files.image_size import image_size
from olivevib.files.video import Frame, Video

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
MAX_BYTES = 500_000_000
_NAN = float("nan")


def list_stills(folder: str | Path, side: str) -> tuple[Path, ...]:
    """The stills of one camera in a folder, in the order a person counts (2 before 10).

    Those whose names begin with the side ("left", "right"), if there are any for either side;
    else all pictures of the folder. Raises InputError where there are none.
    """
    here = Path(folder)
    try:
        files = [p for p in here.iterdir() if p.is_file() and not p.name.startswith(".")]
    except OSError as error:
        raise InputError(
            f"The folder {here} cannot be read.", error.strerror or str(error), "Check the name."
        ) from error
    pictures = sorted((p for p in files if p.suffix.lower() in IMAGE_SUFFIXES), key=_natural)
    sided = any(p.name.lower().startswith(("left", "right")) for p in pictures)
    mine = [p for p in pictures if not sided or p.name.lower().startswith(side.lower())]
    if not mine:
        kinds = ", ".join(suffix[1:] for suffix in IMAGE_SUFFIXES)
        whose = f" whose names begin with {side}" if pictures else ""
        raise InputError(
            f"The folder {here} holds no pictures{whose}.",
            f"Pictures are files of the kinds {kinds}.",
            f"Put the pictures of the {side} camera there, or give a video.",
        )
    return tuple(mine)


def read_grey(path: str | Path) -> Grey:
    """One still as grey levels (H, W) uint8, in the rows as they are stored.

    A turn noted in the picture's EXIF data is not applied, because rows are instants; 16-bit
    pictures keep their upper 8 bits. Raises InputError for a missing, oversized or damaged file.
    """
    file = Path(path)
    try:
        size = file.stat().st_size
        data = file.read_bytes() if size <= MAX_BYTES else b""
    except FileNotFoundError as error:
        raise InputError(f"The picture {file} does not exist.", "", "Check the name.") from error
    except OSError as error:
        raise InputError(
            f"The picture {file} cannot be read.", error.strerror or str(error), ""
        ) from error
    if size == 0:
        raise InputError(f"The picture {file} is empty.", "", "Copy it again from the camera.")
    shape = image_size(data)
    if size > MAX_BYTES or (shape is not None and shape[0] * shape[1] > MAX_PIXELS):
        raise InputError(
            f"The picture {file} is too large ({size} bytes, {shape or 'unknown'} pixels).",
            f"At most {MAX_PIXELS // 1_000_000} million pixels are read.",
            "Give the pictures as the camera took them.",
        )
    grey = None if shape is None else _decode(data)
    if grey is None:
        raise InputError(
            f"{file} is not a picture that can be read.",
            "It is damaged, cut off, or of another kind than its name says.",
            "Copy it again from the camera, or take it out of the folder.",
        )
    return grey


def _decode(data: bytes) -> Grey | None:
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        grey = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error:
        return None
    return None if grey is None else np.ascontiguousarray(grey, np.uint8)


def _natural(path: Path) -> tuple[list[tuple[int, int, str]], str]:
    """Sorts digits in a name as numbers; the name itself decides between 1 and 01."""
    parts = re.findall(r"[0-9]+|[^0-9]+", path.name.lower())
    key = [(0, int(p), "") if p[0].isdecimal() else (1, 0, p) for p in parts]
    return key, path.name


@dataclass(frozen=True)
class GreySource:
    """Frames of one camera from a video or from a folder of stills; a context manager.

    count_hint: how many there are (for a video what its header promises, or None). Stills have
    no time stamps (NaN); ``names`` says which file each frame comes from, empty for a video.
    """

    path: Path
    kind: Literal["video", "stills"]
    size_px: tuple[int, int]
    count_hint: int | None
    stills: tuple[Path, ...] = ()
    video: Video | None = None

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
        if self.video is not None:
            self.video.close()

    @property
    def names(self) -> tuple[str, ...]:
        """The file name of each still."""
        return tuple(still.name for still in self.stills)

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """What the last complete walk found missing or damaged in a video."""
        return () if self.video is None else self.video.cautions

    def frames(self) -> Iterator[Frame]:
        """All frames in order.

        Raises InputError for a still that cannot be read or has another size than the first, and
        as ``Video.frames`` does.
        """
        return self._still_frames() if self.video is None else self.video.frames()

    def _still_frames(self) -> Iterator[Frame]:
        for index, still in enumerate(self.stills):
            grey = read_grey(still)
            size = (grey.shape[1], grey.shape[0])
            if size != self.size_px:
                raise InputError(
                    f"The picture {still} is {size[0]} x {size[1]} pixels, {self.stills[0].name} "
                    f"is {self.size_px[0]} x {self.size_px[1]}.",
                    "All pictures of one camera must have the same size and must not be turned.",
                    "Take the odd ones out of the folder.",
                )
            yield Frame(index, _NAN, grey)


def open_source(path: str | Path, side: str) -> GreySource:
    """A calibration path as frames: a video, or a folder of stills of the side's camera.

    Raises as ``Video.open``, ``list_stills`` and ``read_grey`` do.
    """
    if Path(path).is_dir():
        stills = list_stills(path, side)
        height, width = read_grey(stills[0]).shape
        return GreySource(Path(path), "stills", (width, height), len(stills), stills)
    video = Video.open(path)
    info = video.info
    return GreySource(
        info.path, "video", info.size_px, info.frame_count_hint, stills=(), video=video
    )
