"""What lies on markers: covers, shadow edges, gradients, dappled sun; what cameras do to noise."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from olivevib.arrays import Bools, Floats, Grey
from olivevib.geometry import apply_homography
from olivevib.studies.detection.canvas import SIZE, Hardship, centre_of
from olivevib.studies.detection.scenes import Weather

DARK_COVER, WHITE_COVER, LEAF = 30.0, 220.0, 75.0
SHADOW = 0.35
GRADIENT = 4.0
LEAVES = 900  # whose shadows fall on the picture
SOFT_PX = (1.5, 4.0)  # sigma of the shadows' edges


def covered(share: float, level: float, corner: bool) -> Weather:
    """A share of the dark square covered by a flat level: a corner of it, or a strip."""

    def weather(rng: np.random.Generator) -> Callable[[Floats, float], Hardship]:
        def on(H: Floats, half: float) -> Hardship:
            edge = half - 2 * half * (np.sqrt(share) if corner else share)
            su, sv = rng.choice([-1.0, 1.0], 2)
            across = bool(rng.random() < 0.5)

            def mask(u: Floats, v: Floats) -> Bools:
                if corner:
                    out: Bools = (su * u > edge) & (sv * v > edge)
                else:
                    out = (su * u if across else sv * v) > edge
                return out

            return Hardship(mask=mask, level=level)

        return on

    return weather


def shadow_edge(rng: np.random.Generator) -> Callable[[Floats, float], Hardship]:
    """A hard shadow over one side of a line through each marker."""

    def on(H: Floats, half: float) -> Hardship:
        cx, cy = centre_of(H)
        angle = rng.uniform(0, 2 * np.pi)
        nx, ny = np.cos(angle), np.sin(angle)
        off = rng.uniform(-0.25, 0.25) * _side_px(H, half)

        def shade(x: Floats, y: Floats) -> Floats:
            far = (x - cx) * nx + (y - cy) * ny - off
            out: Floats = 1 - (1 - SHADOW) * np.clip(far * 8 + 0.5, 0, 1)
            return out

        return Hardship(shade=shade)

    return on


def gradient(rng: np.random.Generator) -> Callable[[Floats, float], Hardship]:
    """Light that falls to a quarter across each marker, in a direction of chance."""

    def on(H: Floats, half: float) -> Hardship:
        cx, cy = centre_of(H)
        angle, reach = rng.uniform(0, 2 * np.pi), _side_px(H, half) / 2
        nx, ny = np.cos(angle) / reach, np.sin(angle) / reach

        def shade(x: Floats, y: Floats) -> Floats:
            along = np.clip((x - cx) * nx + (y - cy) * ny, -1.5, 1.5)
            out: Floats = np.maximum(
                (1 + 1 / GRADIENT) / 2 - (1 - 1 / GRADIENT) / 2 * along, 0.5 / GRADIENT
            )
            return out

        return Hardship(shade=shade)

    return on


def dappled(covers: bool) -> Weather:
    """Soft shadows of leaves, x 0.3 to 0.6; ``covers``: leaves hide up to 15 % of markers too."""

    def weather(rng: np.random.Generator) -> Callable[[Floats, float], Hardship]:
        light = np.ones((SIZE[1], SIZE[0]), np.float32)
        for _ in range(LEAVES):
            at = (rng.uniform(0, 1, 2) * SIZE).astype(int).tolist()
            axes = [int(rng.uniform(8, 30)), int(rng.uniform(4, 14))]
            factor = float(rng.uniform(0.3, 0.6))
            cv2.ellipse(light, at, axes, float(rng.uniform(0, 180)), 0, 360, factor, -1)
        soft = cv2.GaussianBlur(light, (0, 0), rng.uniform(*SOFT_PX))

        def shade(x: Floats, y: Floats) -> Floats:
            maps = x.astype(np.float32), y.astype(np.float32)
            return np.asarray(cv2.remap(soft, *maps, cv2.INTER_LINEAR), dtype=np.float64)

        def on(H: Floats, half: float) -> Hardship:
            return Hardship(shade, _leaf(rng, half) if covers else None, LEAF)

        return on

    return weather


def _leaf(rng: np.random.Generator, half: float) -> Callable[[Floats, Floats], Bools]:
    """An ellipse at the rim of a marker that hides up to 15 % of it."""
    a, turn = rng.uniform(0, 2 * np.pi), rng.uniform(0, np.pi)
    long, short = half * rng.uniform(0.55, 1.0), half * rng.uniform(0.2, 0.35)
    x, y = 0.85 * half * np.cos(a), 0.85 * half * np.sin(a)

    def mask(u: Floats, v: Floats) -> Bools:
        p = (u - x) * np.cos(turn) + (v - y) * np.sin(turn)
        q = (v - y) * np.cos(turn) - (u - x) * np.sin(turn)
        out: Bools = (p / long) ** 2 + (q / short) ** 2 < 1
        return out

    return mask


def jpeg(quality: int) -> Callable[[Floats, float, np.random.Generator], Grey]:
    """A camera that compresses its pictures."""

    def develop(light: Floats, noise: float, rng: np.random.Generator) -> Grey:
        grain = rng.standard_normal(light.shape, dtype=np.float32) * np.float32(noise)
        grey = np.clip(np.rint(light + grain), 0, 255).astype(np.uint8)
        packed = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        return np.asarray(cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)

    return develop


def smoothed_noise(light: Floats, noise: float, rng: np.random.Generator) -> Grey:
    """Noise as denoising leaves it: blurred by 0.7 px, as strong as before."""
    white = rng.standard_normal(light.shape, dtype=np.float32)
    grain = cv2.GaussianBlur(white, (0, 0), 0.7)
    grain = grain * np.float32(noise / float(grain.std()))
    return np.asarray(np.clip(np.rint(light + grain), 0, 255), dtype=np.uint8)


def demosaiced(light: Floats, noise: float, rng: np.random.Generator) -> Grey:
    """A grey scene through a Bayer sensor, bilinear colours, and the grey of these."""
    grain = rng.standard_normal(light.shape, dtype=np.float32) * np.float32(noise)
    raw = np.clip(np.rint(light + grain), 0, 255).astype(np.uint8)
    colour = cv2.cvtColor(raw, cv2.COLOR_BayerBG2BGR)
    return np.asarray(cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _side_px(H: Floats, half: float) -> float:
    """Mean side of the dark square, px."""
    box = apply_homography(H, half * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]))
    return float(np.linalg.norm(np.roll(box, -1, axis=0) - box, axis=1).mean())
