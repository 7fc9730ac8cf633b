"""Public recordings of calibration boards, where they lie beside this checkout (see README)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from olivevib.arrays import Floats, Grey
from olivevib.calibration import BoardFinder, BoardView, parse_board
from olivevib.files.stills import read_grey
from olivevib.files.video import Video
from olivevib.progress import Tick

FOLDER = Path("../shared/data/calibration")
WEBCAM = "charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000,inverted"
WEBCAM_SIZE = (1280, 720)
SETS = {"A": "webcam4_charuco_A", "C": "webcam4_charuco_C_mirrored_cam"}
MIRRORED = {("C", 1)}


@dataclass(frozen=True)
class Camera:
    """One webcam of a recording: stamps of all frames (N,), board views of those that show it."""

    name: str
    stamps_s: Floats
    views: tuple[BoardView, ...]


def there(name: str = "") -> bool:
    """Whether the recordings (or one of them) lie beside this checkout."""
    return (FOLDER / name).is_dir()


def frames(path: Path) -> list[Grey]:
    """All pictures of a video."""
    with Video.open(path) as video:
        return [frame.grey.copy() for frame in video.frames() if frame.grey is not None]


def stamps(name: str, camera: int) -> Floats:
    """Stamps of one camera's frames on a straight line, as the stages use them, s."""
    raw = _raw_stamps(name, camera)
    count = np.arange(raw.size)
    return np.asarray(np.polyval(np.polyfit(count, raw, 1), count), dtype=np.float64)


def stamps_off_s(name: str, camera: int) -> Floats:
    """How far each stamp of the recording lies off that line, s."""
    return np.asarray(_raw_stamps(name, camera) - stamps(name, camera), dtype=np.float64)


def _raw_stamps(name: str, camera: int) -> Floats:
    table = np.genfromtxt(FOLDER / SETS[name] / "timestamps.csv", delimiter=",", names=True)
    return np.asarray(table["frame_time"][table["cam_id"] == camera], dtype=np.float64)


def webcams(name: str, tick: Tick) -> dict[int, Camera]:
    """The four webcams of recording A or C with their board views (a mirrored one flipped)."""
    out = {}
    for k in range(4):
        tick(k, 4, f"recording {name}, camera {k}")
        times = stamps(name, k)
        finder = BoardFinder(parse_board(WEBCAM))
        views = []
        pictures = frames(FOLDER / SETS[name] / f"cam_{k}.mp4")
        for n, (grey, t) in enumerate(zip(pictures, times, strict=False)):
            seen = np.ascontiguousarray(grey[:, ::-1]) if (name, k) in MIRRORED else grey
            view = finder.find(seen, n, float(t))
            views += [] if view is None else [view]
        out[k] = Camera(f"{name}{k}", times, tuple(views))
    return out


def stills(folder: str, pattern: str, spec: str) -> tuple[list[BoardView], tuple[int, int], int]:
    """Board views of a folder of stills, their size, and how many stills there are."""
    finder, views, size, count = BoardFinder(parse_board(spec)), [], (0, 0), 0
    for k, path in enumerate(sorted((FOLDER / folder).glob(pattern))):
        grey = read_grey(path)
        size, count = (grey.shape[1], grey.shape[0]), count + 1
        view = finder.find(grey, k)
        views += [] if view is None else [view]
    return views, size, count
