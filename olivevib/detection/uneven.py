"""Uneven light on a marker: hard and dappled shadows divided out before the marker is fitted.

A shadow multiplies what it falls on. Where the marker's own white is known, first from a closing of
the image and then from the fitted template, the light is known too; dividing it out leaves a marker
in even light whose shadowed pixels are noisier and are trusted less.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from olivevib.arrays import Grey
from olivevib.detection.pixels import Pixels, Singles

CLOSED_MODULES = 3.2  # side of the closing that fills dark modules with the white around them
SMOOTH_MODULES = 0.5  # blur of the light found by closing
LOCAL_MODULES = 0.5  # blur of the light found by the template
WHITE = 200.0  # level to which white is brought
DARKEST = 0.02  # of the brightest light; darker pixels count no less
FAINT = 1e-3  # weight under which no pixel is near


def closed_light(grey: Grey, pixels: Pixels, module_px: float) -> Pixels:
    """The pixels with the light divided out that a closing of the image shows; no pose needed."""
    margin = int(np.ceil(CLOSED_MODULES * module_px))
    x0, y0 = max(int(pixels.x.min()) - margin, 0), max(int(pixels.y.min()) - margin, 0)
    window = grey[y0 : int(pixels.y.max()) + margin + 1, x0 : int(pixels.x.max()) + margin + 1]
    side = max(3, round(CLOSED_MODULES * module_px))
    element = np.ones((side, side), dtype=np.uint8)
    white = cv2.morphologyEx(window, cv2.MORPH_CLOSE, element)
    light = cv2.GaussianBlur(white.astype(np.float32), (0, 0), max(SMOOTH_MODULES * module_px, 0.5))
    return _divided(pixels, light[pixels.y - y0, pixels.x - x0])


def template_light(pixels: Pixels, image: Singles, weight: Singles, module_px: float) -> Pixels:
    """The pixels with the light divided out that the ratio to a fitted image (N,) shows.

    Ratio of local means, so that a pattern in the right place leaves no trace in the light.
    """
    x0, y0 = int(pixels.x.min()), int(pixels.y.min())
    shape = (int(pixels.y.max()) - y0 + 1, int(pixels.x.max()) - x0 + 1)
    at = (pixels.y - y0, pixels.x - x0)
    sums = np.zeros((*shape, 2), dtype=np.float32)
    sums[at] = np.stack([pixels.level * weight, image * weight + FAINT], axis=-1)
    local = cv2.GaussianBlur(
        sums, (0, 0), max(LOCAL_MODULES * module_px, 0.5), borderType=cv2.BORDER_CONSTANT
    )[at]
    return _divided(pixels, WHITE * local[:, 0] / np.maximum(local[:, 1], FAINT))


def _divided(pixels: Pixels, light: NDArray[Any]) -> Pixels:
    """Level and trust with ``light`` (N,), the local level of white, brought to WHITE."""
    share = np.maximum(light / max(float(light.max()), 1.0), DARKEST).astype(np.float32)
    scale = WHITE / np.maximum(light, 1.0)
    level = (pixels.level * scale).astype(np.float32)
    return replace(pixels, level=level, trust=(share * share).astype(np.float32))
