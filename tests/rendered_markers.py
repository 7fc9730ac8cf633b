"""Markers with exact truth, drawn by the renderer of the studies, and what may lie on them."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from olivevib.geometry import apply_homography
from olivevib.studies.detection import canvas as studio
from olivevib.studies.detection.canvas import Hardship, Look, Print, path_kernel


@dataclass
class Canvas:
    """A grey scene to which markers are added; ``grey`` takes the picture."""

    width: int = 1280
    height: int = 720
    look: Look = field(default_factory=Look)
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def __post_init__(self) -> None:
        self.light = np.full((self.height, self.width), 120.0)

    def add(
        self,
        pattern: np.ndarray,
        H: np.ndarray,
        quiet: float = 2.0,
        slope: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Draw a dark pattern (n, n) with its white card through H (centred modules to px).

        slope: change of the light per px along x and y, 1 at the marker's centre.
        """
        x0, y0 = studio.centre_of(H)
        hard = Hardship(lambda x, y: 1 + slope[0] * (x - x0) + slope[1] * (y - y0))
        studio.lay(
            self.light, Print(pattern, quiet), H, self.look, hard if any(slope) else studio.CLEAR
        )

    def clutter(self, leaves: int = 1800, branches: int = 25, spots: int = 200) -> None:
        """Leaf ellipses, branches and spots as a background; call before adding markers."""
        self.light = studio.clutter(self.rng, (leaves, branches, spots), self.look.psf_px)

    def grey(self) -> np.ndarray:
        """The picture (H, W) uint8."""
        return studio.photo(self.light, self.look.noise, self.rng)


def pose(
    modules: int, size_px: float, tilt_deg: float, azimuth_deg: float, roll_deg: float, at_px
) -> np.ndarray:
    """H (3, 3) from centred modules to pixels of a marker seen by a pinhole of F_PX.

    size_px: frontal side of all modules; tilt: angle of normal and ray; at_px: image of the centre,
    as a point of a 1280 x 720 camera whose axis meets pixel (639.5, 359.5).
    """
    return studio.pose(modules, size_px, (tilt_deg, azimuth_deg, roll_deg), at_px)


def _around(H: np.ndarray, canvas: Canvas, half_px: int = 86):
    """Slices of a window about a marker's centre, with the pixels' x and y."""
    cx, cy = np.rint(apply_homography(H, [[0, 0]])[0]).astype(int)
    x0, x1 = max(cx - half_px, 0), min(cx + half_px, canvas.width)
    y0, y1 = max(cy - half_px, 0), min(cy + half_px, canvas.height)
    y, x = np.mgrid[y0:y1, x0:x1]
    return np.s_[y0:y1, x0:x1], x - cx, y - cy


def shadow_edge(canvas: Canvas, H: np.ndarray, factor: float, off_px: float) -> None:
    """A hard shadow over one side of a line through the marker."""
    window, x, y = _around(H, canvas)
    a = canvas.rng.uniform(0, 2 * np.pi)
    inside = np.clip(x * np.cos(a) + y * np.sin(a) - off_px + 0.5, 0, 1)
    canvas.light[window] *= 1 - (1 - factor) * inside


def dapple(canvas: Canvas, leaves: int = 900, blur_px: float = 3.0) -> None:
    """Soft shadows of leaves, x .3 to .6, all over the scene."""
    light = np.ones(canvas.light.shape, np.float32)
    for _ in range(leaves):
        at = canvas.rng.uniform(0, (canvas.width, canvas.height)).astype(int)
        axes = (int(canvas.rng.uniform(8, 30)), int(canvas.rng.uniform(4, 14)))
        angle, factor = canvas.rng.uniform(0, 180), float(canvas.rng.uniform(0.3, 0.6))
        cv2.ellipse(light, at, axes, angle, 0, 360, factor, -1)
    canvas.light *= cv2.GaussianBlur(light, (0, 0), blur_px)


def cover(canvas: Canvas, H: np.ndarray, share: float, level: float, corner: bool) -> None:
    """Cover a corner, or a strip along a side, of a marker of 11 modules with a flat level."""
    window, x, y = _around(H, canvas)
    cx, cy = np.rint(apply_homography(H, [[0, 0]])[0])
    at = np.column_stack([x.ravel() + cx, y.ravel() + cy])
    u, v = apply_homography(np.linalg.inv(H), at).T.reshape(2, *x.shape)
    su, sv = canvas.rng.choice([-1, 1], 2)
    if corner:
        edge = 5.5 - 11 * np.sqrt(share)
        covered = (su * u > edge) & (sv * v > edge)
    else:
        covered = (su * u if canvas.rng.random() < 0.5 else su * v) > 5.5 - 11 * share
    covered &= (np.abs(u) < 7.5) & (np.abs(v) < 7.5)
    canvas.light[window] = np.where(covered, level, canvas.light[window])


def motion(canvas: Canvas, path_px: float) -> None:
    """Steady motion during the exposure, in a random direction."""
    a = canvas.rng.uniform(0, np.pi)
    kernel = path_kernel(path_px * np.array([np.cos(a), np.sin(a)]))
    canvas.light = cv2.filter2D(canvas.light, -1, kernel)
