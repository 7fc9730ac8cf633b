"""Prints seen by a pinhole with exact truth: what every study of detection measures on.

A print is drawn on samples much finer than a pixel, where each sample takes the mean of its own
area; light, covers, motion and the point spread act there, then come the pixel, noise and rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Bools, Floats, Grey
from olivevib.geometry import apply_homography, rotation_from_vector

F_PX, Z_MM = 900.0, 1400.0
SIZE = (1280, 720)
MIDDLE = (639.5, 359.5)
REACHED = 4  # sigmas of the point spread around a card that are drawn

Shade: TypeAlias = Callable[[Floats, Floats], Floats]  # x, y px -> factor of the light
Image: TypeAlias = NDArray[np.float32]
Mask: TypeAlias = Callable[[Floats, Floats], Bools]  # u, v modules -> covered


@dataclass(frozen=True)
class Print:
    """Modules (n, n), True where dark, and the white card around them, modules."""

    dark: Bools
    quiet: float

    @property
    def modules(self) -> int:
        """Modules of a side of the dark square."""
        return len(self.dark)


@dataclass(frozen=True)
class Look:
    """How a scene is seen: grey levels, point spread px, noise, motion (2,) px, samples a px."""

    dark: float = 40.0
    white: float = 210.0
    psf_px: float = 0.7
    noise: float = 2.0
    motion_px: tuple[float, float] = (0.0, 0.0)
    samples: int = 4


@dataclass(frozen=True)
class Hardship:
    """What lies on one marker: a factor of the light, and a cover of one grey level."""

    shade: Shade | None = None
    mask: Mask | None = None
    level: float = 0.0


CLEAR = Hardship()


def pose(
    modules: int,
    size_px: float,
    angles_deg: tuple[float, float, float],
    at_px: tuple[float, float] | Floats,
) -> Floats:
    """H (3, 3) from centred modules to px; angles: tilt of normal and ray, azimuth, roll.

    size_px: frontal side of all modules; at_px: image of the centre in a camera of F_PX whose axis
    meets MIDDLE.
    """
    tilt, azimuth, roll = np.radians(angles_deg)
    ray = np.array([(at_px[0] - MIDDLE[0]) / F_PX, (at_px[1] - MIDDLE[1]) / F_PX, 1.0])
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = float(np.linalg.norm(axis))
    turn = axis / sine * np.arctan(sine) if sine > 1e-12 else np.zeros(3)
    R = (
        rotation_from_vector(turn)
        @ rotation_from_vector(np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) * tilt)
        @ rotation_from_vector(np.array([0.0, 0.0, roll]))
    )
    module_mm = size_px * Z_MM / F_PX / modules
    centre = Z_MM * ray / np.linalg.norm(ray)
    K = np.array([[F_PX, 0, MIDDLE[0]], [0, F_PX, MIDDLE[1]], [0, 0, 1]])
    H = K @ np.column_stack([R[:, 0] * module_mm, R[:, 1] * module_mm, centre])
    return np.asarray(H / H[2, 2], dtype=np.float64)


def moved(H: Floats, by_px: tuple[float, float] | Floats) -> Floats:
    """The pose with its image moved by (2,) px."""
    shift = np.array([[1.0, 0, by_px[0]], [0, 1, by_px[1]], [0, 0, 1]])
    out = shift @ H
    return np.asarray(out / out[2, 2], dtype=np.float64)


def centre_of(H: Floats) -> Floats:
    """Image (2,) of the centre."""
    out: Floats = H[:2, 2] / H[2, 2]
    return out


def ground(rng: np.random.Generator, size: tuple[int, int] = SIZE) -> Floats:
    """A smooth texture (H, W) about level 120."""
    coarse = rng.normal(0, 25, (size[1] // 12 + 2, size[0] // 12 + 2)).astype(np.float32)
    wide = cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.clip(120 + wide, 30, 220), dtype=np.float64)


def lay(light: Floats, what: Print, H: Floats, look: Look, hard: Hardship = CLEAR) -> None:
    """Draw a print at pose H into the light (H, W) of a picture."""
    half = what.modules / 2 + what.quiet
    card = apply_homography(
        H, np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    )
    margin = 1 + np.ceil(REACHED * look.psf_px + np.abs(look.motion_px).max() / 2)
    height, width = light.shape
    low = np.clip(np.floor(card.min(axis=0) - margin), 0, [width, height]).astype(int)
    high = np.clip(np.ceil(card.max(axis=0) + margin) + 1, 0, [width, height]).astype(int)
    if (high - low < 2).any():
        return
    window = np.s_[low[1] : high[1], low[0] : high[0]]
    if hard.shade is not None:
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.0, np.arange(low[1], high[1]) + 0.0)
        light[window] *= hard.shade(x, y)
    cover, level = _pixels(what, H, look, hard, (low, high))
    light[window] = light[window] * (1 - cover) + level


def _pixels(
    what: Print, H: Floats, look: Look, hard: Hardship, box: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Share that the card covers, and the level it adds, at the pixels of the box."""
    s = look.samples
    low, high = box
    x, y = ((np.arange((high[k] - low[k]) * s) + 0.5) / s - 0.5 for k in (0, 1))
    G = np.asarray(np.linalg.inv(H), dtype=np.float64)
    u, v = _modules_at(G, low, x, y)
    du, dv = _footprint(G, centre_of(H), s)
    half = np.float32(what.modules / 2 + what.quiet)
    on: Image = _ramp((half - np.abs(u)) / np.float32(du))
    on = on * _ramp((half - np.abs(v)) / np.float32(dv))
    level = look.dark + (look.white - look.dark) * _pattern(what, (u, v), (du, dv))
    if hard.shade is not None:
        level *= hard.shade(*np.meshgrid(x + low[0], y + low[1])).astype(np.float32)
    if hard.mask is not None:
        level = np.where(hard.mask(u.astype(np.float64), v.astype(np.float64)), hard.level, level)
    both = cv2.merge([on.astype(np.float32), (on * level).astype(np.float32)])
    both = _smeared(np.asarray(both, dtype=np.float32), look)
    small = cv2.resize(both, (int(high[0] - low[0]), int(high[1] - low[1])), None, 0, 0, 3)
    out = np.asarray(small, dtype=np.float64)
    return out[..., 0], out[..., 1]


def _modules_at(G: Floats, low: Floats, x: Floats, y: Floats) -> tuple[Image, Image]:
    """Module coordinates of the samples at columns x and rows y, px from ``low``.

    In single precision, which about a marker's own corner is good to 1e-5 px.
    """
    there = G @ np.array([[1, 0, low[0]], [0, 1, low[1]], [0, 0, 1.0]])
    across = (there[:, :1] * x).astype(np.float32)
    down = (there[:, 1:2] * y + there[:, 2:]).astype(np.float32)
    w = np.float32(1) / (across[2] + down[2][:, None])
    return (across[0] + down[0][:, None]) * w, (across[1] + down[1][:, None]) * w


def _footprint(G: Floats, at: Floats, samples: int) -> tuple[float, float]:
    """Width of a fine sample along u and v, modules, at the marker's centre."""
    w = G[2, 0] * at[0] + G[2, 1] * at[1] + G[2, 2]
    B = (G[:2, :2] - (G[:2] @ [*at, 1.0] / w)[:, None] * G[2, :2]) / w
    du, dv = np.abs(B).sum(axis=1) / samples
    return float(du), float(dv)


def _ramp(distance: Image) -> Image:
    out: Image = np.clip(distance + np.float32(0.5), 0, 1)
    return out


def _pattern(what: Print, at: tuple[Image, Image], width: tuple[float, float]) -> Image:
    """White (1) or dark (0) of fine samples, each the mean over its own width."""
    pad = int(np.ceil(what.quiet)) + 1
    white = np.pad(np.where(what.dark, 0, 1), pad, constant_values=1).astype(np.float32)
    maps = []
    for axis in (0, 1):
        place = at[axis] + np.float32(what.modules / 2 + pad)
        edge = np.rint(place)
        place -= edge
        maps.append(edge - 1 + _ramp(place / np.float32(width[axis])))
    read = cv2.remap(white, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(read, dtype=np.float32)


def _smeared(fine: Image, look: Look) -> Image:
    """Motion and point spread, on the fine samples: on whole pixels they would alias."""
    if np.hypot(*look.motion_px) > 0:
        kernel = path_kernel(look.samples * np.array(look.motion_px))
        path = cv2.filter2D(fine, -1, kernel, borderType=cv2.BORDER_REPLICATE)
        fine = np.asarray(path, dtype=np.float32)
    sigma = look.psf_px * look.samples
    side = 2 * int(np.ceil(REACHED * sigma)) + 1
    out = cv2.GaussianBlur(fine, (side, side), sigma, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(out, dtype=np.float32)


def path_kernel(path: Floats, points: int = 2000) -> Floats:
    """A straight path (2,), samples, as a filter kernel."""
    half = int(np.ceil(np.abs(path).max() / 2)) + 1
    steps = (np.arange(points) + 0.5) / points - 0.5
    x, y = half + path[0] * steps, half + path[1] * steps
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    for dj, di in ((0, 0), (0, 1), (1, 0), (1, 1)):
        np.add.at(kernel, (j + dj, i + di), abs(1 - di - (x - i)) * abs(1 - dj - (y - j)))
    out: Floats = kernel / kernel.sum()
    return out


def photo(light: Floats, noise: float, rng: np.random.Generator) -> Grey:
    """The picture (H, W) uint8 of a light: white noise, rounding, clipping."""
    grain = rng.standard_normal(light.shape, dtype=np.float32) * np.float32(noise)
    out: Grey = np.clip(np.rint(light + grain), 0, 255).astype(np.uint8)
    return out


def clutter(
    rng: np.random.Generator, counts: tuple[int, int, int] = (1800, 25, 200), psf_px: float = 0.7
) -> Floats:
    """Light (H, W) of leaf ellipses, branches and spots."""
    image = np.full((SIZE[1], SIZE[0]), 110, np.uint8)
    leaves, branches, spots = counts
    ends = rng.uniform(0, 1, (branches, 2, 2)) * SIZE
    for a, b in ends.astype(int):
        level, width = int(rng.uniform(40, 140)), int(rng.integers(2, 14))
        cv2.line(image, a.tolist(), b.tolist(), level, width, cv2.LINE_AA)
    places = (rng.uniform(0, 1, (leaves, 2)) * SIZE).astype(int).tolist()
    axes = np.column_stack([rng.uniform(6, 22, leaves), rng.uniform(2, 7, leaves)]).astype(int)
    turns, levels = rng.uniform(0, 180, leaves), rng.uniform(20, 230, leaves)
    for place, axis, turn, level in zip(places, axes.tolist(), turns, levels, strict=True):
        cv2.ellipse(image, place, axis, float(turn), 0, 360, int(level), -1, cv2.LINE_AA)
    for place in (rng.uniform(0, 1, (spots, 2)) * SIZE).astype(int).tolist():
        radius, level = int(rng.integers(1, 5)), int(rng.uniform(150, 255))
        cv2.circle(image, place, radius, level, -1, cv2.LINE_AA)
    blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), psf_px)
    return np.asarray(blurred, dtype=np.float64)
