"""The image that a template predicts of a marker, and its derivatives by every unknown.

Unknowns: 8 of the homography from image to template, 3 of the dark level's plane, 3 of the
contrast's plane, S of the blur. See knowledge: the template model.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from olivevib.arrays import Floats
from olivevib.detection.mosaic import alternating, bends_of
from olivevib.detection.pixels import Pixels, Singles
from olivevib.detection.template import Template

STILL = 14  # unknowns, and one for each number of the blur
MOST_COLUMNS = 32000  # that cv2.remap takes in one row
LEAST_SHARE = 0.15  # of the contrast at the centre that is left anywhere


@dataclass
class Unknowns:
    """Unknowns in the passes: W (3, 3), light (o, ox, oy, g, gx, gy), blur (S,).

    spread (2, 2): covariance of the blur, px², in units of the pixels' scale: light falls on the
    marker before it is blurred. path (2,): motion that is drawn, px; None where nothing moved.
    """

    W: Floats
    light: Floats
    further: Floats
    spread: Floats
    path: Floats | None

    @classmethod
    def of(cls, template: Template, scale: float) -> Unknowns:
        """Where the template is drawn, without light; ``scale``: that of the pixels."""
        x, y = template.blur.motion_px
        round_px2 = template.blur.variance_px2 * np.eye(2)
        spread = (round_px2 + np.outer((x, y), (x, y)) / 12) / scale
        further = np.zeros(template.blurs)
        path = np.array([x, y]) if template.moving else None
        return cls(np.eye(3), np.zeros(6), further, spread, path)

    def add(self, change: Floats) -> None:
        """Change all (14 + S,)."""
        W = self.W.copy()
        W.ravel()[:8] += change[:8]
        self.W = W
        self.light = self.light + change[8:STILL]
        self.further = self.further + change[STILL:]


def read_texture(template: Template, pixels: Pixels, W: Floats) -> Singles:
    """Texture (3 + S, N) at the pixels seen through W, with a mosaic (3 + S + 6, N)."""
    X, Y = pixels.X, pixels.Y
    M = W.astype(np.float32)
    w = 1 / (M[2, 0] * X + M[2, 1] * Y + M[2, 2])
    offset = (pixels.centre - template.origin_px) * template.samples
    step = np.float32(pixels.scale * template.samples)
    x = (M[0, 0] * X + M[0, 1] * Y + M[0, 2]) * w * step + np.float32(offset[0])
    y = (M[1, 0] * X + M[1, 1] * Y + M[1, 2]) * w * step + np.float32(offset[1])
    parts = [_remapped(layer, x, y) for layer in template.layers]
    reads = np.ascontiguousarray(np.concatenate(parts, axis=1).T, dtype=np.float32)
    if not template.mosaic:
        return reads
    bends = _remapped(bends_of(template), x, y)[:, :2].T
    return np.concatenate([reads, alternating(pixels, bends)])


def _remapped(layer: Singles, x: Singles, y: Singles) -> Singles:
    """Channels (N, C) at columns x and rows y, as many at a time as cv2 takes."""
    parts = [
        cv2.remap(
            layer,
            x[None, first : first + MOST_COLUMNS],
            y[None, first : first + MOST_COLUMNS],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )[0]
        for first in range(0, x.size, MOST_COLUMNS)
    ]
    return np.asarray(np.concatenate(parts), dtype=np.float32)


def fitted_light(pixels: Pixels, T: Singles, weight: Singles) -> Floats:
    """Planes of dark level and contrast (6,) by linear least squares."""
    J = np.stack([np.ones_like(T), pixels.X, pixels.Y, T, pixels.X * T, pixels.Y * T])
    WJ = J * weight
    A = (WJ @ J.T).astype(np.float64) + 1e-3 * np.eye(6)
    return np.asarray(np.linalg.solve(A, (WJ @ pixels.level).astype(np.float64)))


def drawn_level(pixels: Pixels, reads: Singles, state: Unknowns) -> Singles:
    """Template level (N,), 0 dark, 1 white, with the further blur.

    A motion m is the same all over the image, hence in the template, which is drawn with one path,
    it is W's own derivative at each pixel times m.
    """
    out: Singles = reads[0] + state.further.astype(np.float32) @ reads[3:]
    if state.path is not None:
        x, y = (state.path + state.further[1:3]).astype(np.float32)
        M = state.W.astype(np.float32)
        w = 1 / (M[2, 0] * pixels.X + M[2, 1] * pixels.Y + M[2, 2])
        u = (M[0, 0] * pixels.X + M[0, 1] * pixels.Y + M[0, 2]) * w
        v = (M[1, 0] * pixels.X + M[1, 1] * pixels.Y + M[1, 2]) * w
        back = M[2, 0] * x + M[2, 1] * y
        out += ((M[0, 0] * x + M[0, 1] * y - back * u) * w - x) * reads[4]
        out += ((M[1, 0] * x + M[1, 1] * y - back * v) * w - y) * reads[5]
    return out


def _turned_path(pixels: Pixels, along: Singles, path: Floats) -> list[Singles]:
    """Derivatives (N,) by W's eight entries, near 1, of a drawing whose path W turns as well.

    along (2, N): its derivatives by the path's x and y.
    """
    X, Y = pixels.X, pixels.Y
    x, y = path.astype(np.float32)
    p, q = along
    none, both, ahead = np.zeros_like(X), x * p + y * q, X * p + Y * q
    return [
        x * p,
        y * p,
        none,
        x * q,
        y * q,
        none,
        -(X * both + x * ahead),
        -(Y * both + y * ahead),
    ]


def predicted(pixels: Pixels, light: Floats, T: Singles) -> Singles:
    """Grey levels (N,) that template level T has in the present light."""
    X, Y = pixels.X, pixels.Y
    o, ox, oy, g, gx, gy = light.astype(np.float32)
    out: Singles = o + ox * X + oy * Y + (g + gx * X + gy * Y) * T
    return out


def _blurred_light(reads: Singles, state: Unknowns) -> Singles:
    """What blurring the light too adds (N,); else 4:1 over 48 px moves a marker by 0.01 px."""
    x, y = (state.spread @ state.light[4:6]).astype(np.float32)
    out: Singles = x * reads[1] + y * reads[2]
    return out


def in_even_light(pixels: Pixels, state: Unknowns) -> Singles:
    """The pixels (N,) as template levels: the planes of dark and contrast taken out."""
    X, Y = pixels.X, pixels.Y
    o, ox, oy, g, gx, gy = state.light.astype(np.float32)
    gain = np.maximum(g + gx * X + gy * Y, np.float32(LEAST_SHARE) * g)
    out: Singles = (pixels.level - (o + ox * X + oy * Y)) / gain
    return out


def linearised(pixels: Pixels, reads: Singles, state: Unknowns) -> tuple[Singles, Singles]:
    """Jacobian (14 + S, N) and residual (N,) at the present unknowns."""
    X, Y = pixels.X, pixels.Y
    _, _, _, g, gx, gy = state.light.astype(np.float32)
    gain = g + gx * X + gy * Y
    T = drawn_level(pixels, reads, state)
    residual = pixels.level - predicted(pixels, state.light, T) - _blurred_light(reads, state)
    M = state.W.astype(np.float32)
    w = 1 / (M[2, 0] * X + M[2, 1] * Y + M[2, 2])
    bend = gain * w * np.float32(pixels.scale)
    p, q = bend * reads[1], bend * reads[2]
    back = (M[0, 0] * X + M[0, 1] * Y + M[0, 2]) * p + (M[1, 0] * X + M[1, 1] * Y + M[1, 2]) * q
    back *= -w
    one = np.ones_like(X)
    homography = [p * X, p * Y, p, q * X, q * Y, q, back * X, back * Y]
    if state.path is not None:
        turned = _turned_path(pixels, gain * reads[4:6], state.path + state.further[1:3])
        homography = [a + b for a, b in zip(homography, turned, strict=True)]
    (a, b), (c, d) = state.spread.astype(np.float32)
    XT, YT = (
        X * T + (a * reads[1] + c * reads[2]),
        Y * T + (b * reads[1] + d * reads[2]),
    )
    J = np.stack([*homography, one, X, Y, T, XT, YT, *(gain * reads[3:])])
    return J, residual
