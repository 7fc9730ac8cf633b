"""What a colour sensor's mosaic leaves in the image of a marker.

In a demosaiced picture a pixel's grey is the mean of more or of fewer neighbours, by its place in
the 2 x 2 pattern of the colours: its blur alternates along rows, along columns and along both, each
by a variance of its own in x and in y. That is six numbers more, all linear; which colour lies
where need not be known.
"""

from __future__ import annotations

import cv2
import numpy as np

from olivevib.detection.pixels import Pixels, Singles
from olivevib.detection.template import Template


def bends_of(template: Template) -> Singles:
    """Second derivatives (h, w, 3) of the drawing along x and y, per px², and its level."""
    level = np.ascontiguousarray(template.texture[..., 0])
    second, one = np.array([1.0, -2.0, 1.0]) * template.samples**2, np.array([1.0])
    xx = cv2.sepFilter2D(level, cv2.CV_32F, second, one)
    yy = cv2.sepFilter2D(level, cv2.CV_32F, one, second)
    return np.asarray(cv2.merge([xx, yy, level]), dtype=np.float32)


def alternating(pixels: Pixels, bends: Singles) -> Singles:
    """Derivatives (6, N) by the alternating variances in x and y, from bends (2, N) there."""
    along = (1 - 2 * (pixels.x % 2)).astype(np.float32)
    down = (1 - 2 * (pixels.y % 2)).astype(np.float32)
    half = np.float32(0.5) * bends
    return np.concatenate([sign * half for sign in (along, down, along * down)])
