"""The row time of a simulated sensor before a flashing lamp."""

from __future__ import annotations

import tempfile
from pathlib import Path

import cv2
import numpy as np

from olivevib.files.capture import CameraFacts, Controls, Recording, Shot
from olivevib.pipeline.row_time import measure_row_time
from olivevib.studies.study import Effort

LED_HZ, READOUT_S, EXPOSURE_S = 500.0, 0.027, 0.0005
WIDTH, HEIGHT, FPS, FRAMES = 160, 720, 29.97, 45


def row_time_error(effort: Effort, readout_s: float = READOUT_S) -> float:
    """Measured over true row time, minus one, of an MJPEG recording of the lamp."""
    rng = effort.draws(8, 3)
    with tempfile.TemporaryDirectory() as name:
        video = Path(name) / "left.nut"
        facts = CameraFacts("lamp", "", "", "v4l2", "mjpeg", "", (WIDTH, HEIGHT), FPS, "kernel")
        recording = Recording(video, facts, 0)
        shade = 1 - 0.3 * np.linspace(-1, 1, WIDTH) ** 2
        for n in range(FRAMES):
            rows = _exposed(n / FPS + np.arange(HEIGHT) * readout_s / HEIGHT)
            grey = (40 + 150 * rows)[:, None] * shade + rng.normal(0, 2.0, (HEIGHT, WIDTH))
            picture = np.clip(grey, 0, 255).astype(np.uint8)
            coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])[1]
            recording.append(Shot(bytes(coded), None, 0), round(n / FPS * 1e9), Controls())
        recording.close()
        found = measure_row_time(video, LED_HZ).found
    return found.row_time_s * HEIGHT / readout_s - 1


def _exposed(
    start_s: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Share of its exposure in which the lamp was on: on for the first half of each period."""

    def lit(
        t_s: np.ndarray[tuple[int], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        turns = t_s * LED_HZ
        whole = np.floor(turns)
        return np.asarray((whole * 0.5 + np.minimum(turns - whole, 0.5)) / LED_HZ)

    return np.asarray((lit(start_s + EXPOSURE_S) - lit(start_s)) / EXPOSURE_S)
