"""A small trial with known truth: two markers before two cameras, made by the tests themselves."""

from pathlib import Path

import numpy as np
from scenes import aruco_pattern, draw_square

from olivevib.files.rig_file import write_rig
from olivevib.geometry import CameraModel, StereoRig, rotation_from_vector
from olivevib.pipeline import NewTrial, new_trial
from olivevib.simulation.recording import MjpegWriter, jpeg
from olivevib.trial import Trial

SIZE = (400, 300)
FPS = 30
SIZE_MM = 70.0
IDS = (3, 11)
F_HZ = 6.0


def rig() -> StereoRig:
    """Two cameras 300 mm apart, converging at 1 m."""
    K = np.array([[600.0, 0, 199.5], [0, 600.0, 149.5], [0, 0, 1]])
    camera = CameraModel(SIZE, K, np.zeros(5))
    R = rotation_from_vector([0.0, 0.29, 0.0])
    return StereoRig(camera, camera, R, -R @ np.array([300.0, 0.0, 40.0]))


def position_mm(marker: int, t_s: float) -> np.ndarray:
    """Where the middle of a marker is, in the left camera's frame."""
    rest = {3: (-60.0, -40.0, 1000.0), 11: (70.0, 45.0, 1040.0)}[marker]
    phase = 2 * np.pi * F_HZ * t_s + marker
    orbit = np.array([4.0 * np.cos(phase), 2.0 * np.sin(phase), 1.5 * np.cos(phase)])
    return np.array(rest) + orbit


def picture(side: str, t_s: float, seed: int) -> np.ndarray:
    """What one camera sees at an instant."""
    rng = np.random.default_rng(seed)
    image = np.full(SIZE[::-1], 205, np.uint8)
    h = SIZE_MM / 2
    flat = np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0.0]])
    for marker in IDS:
        points = position_mm(marker, t_s) + flat
        seen = points if side == "left" else rig().to_right(points)
        px = getattr(rig(), side).project(seen)
        x0, y0 = (px.mean(axis=0) - 40).astype(int)
        image[y0 : y0 + 80, x0 : x0 + 80] = draw_square(
            aruco_pattern(marker), px - [x0, y0], (80, 80), rng, noise=1.5
        )
    return image


def record(folder: Path, frames: int = 36, name: str = "{}.nut") -> dict[str, Path]:
    """Both videos of the small scene."""
    out = {}
    for k, side in enumerate(("left", "right")):
        pictures = [picture(side, n / FPS, 1000 * k + n) for n in range(frames)]
        out[side] = folder / name.format(side)
        with MjpegWriter(out[side], SIZE, FPS) as writer:
            for n, grey in enumerate(pictures):
                writer.write(jpeg(grey, 95), round(n / FPS * 1e6))
    return out


def make(folder: Path, videos: dict[str, Path], **more) -> Trial:
    """A new trial of the videos with the true rig."""
    rig_file = folder.parent / f"{folder.name}_rig.toml"
    write_rig(rig_file, rig(), {})
    plan = {
        "left": str(videos["left"]),
        "right": str(videos["right"]),
        "rig": str(rig_file),
        "markers": "aruco:DICT_4X4_50",
        "size_mm": SIZE_MM,
        "band_hz": (2.0, 12.0),
    }
    return new_trial(folder, NewTrial(**(plan | more)))
