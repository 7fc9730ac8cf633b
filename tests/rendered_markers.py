"""Markers drawn with exact truth: pinhole, area-averaged pixels, PSF, noise; for the tests only."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from olivevib.geometry import apply_homography, rotation_from_vector

F_PX, Z_MM = 900.0, 1400.0


@dataclass(frozen=True)
class Look:
    """How a scene is seen: levels, blur, noise, samples a pixel."""

    dark: float = 40.0
    white: float = 210.0
    psf_px: float = 0.7
    noise: float = 2.0
    samples: int = 8
    ground: float = 120.0


@dataclass
class Canvas:
    """A grey scene to which markers are added; ``grey`` takes the picture."""

    width: int = 1280
    height: int = 720
    look: Look = field(default_factory=Look)
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def __post_init__(self) -> None:
        self.light = np.full((self.height, self.width), float(self.look.ground))

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
        s, n = self.look.samples, len(pattern)
        half = n / 2 + quiet
        card = apply_homography(H, [[-half, -half], [half, -half], [half, half], [-half, half]])
        margin = 1 + int(np.ceil(4 * self.look.psf_px))
        x0, y0 = np.floor(card.min(0) - margin).astype(int)
        x1, y1 = np.ceil(card.max(0) + margin + 1).astype(int)
        at = (np.arange(s) + 0.5) / s - 0.5
        xs = (np.arange(x0, x1)[:, None] + at).ravel()
        ys = (np.arange(y0, y1)[:, None] + at).ravel()
        G = np.linalg.inv(H)
        gx, gy = G[:, 0:1] * xs, G[:, 1:2] * ys + G[:, 2:3]
        w = gx[2][None] + gy[2][:, None]
        u = (gx[0][None] + gy[0][:, None]) / w
        v = (gx[1][None] + gy[1][:, None]) / w
        i, j = np.floor(u + n / 2).astype(int), np.floor(v + n / 2).astype(int)
        on = (np.abs(u) < half) & (np.abs(v) < half)
        inside = (i >= 0) & (i < n) & (j >= 0) & (j < n)
        black = np.zeros(u.shape, bool)
        black[inside] = pattern[j[inside], i[inside]]
        shape = (y1 - y0, s, x1 - x0, s)
        level = np.where(black, self.look.dark, self.look.white) * on
        ex, ey = apply_homography(H, [[0, 0]])[0]
        level = level * (1 + slope[0] * (xs - ex)[None] + slope[1] * (ys - ey)[:, None])
        cover, level = (self._spread(fine).reshape(shape).mean((1, 3)) for fine in (on, level))
        a, b = max(y0, 0), min(y1, self.height)
        c, d = max(x0, 0), min(x1, self.width)
        cut = np.s_[a - y0 : b - y0, c - x0 : d - x0]
        self.light[a:b, c:d] = self.light[a:b, c:d] * (1 - cover[cut]) + level[cut]

    def clutter(self, leaves: int = 1800, branches: int = 25, spots: int = 200) -> None:
        """Leaf ellipses, branches and spots as a background; call before adding markers."""
        size, rng = (self.width, self.height), self.rng
        image = np.full((self.height, self.width), 110, np.uint8)
        for _ in range(branches):
            a, b = rng.uniform(0, size), rng.uniform(0, size)
            level = int(rng.uniform(40, 140))
            cv2.line(
                image, a.astype(int), b.astype(int), level, int(rng.integers(2, 14)), cv2.LINE_AA
            )
        for _ in range(leaves):
            axes = (int(rng.uniform(6, 22)), int(rng.uniform(2, 7)))
            at = rng.uniform(0, size).astype(int)
            angle, level = rng.uniform(0, 180), int(rng.uniform(20, 230))
            cv2.ellipse(image, at, axes, angle, 0, 360, level, -1, cv2.LINE_AA)
        for _ in range(spots):
            at = rng.uniform(0, size).astype(int)
            cv2.circle(
                image, at, int(rng.integers(1, 5)), int(rng.uniform(150, 255)), -1, cv2.LINE_AA
            )
        self.light = cv2.GaussianBlur(image.astype(np.float64), (0, 0), max(self.look.psf_px, 0.1))

    def _spread(self, fine: np.ndarray) -> np.ndarray:
        """The point spread, at the fine samples: on whole pixels it would alias."""
        fine = fine.astype(np.float32)
        if self.look.psf_px <= 0:
            return fine
        return cv2.GaussianBlur(fine, (0, 0), self.look.psf_px * self.look.samples)

    def grey(self) -> np.ndarray:
        noisy = self.light + self.rng.normal(0, self.look.noise, self.light.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def pose(
    modules: int, size_px: float, tilt_deg: float, azimuth_deg: float, roll_deg: float, at_px
) -> np.ndarray:
    """H (3, 3) from centred modules to pixels of a marker seen by a pinhole of F_PX.

    size_px: frontal side of all modules; tilt: angle of normal and ray; at_px: image of the centre,
    as a point of a 1280 x 720 camera whose axis meets pixel (639.5, 359.5).
    """
    ray = np.array([(at_px[0] - 639.5) / F_PX, (at_px[1] - 359.5) / F_PX, 1.0])
    axis = np.cross([0, 0, 1.0], ray)
    sine = np.linalg.norm(axis)
    turn = axis / sine * np.arcsin(sine / np.linalg.norm(ray)) if sine > 1e-12 else np.zeros(3)
    facing = rotation_from_vector(turn)  # turns the optical axis into the ray
    a, t, r = np.radians([azimuth_deg, tilt_deg, roll_deg])
    R = (
        facing
        @ rotation_from_vector([t * np.cos(a), t * np.sin(a), 0])
        @ rotation_from_vector([0, 0, r])
    )
    module_mm = size_px * Z_MM / F_PX / modules
    distance = Z_MM * ray / np.linalg.norm(ray)
    K = np.array([[F_PX, 0, 639.5], [0, F_PX, 359.5], [0, 0, 1]])
    H = K @ np.column_stack([R[:, 0] * module_mm, R[:, 1] * module_mm, distance])
    return H / H[2, 2]


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
    half = int(np.ceil(path_px / 2)) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    a = canvas.rng.uniform(0, np.pi)
    for s in (np.arange(400) + 0.5) / 400 - 0.5:
        x, y = half + path_px * s * np.cos(a), half + path_px * s * np.sin(a)
        i, j = int(x), int(y)
        for dj, di in ((0, 0), (0, 1), (1, 0), (1, 1)):
            kernel[j + dj, i + di] += abs(1 - di - (x - i)) * abs(1 - dj - (y - j))
    canvas.light = cv2.filter2D(canvas.light, -1, kernel / kernel.sum())
