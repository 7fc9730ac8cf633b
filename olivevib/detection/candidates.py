"""Grey image to location bars for the fine detector: a sharpened threshold, moments, affine fill.

The threshold works on the logarithm of the light, where a shadow is a step and not a factor. A bar
under a steep view is a thin parallelogram that blur joins to the code: sharpening parts them. A
second pass on a third of the resolution finds large markers and those that motion has smeared.
The fill of a domain is measured by its moments, which do not change under any affine view.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from olivevib.arrays import Grey
from olivevib.detection.domains import Bars, Domains, dark_domains, principal_axes

WINDOW_PX = 21  # of the local mean
SHARP = 1.0  # L' = L + SHARP (L - Gauss(L, 1 px))
BELOW = 0.2  # below the local mean of ln(level + 4)
SMALLER = 3  # pixels of the second pass's pixel
FILL = (0.72, 1.2)  # area over that of the parallelogram of equal moments
AREA_PX2 = (5, 4000)
LENGTH_PX = (3.0, 260.0)

_STEP = 60.0  # levels of an 8-bit logarithm per unit
_LOGARITHM = np.rint((np.log(np.arange(256) + 4.0) - np.log(4.0)) * _STEP).astype(np.uint8)


def dark_passes(grey: Grey) -> tuple[tuple[Grey, int], ...]:
    """Dark pixels of ``grey`` (H, W), non-zero, each with its scale: px a side of its pixels."""
    level = np.asarray(cv2.LUT(grey, _LOGARITHM), dtype=np.uint8)
    if min(level.shape) < SMALLER * WINDOW_PX:
        return ((_dark(level), 1),)
    height, width = (side // SMALLER for side in level.shape)
    whole = level[: SMALLER * height, : SMALLER * width]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    return (_dark(level), 1), (_dark(np.asarray(small, dtype=np.uint8)), SMALLER)


def _dark(level: Grey) -> Grey:
    """Where the sharpened level lies below the local mean."""
    soft = cv2.GaussianBlur(level, (5, 5), 1.0)
    sharp = cv2.addWeighted(level, 1 + SHARP, soft, -SHARP, round(BELOW * _STEP))
    mean = cv2.boxFilter(level, -1, (WINDOW_PX, WINDOW_PX))
    return np.asarray(cv2.compare(sharp, mean, cv2.CMP_LT), dtype=np.uint8)


def fine_bars(dark: Grey, scale: int = 1) -> Bars:
    """Domains that may be location bars or parts of the code, by their moments alone.

    length and width are those of the rectangle of equal moments, sqrt(12 variance); places and
    lengths in px of the picture whose pixels are ``scale`` times smaller.
    """
    bars = bars_of(dark_domains(dark, AREA_PX2))
    if scale == 1:
        return bars
    centre = scale * bars.centre + (scale - 1) / 2
    area = scale**2 * bars.area
    return replace(
        bars, centre=centre, length=scale * bars.length, width=scale * bars.width, area=area
    )


def bars_of(domains: Domains) -> Bars:
    """The bars among the domains."""
    xx, yy, xy = domains.moments.T
    with np.errstate(divide="ignore", invalid="ignore"):
        fill = domains.area / (12 * np.sqrt(np.maximum(xx * yy - xy * xy, 1e-12)))
    wanted = np.flatnonzero((fill > FILL[0]) & (fill < FILL[1]) & (domains.area > 0))
    large, small, axis = principal_axes(domains.moments[wanted])
    length, width = np.sqrt(12 * large), np.sqrt(12 * np.maximum(small, 0))
    bars = Bars(domains.centre[wanted], axis, length, width, domains.area[wanted], wanted)
    return bars.only((length >= LENGTH_PX[0]) & (length <= LENGTH_PX[1]))
